// How a face is drawn: the formula of the rendered stills, realizer/render/surface.glsl, in three.js.
import {
  BackSide, CustomBlending, DepthTexture, DoubleSide, EqualDepth, FrontSide, GLSL3, OneFactor, RawShaderMaterial,
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

const PRECISION = ["float", "int", "sampler2D", "sampler2DArray"].map((type) => `precision highp ${type};`).join("\n");
const head = `${PRECISION}
${surface}
uniform vec3 cameraPosition;
uniform int kind;
in vec3 at, up, hair, tint; in vec2 map, hidden; in float folded;
out vec4 pixel;
`;
const COLOUR = "surfaceColour(kind, at, up, hair, map, tint, hidden, folded, gl_FrontFacing, cameraPosition)";
// Hair hides as many samples of a pixel as its alpha says. Layers of it hide the same samples here, others in stills: so
// each hides more.
const DRAW = `${head} void main() { pixel = vec4(${COLOUR}, 1.0); }`;
const DRAW_HOLES = `${head} void main() { pixel = vec4(${COLOUR}, 1.0 - pow(1.0 - coverOf(map, 0.0), 2.0)); }`;
const FILL = `${head} void main() { pixel = vec4(1.0); }`;
// Neighbouring texels of the shadow map are hidden from different alphas on, as samples of a pixel are.
const CAST_HOLES = `${head}
void main() {
  ivec2 p = ivec2(gl_FragCoord.xy) & 1;
  if (coverOf(map, 1.0) * 255.0 <= float(((p.x + 2 * p.y) << 6) + 31)) discard;
  pixel = vec4(1.0);
}`;

// Without a GPU: light at vertices, without relief and shadows; of an albedo of a half, and what does not depend on it.
const plainVertexShader = `
#define dFdx(x) (x)
#define dFdy(x) (x)
${PRECISION}
${surface}
uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec3 cameraPosition;
uniform int kind;
uniform bool sheet;
in vec3 position, normal, strand; in vec2 uv; in vec4 colour; in vec2 occlusionRough;
out vec3 scattered, mirrored, tint; out vec2 map;
void main() {
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  tint = colour.rgb; map = uv;
  vec3 view = unitOf(cameraPosition - position), n = unitOf(normal);
  if (sheet && dot(n, view) < 0.0) n = -n;
  vec2 values = textureLod(surfaceMap, uv, 3.0).rg * occlusionRough;
  vec4 rest = vec4(values.x, max(values.y, 0.06), 1.0, 1.0);
  mirrored = reflectedBy(kind, vec3(0.0), n, n, unitOf(strand), rest, view);
  scattered = 2.0 * (reflectedBy(kind, vec3(0.5), n, n, unitOf(strand), rest, view) - mirrored);
}`;
const PLAIN = `${PRECISION}
${surface}
uniform bool holes;
in vec3 scattered, mirrored, tint; in vec2 map;
out vec4 pixel;
void main() {
  vec4 albedo = texture(albedoMap, map);
  if (holes && albedo.a < 0.35) discard;
  pixel = vec4(pictureOf(linearOf(albedo.rgb) * tint * scattered + mirrored), 1.0);
}`;

// Blending that writes colours only, or alpha only.
const WRITES = { blending: CustomBlending, blendSrc: OneFactor, blendDst: ZeroFactor, blendSrcAlpha: ZeroFactor, blendDstAlpha: OneFactor };
const ALPHA = { ...WRITES, blendSrc: ZeroFactor, blendDst: OneFactor, blendSrcAlpha: OneFactor, blendDstAlpha: ZeroFactor };

// Return the materials that draw a group of triangles, one after the other, and the one that casts its shadow.
export function materialsOf({ kind, holes, doubleSided }, uniforms, full) {
  const make = (fragmentShader, toLamp, more) =>
    new RawShaderMaterial({
      glslVersion: GLSL3,
      uniforms: { ...uniforms, kind: { value: kind }, toLamp: { value: toLamp }, holes: { value: holes }, sheet: { value: doubleSided && !holes } },
      vertexShader,
      fragmentShader,
      side: doubleSided ? DoubleSide : toLamp ? BackSide : FrontSide, // the lamp's picture is upside down
      ...more,
    });
  if (!full) return { draw: [make(PLAIN, false, { vertexShader: plainVertexShader })] };
  const cast = make(holes ? CAST_HOLES : FILL, true, {});
  if (!holes) return { draw: [make(DRAW, false, {})], cast };
  // Alpha says which samples are covered; then these are made opaque.
  const fill = make(FILL, false, { depthFunc: EqualDepth, depthWrite: false, ...ALPHA });
  return { draw: [make(DRAW_HOLES, false, { alphaToCoverage: true, ...WRITES }), fill], cast };
}

// The shadow map: what the key lamp sees, twice as many texels as the grid of the filter in surface.glsl.
export function shadowTarget(side) {
  const depthTexture = new DepthTexture(2 * side, 2 * side, UnsignedIntType);
  return new WebGLRenderTarget(2 * side, 2 * side, { depthTexture });
}
