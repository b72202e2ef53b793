// How a face is drawn: the formula of the rendered stills, realizer/render/surface.glsl, in three.js.
import {
  BackSide, CustomBlending, DepthTexture, DoubleSide, EqualDepth, FrontSide, GLSL3, LessEqualDepth, OneFactor, RawShaderMaterial,
  UnsignedIntType, WebGLRenderTarget, ZeroFactor,
} from "three";
import surface from "../../../render/surface.glsl";

const vertexShader = `
uniform mat4 modelViewMatrix, projectionMatrix, shadowView;
uniform bool toLamp;
in vec3 position, normal, strand; in float fold; in vec2 uv; in vec4 colour; in vec2 occlusionRough;
out vec3 at, up, hair, tint; out vec2 map, hidden; out float folded;
invariant gl_Position;
void main() {
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  if (toLamp) { // what lies outside the lamp's box casts shadows too
    gl_Position = vec4((shadowView * vec4(position, 1.0)).xyz * 2.0 - 1.0, 1.0);
    gl_Position.z = clamp(gl_Position.z, -1.0, 1.0);
  }
  at = position; up = normalize(normal); hair = strand; tint = colour.rgb; map = uv; hidden = occlusionRough; folded = fold;
}`;

const head = `precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
${surface}
uniform vec3 cameraPosition;
uniform int kind;
in vec3 at, up, hair, tint; in vec2 map, hidden; in float folded;
out vec4 pixel;
`;
const COLOUR = "surfaceColour(kind, at, up, hair, map, tint, hidden, folded, gl_FrontFacing, cameraPosition)";
// Without relief and shadows.
const PLAIN = `${head}
vec3 plainColour() {
  vec3 view = unitOf(cameraPosition - at), n = unitOf(up);
  if (!gl_FrontFacing && dot(n, view) < 0.0 && kind != hairKind) n = -n;
  vec2 values = texture(surfaceMap, map).rg * hidden;
  vec3 albedo = linearOf(texture(albedoMap, map).rgb) * tint;
  return pictureOf(reflectedBy(kind, albedo, n, n, unitOf(hair), vec4(values.x, max(values.y, 0.06), 1.0, 1.0), view));
}`;
// Hair hides as many samples of a pixel as its alpha says; without samples, a pixel is hidden or not.
const DRAW = {
  full: `${head} void main() { pixel = vec4(${COLOUR}, 1.0); }`,
  plain: `${PLAIN} void main() { pixel = vec4(plainColour(), 1.0); }`,
};
const DRAW_HOLES = {
  full: `${head} void main() { pixel = vec4(${COLOUR}, coverOf(map, 0.0)); }`,
  plain: `${PLAIN} void main() { if (coverOf(map, 0.0) < 0.5) discard; pixel = vec4(plainColour(), 1.0); }`,
};
const FILL = `${head} void main() { pixel = vec4(1.0); }`;
// Neighbouring texels of the shadow map are hidden from different alphas on, as samples of a pixel are.
const CAST_HOLES = `${head}
void main() {
  ivec2 p = ivec2(gl_FragCoord.xy) & 1;
  if (coverOf(map, 1.0) * 255.0 <= float(((p.x + 2 * p.y) << 6) + 31)) discard;
  pixel = vec4(1.0);
}`;

// Blending that writes colours only, or alpha only.
const WRITES = { blending: CustomBlending, blendSrc: OneFactor, blendDst: ZeroFactor, blendSrcAlpha: ZeroFactor, blendDstAlpha: OneFactor };
const ALPHA = { ...WRITES, blendSrc: ZeroFactor, blendDst: OneFactor, blendSrcAlpha: OneFactor, blendDstAlpha: ZeroFactor };

// Return the materials that draw a group of triangles, one after the other, and the one that casts its shadow.
export function materialsOf({ kind, holes, doubleSided }, uniforms, full) {
  const make = (fragmentShader, toLamp, more) =>
    new RawShaderMaterial({
      glslVersion: GLSL3,
      uniforms: { ...uniforms, kind: { value: kind }, toLamp: { value: toLamp } },
      vertexShader,
      fragmentShader,
      side: doubleSided ? DoubleSide : toLamp ? BackSide : FrontSide, // the lamp's picture is upside down
      ...more,
    });
  const detail = full ? "full" : "plain";
  const samples = full && holes;
  const draw = [make((holes ? DRAW_HOLES : DRAW)[detail], false, samples ? { alphaToCoverage: true, ...WRITES } : {})];
  // Alpha has said which samples are covered; these are opaque.
  if (samples) draw.push(make(FILL, false, { depthFunc: EqualDepth, depthWrite: false, ...ALPHA }));
  return { draw, cast: make(holes ? CAST_HOLES : FILL, true, { depthFunc: LessEqualDepth }) };
}

// The shadow map: what the key lamp sees, twice as many texels as the grid of the filter in surface.glsl.
export function shadowTarget(side) {
  const depthTexture = new DepthTexture(2 * side, 2 * side, UnsignedIntType);
  return new WebGLRenderTarget(2 * side, 2 * side, { depthTexture });
}
