// A user's own avatar in three.js: a GLB with ARKit's shapes, or a VRM.
import { Box3, Quaternion, Vector3 } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
import { VRMLoaderPlugin, VRMUtils } from "@pixiv/three-vrm";

const BOTH = "browDown browOuterUp cheekSquint eyeBlink eyeLookDown eyeLookIn eyeLookOut eyeLookUp eyeSquint eyeWide mouthDimple mouthFrown mouthLowerDown mouthPress mouthSmile mouthStretch mouthUpperUp noseSneer";
const WHOLE = "browInnerUp cheekPuff jawForward jawLeft jawOpen jawRight mouthClose mouthFunnel mouthLeft mouthPucker mouthRight mouthRollLower mouthRollUpper mouthShrugLower mouthShrugUpper tongueOut";
// Spelling in small letters -> ARKit's name; names of whole shapes win.
const SPELLINGS = new Map([
  ...BOTH.split(" ").flatMap((stem) => ["Left", "Right"].flatMap((side) => [side, side[0]].flatMap((word) => [stem + word, word + stem].map((name) => [name.toLowerCase(), stem + side])))),
  ...WHOLE.split(" ").map((name) => [name.toLowerCase(), name]),
]);
// What VRM's expressions show of ARKit's shapes, for avatars that have no others.
const EXPRESSIONS = {
  aa: { jawOpen: 1.4, mouthFunnel: -0.7, mouthPucker: -0.7 },
  ih: { mouthStretchLeft: 0.5, mouthStretchRight: 0.5 },
  ou: { mouthPucker: 1 },
  oh: { mouthFunnel: 1 },
  blinkLeft: { eyeBlinkLeft: 1 },
  blinkRight: { eyeBlinkRight: 1 },
  happy: { mouthSmileLeft: 0.5, mouthSmileRight: 0.5 },
  angry: { browDownLeft: 0.5, browDownRight: 0.5 },
  sad: { mouthFrownLeft: 0.5, mouthFrownRight: 0.5 },
  surprised: { browOuterUpLeft: 0.5, browOuterUpRight: 0.5 },
};
const BONES = { head: "head", neck: "neck", lefteye: "leftEye", eyeleft: "leftEye", eyel: "leftEye", leye: "leftEye", righteye: "rightEye", eyeright: "rightEye", eyer: "rightEye", reye: "rightEye" };
const BALL = /eye(?!.*(lash|brow|lid|shadow|occlusion))/i;
const FAINT = 0.02; // alpha of hair that is not drawn
const MOVED = 1e-5; // in the unit of the mesh
const UP = new Vector3(0, 1, 0);
const SIDE = new Vector3(1, 0, 0);
const AHEAD = new Vector3(0, 0, 1);

/** Return ARKit's name of a morph target, also of `mouthSmile_L` and `Face.JawOpen`; undefined for another one. */
export function shapeOf(name) {
  const words = name.split(/[.:|/]+/).filter(Boolean);
  if (words.length > 1 && /^(l|r|left|right)$/i.test(words.at(-1))) words.push(words.splice(-2).join(""));
  const pieces = (words.at(-1) ?? "").split(/[_\s-]+/);
  return pieces.map((_, k) => SPELLINGS.get(pieces.slice(k).join("").toLowerCase())).find(Boolean);
}

/**
 * Load a GLB or a VRM.
 * @param {string|URL} url of the file
 * @returns {Promise<Avatar>} rejects with an Error whose message says what is wrong with the file
 */
export async function loadAvatar(url) {
  const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
  loader.register((parser) => new VRMLoaderPlugin(parser));
  let gltf;
  try {
    gltf = await loader.loadAsync(String(url));
  } catch (error) {
    throw new Error(`avatar: ${url}: wanted a .glb or .vrm file, got: ${error.message}`, { cause: error });
  }
  try {
    return new Avatar(gltf);
  } catch (error) {
    VRMUtils.deepDispose(gltf.scene);
    throw new Error(`avatar: ${url}: ${error.message}`, { cause: error });
  }
}

