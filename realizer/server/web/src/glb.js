// What is drawn of a face, from its GLB: one mesh, with a primitive for each kind of surface.

const TYPES = { 5121: Uint8Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array };
const SIZES = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };

export function readGlb(buffer) {
  const view = new DataView(buffer);
  if (view.getUint32(0, true) !== 0x46546c67) throw new Error("the face is not a GLB file");
  const length = view.getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 20, length)));
  const start = 20 + length + 8;
  const read = (index) => {
    const accessor = json.accessors[index];
    const bytes = json.bufferViews[accessor.bufferView];
    const offset = start + (bytes.byteOffset ?? 0) + (accessor.byteOffset ?? 0);
    const array = new TYPES[accessor.componentType](buffer, offset, accessor.count * SIZES[accessor.type]);
    return { array, size: SIZES[accessor.type], normalized: accessor.normalized === true };
  };
  const picture = (texture) => {
    const { bufferView, mimeType } = json.images[json.textures[texture].extensions.EXT_texture_webp.source];
    const { byteOffset, byteLength } = json.bufferViews[bufferView];
    return new Blob([new Uint8Array(buffer, start + byteOffset, byteLength)], { type: mimeType });
  };
  const { primitives, extras } = json.meshes[0];
  const attributes = Object.fromEntries(
    Object.entries(primitives[0].attributes).map(([name, index]) => [name, read(index)]),
  );
  const groups = primitives.map(({ indices, material }) => {
    const { extras, alphaMode, doubleSided = false } = json.materials[material];
    return { triangles: read(indices).array, kind: extras.kind, holes: alphaMode === "MASK", doubleSided };
  });
  const { pbrMetallicRoughness: look, normalTexture } = json.materials[0];
  const textures = { albedo: look.baseColorTexture?.index, surface: look.metallicRoughnessTexture?.index, normal: normalTexture?.index, relief: extras.relief?.texture, folds: extras.folds?.texture };
  const pictures = Object.fromEntries(
    Object.entries(textures).filter(([, index]) => index !== undefined).map(([name, index]) => [name, picture(index)]),
  );
  return { attributes, groups, extras, pictures, read: (index) => read(index).array };
}
