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
  if (!relief) return { albedoMap, surfaceMap, slopeMap: level, foldMap: one(0, 0, 0, 0) };
  const even = one(LEVEL, LEVEL, 255, 255);
  const heights = { relief: await load("relief", level), folds: await load("folds", level), normal: pictures.relief ? even : await load("normal", even) };
  const steep = [extras.relief?.slope ?? 0, extras.folds?.slope ?? 0];
  const slopeMap = drawn({ ...heights, steep, fromNormal: !steep[0] }, SLOPES, renderer);
  const foldMap = drawn({ folds: heights.folds }, DEPTHS, renderer);
  for (const used of Object.values(heights)) used.dispose();
  return { albedoMap, surfaceMap, slopeMap, foldMap };
}

// The slopes of the relief and of the folds, and the depth of the folds: their means in coarser levels are right.
const SLOPES = `uniform sampler2D relief, folds, normal;
uniform vec2 steep;
uniform bool fromNormal;
vec2 slopeOf(sampler2D map, float steep) {
  vec2 size = vec2(textureSize(map, 0)), x = vec2(1.0 / size.x, 0.0), y = vec2(0.0, 1.0 / size.y);
  vec2 rise = vec2(textureLod(map, uv + x, 0.0).r - textureLod(map, uv - x, 0.0).r, textureLod(map, uv + y, 0.0).r - textureLod(map, uv - y, 0.0).r);
  return rise * 0.5 * steep * size;
}
void main() {
  vec3 n = textureLod(normal, uv, 0.0).rgb * 2.0 - 1.0;
  vec2 own = fromNormal ? vec2(-n.x, n.y) / max(n.z, 0.1) : slopeOf(relief, steep.x);
  texel = (vec4(own, slopeOf(folds, steep.y)) * 127.0 + 128.0) / 255.0;
}`;
const DEPTHS = "uniform sampler2D folds; void main() { texel = vec4(max(1.0 - textureLod(folds, uv, 0.0).r * 255.0 / 128.0, 0.0)); }";

// Return a texture that a fragment shader draws, of the size of the largest texture among its uniforms.
function drawn(values, fragment, renderer) {
  const side = Math.max(...Object.values(values).map(({ image }) => Math.max(image?.width ?? 0, image?.height ?? 0)));
  const target = new WebGLRenderTarget(side, side, { ...filters, generateMipmaps: true, depthBuffer: false });
  const material = new RawShaderMaterial({
    glslVersion: GLSL3,
    depthTest: false,
    uniforms: Object.fromEntries(Object.entries(values).map(([name, value]) => [name, { value }])),
    vertexShader: "in vec3 position; out vec2 uv; void main() { uv = position.xy + 0.5; gl_Position = vec4(2.0 * position.xy, 0.0, 1.0); }",
    fragmentShader: `precision highp float; in vec2 uv; out vec4 texel;\n${fragment}`,
  });
  const scene = new Scene();
  scene.add(new Mesh(new PlaneGeometry(), material));
  renderer.setRenderTarget(target);
  renderer.render(scene, new OrthographicCamera());
  renderer.setRenderTarget(null);
  material.dispose();
  return target.texture;
}

// The light of an environment, half floats of its levels: side x side texels of red, green, blue and 1.
export function mirrorOf(buffer, side) {
  const values = new Uint16Array(buffer);
  const texture = new DataArrayTexture(values, side, side, values.length / (4 * side * side));
  return Object.assign(texture, { type: HalfFloatType, minFilter: LinearFilter, magFilter: LinearFilter, needsUpdate: true });
}