/** An avatar in a scene of three.js. */
export class Avatar {
  #vrm;
  #targets = new Map(); // ARKit's name -> [{ mesh, index }]
  #presets = []; // names of VRM's expressions that show the shapes
  #bones = new Map(); // bone -> { node, parent: rotation in the scene, own: rotation in the parent }
  #turn = new Quaternion();

  constructor({ scene, userData: { vrm } }) {
    /** The object to add to a scene; it looks along +z. */
    this.scene = scene;
    this.#vrm = vrm;
    const found = [];
    let ballsMove = false;
    scene.traverse((mesh) => {
      for (const [name, index] of Object.entries(mesh.morphTargetDictionary ?? {})) {
        found.push(name);
        const shape = shapeOf(name);
        if (!shape) continue;
        this.#targets.set(shape, [...(this.#targets.get(shape) ?? []), { mesh, index }]);
        ballsMove ||= shape.startsWith("eyeLook") && BALL.test(`${mesh.name} ${mesh.parent?.name}`) && greatest(distances(mesh, index)) >= MOVED;
      }
      mesh.frustumCulled = false; // bounds do not follow morph targets
      if (mesh.material?.isMeshStandardMaterial && mesh.material.alphaTest > 0) soften(mesh);
    });
    const expressions = vrm?.expressionManager?.expressions.map(({ expressionName }) => expressionName) ?? [];
    if (expressions.some(shapeOf)) this.#presets = expressions.filter(shapeOf);
    else if (!this.#targets.size) this.#presets = expressions.filter((name) => name in EXPRESSIONS);
    if (!this.#targets.size && !this.#presets.length) {
      const names = [...new Set(found)];
      throw new Error(`wanted morph targets with ARKit's names, such as jawOpen, or VRM's expressions, got ${names.slice(0, 8).join(", ") || "no morph targets"}${names.length > 8 ? ", ..." : ""}`);
    }
    if (vrm) VRMUtils.rotateVRM0(vrm);
    if (vrm?.lookAt) vrm.lookAt.autoUpdate = false; // the stream has the gaze
    scene.updateMatrixWorld(true);
    for (const [bone, node] of vrm ? humanBones(vrm) : namedBones(scene)) {
      if (ballsMove && bone.endsWith("Eye")) continue;
      this.#bones.set(bone, { node, parent: node.parent.getWorldQuaternion(new Quaternion()), own: node.quaternion.clone() });
    }
  }

  /** ARKit's names of the shapes that the avatar has. */
  get shapes() {
    return [...this.#targets.keys()];
  }

  /** The part of the scene to look at: what the shapes move, or the head of a VRM. */
  get bounds() {
    const box = new Box3();
    const at = new Vector3();
    const head = this.#vrm?.humanoid.getRawBoneNode("head");
    if (head) return box.setFromCenterAndSize(head.getWorldPosition(at).add(new Vector3(0, 0.07, 0.05)), new Vector3(0.14, 0.14, 0.14));
    for (const targets of this.#targets.values()) {
      const moved = targets.map(({ mesh, index }) => ({ mesh, far: distances(mesh, index) }));
      const least = Math.max(MOVED, greatest(moved.flatMap(({ far }) => far)) / 5); // the jaw hardly moves a collar
      for (const { mesh, far } of moved) {
        mesh.skeleton?.update();
        for (const k of far.keys()) if (far[k] >= least) box.expandByPoint(mesh.getVertexPosition(k, at).applyMatrix4(mesh.matrixWorld));
      }
    }
    return box.isEmpty() ? box.setFromObject(this.scene) : box;
  }

  /**
   * Show a frame of the stream arkit.
   * @param {string[]} names of the values, as in `subscribed`
   * @param {ArrayLike<number>} values
   * @param {number} [passed] seconds since the last frame, for hair and cloth of a VRM
   */
  show(names, values, passed = 0) {
    const value = Object.fromEntries(names.map((name, k) => [name, values[k]]));
    for (const name of this.#presets) {
      const shape = shapeOf(name);
      const weight = shape ? value[shape] : Object.entries(EXPRESSIONS[name]).reduce((sum, [part, share]) => sum + share * value[part], 0);
      this.#vrm.expressionManager.setValue(name, weight);
    }
    const halves = this.#bones.has("neck") && this.#bones.has("head") ? 0.5 : 1;
    const head = rotation(value.headYaw, value.headPitch, value.headRoll);
    if (halves < 1) head.slerp(new Quaternion(), 0.5);
    this.#rotate("neck", halves < 1 ? head : new Quaternion());
    this.#rotate("head", head);
    for (const eye of ["leftEye", "rightEye"]) this.#rotate(eye, rotation(value[`${eye}Yaw`], value[`${eye}Pitch`], 0));
    this.#vrm?.update(passed);
    // Last: a VRM sets the morph targets of its expressions to zero first.
    if (!this.#presets.length) {
      for (const [shape, targets] of this.#targets) for (const { mesh, index } of targets) mesh.morphTargetInfluences[index] = value[shape];
    }
  }

  /** Free what the graphics card holds of the avatar. */
  dispose() {
    this.scene.removeFromParent();
    VRMUtils.deepDispose(this.scene);
  }

  #rotate(bone, turn) {
    const found = this.#bones.get(bone);
    if (!found) return;
    this.#turn.copy(found.parent).invert().multiply(turn).multiply(found.parent).multiply(found.own);
    found.node.quaternion.copy(this.#turn);
  }
}

/** Draw a mesh a second time, blended, since the edges of hair that its map cuts out are speckled. */
function soften(mesh) {
  const edges = Object.assign(mesh.material.clone(), { transparent: true, depthWrite: false, alphaTest: FAINT, forceSinglePass: true });
  mesh.material = [mesh.material, edges];
  mesh.geometry.clearGroups();
  for (const k of mesh.material.keys()) mesh.geometry.addGroup(0, Infinity, k);
}

/** Return how far a morph target moves each vertex. */
function distances({ geometry }, index) {
  const target = geometry.morphAttributes.position?.[index];
  return Array.from({ length: target?.count ?? 0 }, (_, k) => Math.hypot(target.getX(k), target.getY(k), target.getZ(k)));
}

const greatest = (values) => values.reduce((a, b) => Math.max(a, b), 0);

/** Return a rotation: roll first, yaw last. */
function rotation(yaw = 0, pitch = 0, roll = 0) {
  const turn = new Quaternion().setFromAxisAngle(UP, yaw);
  turn.multiply(new Quaternion().setFromAxisAngle(SIDE, pitch));
  return turn.multiply(new Quaternion().setFromAxisAngle(AHEAD, roll));
}

function humanBones(vrm) {
  const bones = ["neck", "head", "leftEye", "rightEye"].map((bone) => [bone, vrm.humanoid.getNormalizedBoneNode(bone)]);
  return bones.filter(([, node]) => node);
}

/** Return bones by their names; joints of skins win, and meshes that would leave the rest of a head are none. */
function namedBones(scene) {
  const joints = new Set();
  const found = new Map();
  scene.traverse((node) => node.skeleton?.bones.forEach((bone) => joints.add(bone)));
  scene.traverse((node) => {
    // GLTFLoader removes the characters : and . of names.
    const bone = BONES[node.name.replace(/^mixamorig/i, "").toLowerCase().replace(/[^a-z]/g, "")];
    const holds = joints.has(node) || (!node.isMesh && node.children.length > 0) || (node.isMesh && bone?.endsWith("Eye"));
    const stands = bone !== "neck" || (node.parent && node.parent !== scene);
    if (bone && holds && stands && !node.isSkinnedMesh && (joints.has(node) || !joints.has(found.get(bone)))) found.set(bone, node);
  });
  return found;
}
