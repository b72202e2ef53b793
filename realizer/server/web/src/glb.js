// The rest mesh of a face from its GLB: one mesh with one primitive, whose vertices the mesh stream moves.

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
  const mesh = json.meshes[0];
  const primitive = mesh.primitives[0];
  const attributes = Object.fromEntries(
    Object.entries(primitive.attributes).map(([name, index]) => [name, read(index)]),
  );
  return { attributes, indices: read(primitive.indices).array, extras: mesh.extras ?? {} };
}
