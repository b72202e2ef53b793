// The maps of a face as textures of surface.glsl, and the light of an environment.
import {
  ClampToEdgeWrapping, DataArrayTexture, DataTexture, GLSL3, HalfFloatType, LinearFilter, LinearMipmapLinearFilter, Mesh,
  OrthographicCamera, PlaneGeometry, RawShaderMaterial, Scene, Texture, WebGLRenderTarget,
} from "three";

const filters = { minFilter: LinearMipmapLinearFilter, magFilter: LinearFilter, wrapS: ClampToEdgeWrapping, wrapT: ClampToEdgeWrapping };
const LEVEL = 128; // of a slope

const one = (...bytes) => Object.assign(new DataTexture(new Uint8Array(bytes), 1, 1), { needsUpdate: true });

async function textureOf(picture) {
  const bitmap = await createImageBitmap(picture, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
  return Object.assign(new Texture(bitmap), filters, { generateMipmaps: true, flipY: false, needsUpdate: true });
}

// Return the textures of a face's GLB. `relief`: whether to draw it.
export async function mapsOf({ pictures, extras }, renderer, relief) {
  const load = (name, plain) => (pictures[name] ? textureOf(pictures[name]) : plain);
  const albedoMap = await load("albedo", one(255, 255, 255, 255));
  const surfaceMap = await load("surface", one(255, 255, 255, 255));
  const level = one(LEVEL, LEVEL, LEVEL, LEVEL);
  if (!relief) return { albedoMap, surfaceMap, slopeMap: level };
  const even = one(LEVEL, LEVEL, 255, 255);
  const heights = { relief: await load("relief", level), folds: await load("folds", level), normal: pictures.relief ? even : await load("normal", even) };
  return { albedoMap, surfaceMap, slopeMap: slopesOf(heights, [extras.relief?.slope ?? 0, extras.folds?.slope ?? 0], renderer) };
}

// The slopes of the relief and of the folds, whose means in coarser levels are right.
function slopesOf(heights, steep, renderer) {
  const sides = Object.values(heights).map(({ image }) => Math.max(image.width, image.height));
  const side = Math.max(...sides);
  const target = new WebGLRenderTarget(side, side, { ...filters, generateMipmaps: true, depthBuffer: false });
  const values = { ...heights, steep, fromNormal: !steep[0] };
  const material = new RawShaderMaterial({
    glslVersion: GLSL3,
    depthTest: false,
    uniforms: Object.fromEntries(Object.entries(values).map(([name, value]) => [name, { value }])),
    vertexShader: "in vec3 position; out vec2 uv; void main() { uv = position.xy + 0.5; gl_Position = vec4(2.0 * position.xy, 0.0, 1.0); }",
    fragmentShader: `precision highp float;
uniform sampler2D relief, folds, normal;
uniform vec2 steep;
uniform bool fromNormal;
in vec2 uv;
out vec4 slopes;
vec2 slopeOf(sampler2D map, float steep) {
  vec2 size = vec2(textureSize(map, 0)), x = vec2(1.0 / size.x, 0.0), y = vec2(0.0, 1.0 / size.y);
  vec2 rise = vec2(textureLod(map, uv + x, 0.0).r - textureLod(map, uv - x, 0.0).r, textureLod(map, uv + y, 0.0).r - textureLod(map, uv - y, 0.0).r);
  return rise * 0.5 * steep * size;
}
void main() {
  vec3 n = textureLod(normal, uv, 0.0).rgb * 2.0 - 1.0;
  vec2 own = fromNormal ? vec2(-n.x, n.y) / max(n.z, 0.1) : slopeOf(relief, steep.x);
  slopes = (vec4(own, slopeOf(folds, steep.y)) * 127.0 + 128.0) / 255.0;
}`,
  });
  const scene = new Scene();
  scene.add(new Mesh(new PlaneGeometry(), material));
  renderer.setRenderTarget(target);
  renderer.render(scene, new OrthographicCamera());
  renderer.setRenderTarget(null);
  for (const used of [...Object.values(heights), material]) used.dispose();
  return target.texture;
}

// The light of an environment, half floats of its levels: side x side texels of red, green, blue and 1.
export function mirrorOf(buffer, side) {
  const values = new Uint16Array(buffer);
  const texture = new DataArrayTexture(values, side, side, values.length / (4 * side * side));
  return Object.assign(texture, { type: HalfFloatType, minFilter: LinearFilter, magFilter: LinearFilter, needsUpdate: true });
}
