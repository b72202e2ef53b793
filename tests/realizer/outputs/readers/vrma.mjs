// A VRM animation in, what Khronos' validator and three-vrm make of it out, as JSON.

import { readFileSync } from "node:fs";
import { VRMAnimationLoaderPlugin } from "@pixiv/three-vrm-animation";
import validator from "gltf-validator";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const bytes = new Uint8Array(readFileSync(process.argv[2]));
const { issues } = await validator.validateBytes(bytes);
const warnings = [];
console.warn = (...words) => warnings.push(words.join(" "));
const loader = new GLTFLoader().register((parser) => new VRMAnimationLoaderPlugin(parser));
const { userData } = await loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), "");
const [animation] = userData.vrmAnimations;
const told = (tracks) =>
  Object.fromEntries([...tracks].map(([name, { times, values }]) => [name, { times: [...times], values: [...values] }]));
console.log(
  JSON.stringify({
    issues,
    warnings,
    duration: animation.duration,
    hips: animation.restHipsPosition.toArray(),
    turns: told(animation.humanoidTracks.rotation),
    preset: told(animation.expressionTracks.preset),
    custom: told(animation.expressionTracks.custom),
    look: [...animation.lookAtTrack.values],
  }),
);
