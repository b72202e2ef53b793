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

// Return the textures of the pictures in a face's GLB. `relief`: whether to draw it.
export async function mapsOf(pictures, renderer, relief) {
  const load = (name, plain) => (pictures[name] ? textureOf(pictures[name]) : plain);
  const albedoMap = await load("albedo", one(255, 255, 255, 255));
  const surfaceMap = await load("surface", one(255, 255, 255, 255));
  if (!relief || !(pictures.normal || pictures.folds)) return { albedoMap, surfaceMap, slopeMap: one(LEVEL, LEVEL, LEVEL, LEVEL) };
  const level = one(LEVEL, LEVEL, 255, 255);
  const slopeMap = slopesOf(await load("normal", level), await load("folds", level), renderer);
  return { albedoMap, surfaceMap, slopeMap };
}

// Normal maps as slopes, whose means in coarser levels are right: of the relief, and of the folds.
function slopesOf(normal, folds, renderer) {
  const { width, height } = [normal, folds].map(({ image }) => image).find((image) => image.width > 1) ?? normal.image;
  const target = new WebGLRenderTarget(width, height, { ...filters, generateMipmaps: true, depthBuffer: false });
  const material = new RawShaderMaterial({
    glslVersion: GLSL3,
    depthTest: false,
    uniforms: { normal: { value: normal }, folds: { value: folds } },
    vertexShader: "in vec3 position; out vec2 uv; void main() { uv = position.xy + 0.5; gl_Position = vec4(2.0 * position.xy, 0.0, 1.0); }",
    fragmentShader: `precision highp float;
uniform sampler2D normal, folds;
in vec2 uv;
out vec4 slopes;
vec2 slopeOf(sampler2D map) {
  vec3 n = texture(map, uv).rgb * 2.0 - 1.0;
  return vec2(-n.x, n.y) / max(n.z, 0.1);
}
void main() { slopes = (vec4(slopeOf(normal), slopeOf(folds)) * 127.0 + 128.0) / 255.0; }`,
  });
  const scene = new Scene();
  scene.add(new Mesh(new PlaneGeometry(), material));
  renderer.setRenderTarget(target);
  renderer.render(scene, new OrthographicCamera());
  renderer.setRenderTarget(null);
  for (const used of [normal, folds, material]) used.dispose();
  return target.texture;
}

// The light of an environment, half floats of its levels: side x side texels of red, green, blue and 1.
export function mirrorOf(buffer, side) {
  const values = new Uint16Array(buffer);
  const texture = new DataArrayTexture(values, side, side, values.length / (4 * side * side));
  return Object.assign(texture, { type: HalfFloatType, minFilter: LinearFilter, magFilter: LinearFilter, needsUpdate: true });
}
