// The light of the rendered stills as a shader: the same terms as realizer/render/light.py, per fragment.
import { Vector3 } from "three";

export function lightUniforms(look, shade) {
  const uniforms = { furrow_shade: { value: new Vector3(...shade) } };
  for (const lamp of ["key", "fill", "rim"]) {
    for (const part of ["direction", "colour", "wrap"]) uniforms[`${lamp}_${part}`] = { value: new Vector3(...look[lamp][part]) };
    uniforms[`${lamp}_direction`].value.normalize();
  }
  for (const name of ["sky", "ground"]) uniforms[name] = { value: new Vector3(...look[name]) };
  for (const name of ["rim_power", "shadow", "highlight", "dull", "sharp", "knee"]) uniforms[name] = { value: look[name] };
  return uniforms;
}

// The backdrop of the rendered stills, as in realizer/render/backdrop.py: its smooth step in five stops.
export const REACH = [0.675, 0.75]; // of width and height, from the middle to the edge's colour
export const MIDDLE = [0.5, 0.444];

// [0..1 from the middle, colour]
export function stops({ backdrop_middle: middle, backdrop_edge: edge }) {
  return [0, 0.25, 0.5, 0.75, 1].map((t) => {
    const mix = t * t * (3 - 2 * t);
    const [r, g, b] = middle.map((m, k) => Math.round(255 * (m + (edge[k] - m) * mix)));
    return [t, `rgb(${r} ${g} ${b})`];
  });
}

export function backdrop(look) {
  const percent = (part) => `${100 * part}%`;
  const list = stops(look).map(([t, colour]) => `${colour} ${percent(t)}`);
  return `radial-gradient(${REACH.map(percent).join(" ")} at ${MIDDLE.map(percent).join(" ")}, ${list.join(", ")})`;
}

export const vertex = `
attribute vec4 albedo;
attribute float occlusion;
attribute float gloss;
attribute float tone;
varying vec3 v_normal, v_place, v_albedo;
varying float v_occlusion, v_gloss, v_tone;
void main() {
  v_normal = normal;
  v_place = position;
  v_albedo = albedo.rgb;
  v_occlusion = occlusion;
  v_gloss = gloss;
  v_tone = tone;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

export const fragment = `
uniform vec3 key_direction, key_colour, key_wrap, fill_direction, fill_colour, fill_wrap, rim_direction, rim_colour, rim_wrap;
uniform vec3 sky, ground;
uniform float rim_power, shadow, highlight, dull, sharp, knee;
uniform vec3 furrow_shade;
varying vec3 v_normal, v_place, v_albedo;
varying float v_occlusion, v_gloss, v_tone;
vec3 lamp(vec3 n, vec3 direction, vec3 colour, vec3 wrap) {
  return colour * max(vec3(0.0), (dot(n, direction) + wrap) / (1.0 + wrap));
}
vec3 srgb(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(c * 12.92, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}
void main() {
  vec3 n = normalize(v_normal);
  vec3 v = normalize(cameraPosition - v_place);
  vec3 h = normalize(key_direction + v);
  float reach = 1.0 - shadow * (1.0 - v_occlusion);
  vec3 edge = lamp(n, rim_direction, rim_colour, rim_wrap) * pow(1.0 - clamp(dot(n, v), 0.0, 1.0), rim_power);
  vec3 ambient = mix(ground, sky, 0.5 + 0.5 * n.y) * v_occlusion;
  float power = dull * pow(sharp / dull, v_gloss);
  vec3 shine = v_gloss * highlight * pow(max(dot(n, h), 1e-6), power) * key_colour;
  vec3 light = lamp(n, key_direction, key_colour, key_wrap) + lamp(n, fill_direction, fill_colour, fill_wrap) + edge;
  vec3 colour = v_albedo * (light * reach + ambient) + shine * reach;
  vec3 shoulder = 1.0 - (1.0 - knee) * exp(-(colour - knee) / (1.0 - knee));
  // A furrow reduces the picture's brightness, the ridge beside it (tone below 0) increases it.
  vec3 furrow = 1.0 - max(v_tone, 0.0) * furrow_shade + max(-v_tone, 0.0);
  gl_FragColor = vec4(min(srgb(mix(colour, shoulder, step(knee, colour))) * furrow, 1.0), 1.0);
}`;
