// A GLB file and instants in, what Khronos' validator and three.js make of it out, as JSON.

import { readFileSync } from "node:fs";
import { AnimationMixer, LoopOnce, Texture, Vector3 } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import validator from "gltf-validator";

const [path, ...instants] = process.argv.slice(2);
const bytes = new Uint8Array(readFileSync(path));
const { issues, info } = await validator.validateBytes(bytes);
// Node decodes no pictures.
const loader = new GLTFLoader().register((parser) => {
  parser.loadTextureImage = async () => new Texture();
  return { name: "pictures" };
});
const head = await loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), "");
const [clip] = head.animations;
const mixer = new AnimationMixer(head.scene);
const action = clip && mixer.clipAction(clip).setLoop(LoopOnce);
if (action) action.clampWhenFinished = true;

function seen() {
  head.scene.updateMatrixWorld(true);
  const meshes = {};
  head.scene.traverse((node) => {
    if (!node.isMesh) return;
    node.skeleton?.update();
    const at = new Vector3();
    meshes[node.name] = Array.from({ length: node.geometry.attributes.position.count }, (_, k) =>
      node.getVertexPosition(k, at).applyMatrix4(node.matrixWorld).toArray(),
    );
  });
  return meshes;
}

const frames = instants.map((instant) => {
  action?.reset().play();
  mixer.setTime(Number(instant));
  return seen();
});
const face = head.scene.getObjectByProperty("isMesh", true);
console.log(
  JSON.stringify({
    issues,
    info,
    duration: clip?.duration ?? 0,
    targets: Object.keys(face.morphTargetDictionary ?? {}),
    frames,
  }),
);
