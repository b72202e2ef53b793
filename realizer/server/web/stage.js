// The face in WebGL: rest mesh from the GLB, vertices from the stream, the light of the stills.
import { BufferAttribute, DoubleSide, PerspectiveCamera, Scene, ShaderMaterial, Vector3, WebGLRenderer } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { fragment, lightUniforms, vertex } from "./light.js";

const KEPT = 60; // frames
const EYES = 0.0625; // m; the distance of the eyes that the framing below was made for
const VIEW = { distance: 1.8, middle: -0.03, height: 0.37, width: 0.25 }; // m
const RANGE = { yaw: 1.6, pitch: 0.7 }; // rad

export class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(12, 1, 0.1, 10);
    this.material = new ShaderMaterial({ vertexShader: vertex, fragmentShader: fragment, uniforms: lightUniforms(), side: DoubleSide });
    this.frames = [];
    this.scaleOfFace = 1;
    this.want = { yaw: 0, pitch: 0, zoom: 1 };
    this.view = { yaw: 0, pitch: 0, zoom: 1 };
    this.turn();
  }

  light(look) {
    this.material.uniforms = lightUniforms(look);
    this.material.needsUpdate = true;
  }

  // Show the face behind `url`; stream positions are int16 x scale + offset.
  async load(url, scale, offset) {
    const { scene } = await new GLTFLoader().loadAsync(url);
    let mesh = null;
    scene.traverse((node) => (mesh ??= node.isMesh ? node : null));
    if (!mesh) throw new Error("the file holds no mesh");
    mesh.material = this.material;
    mesh.frustumCulled = false;
    const { geometry } = mesh;
    const count = geometry.attributes.position.count;
    for (const [name, value] of [["_occlusion", 1], ["_gloss", 0]]) {
      if (!geometry.attributes[name]) geometry.setAttribute(name, new BufferAttribute(new Float32Array(count).fill(value), 1));
    }
    this.scaleOfFace = (mesh.userData.fapu?.es0 ?? EYES) / EYES;
    this.scale = scale;
    this.offset = offset;
    if (this.mesh) this.scene.remove(this.mesh);
    this.mesh = mesh;
    this.scene.add(mesh);
  }

  reset() {
    this.frames = [];
  }

  add(time, values) {
    const late = this.frames.at(-1);
    if (late && time <= late.time) return;
    this.frames.push({ time, values });
    if (this.frames.length > KEPT) this.frames.shift();
  }

  draw(playhead) {
    this.fit();
    if (this.mesh && playhead !== null) this.pose(playhead);
    const ease = 0.18;
    for (const axis of ["yaw", "pitch", "zoom"]) this.view[axis] += (this.want[axis] - this.view[axis]) * ease;
    this.aim();
    this.renderer.render(this.scene, this.camera);
  }

  // Vertices at `playhead`, between the two frames around it.
  pose(playhead) {
    while (this.frames.length > 2 && this.frames[1].time <= playhead) this.frames.shift();
    if (!this.frames.length) return;
    const [a, b = a] = this.frames;
    const position = this.mesh.geometry.attributes.position;
    if (a.values.length !== position.array.length) return;
    const t = b.time > a.time ? Math.min(1, Math.max(0, (playhead - a.time) / (b.time - a.time))) : 0;
    if (this.shown === a.values && this.shownAt === t) return;
    this.shown = a.values;
    this.shownAt = t;
    const out = position.array;
    const { scale, offset } = this;
    for (let i = 0; i < out.length; i++) out[i] = (a.values[i] + (b.values[i] - a.values[i]) * t) * scale + offset[i % 3];
    position.needsUpdate = true;
    this.mesh.geometry.computeVertexNormals();
  }

  fit() {
    const width = this.canvas.clientWidth;
    const height = this.canvas.clientHeight;
    const ratio = Math.min(devicePixelRatio, 2);
    if (this.width === width && this.height === height && this.ratio === ratio) return;
    Object.assign(this, { width, height, ratio });
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
  }

  aim() {
    const size = this.scaleOfFace;
    const aspect = this.width / Math.max(1, this.height);
    const tall = Math.max(VIEW.height, VIEW.width / aspect) * size / this.view.zoom;
    const distance = VIEW.distance * size;
    const { yaw, pitch } = this.view;
    const middle = new Vector3(0, VIEW.middle * size, -0.06 * size * Math.min(1, Math.abs(yaw)));
    this.camera.position.set(Math.sin(yaw) * Math.cos(pitch), Math.sin(pitch), Math.cos(yaw) * Math.cos(pitch)).multiplyScalar(distance).add(middle);
    this.camera.lookAt(middle);
    this.camera.aspect = aspect;
    this.camera.fov = (2 * Math.atan(tall / 2 / distance) * 180) / Math.PI;
    this.camera.updateProjectionMatrix();
  }

  // Orbit by drag, wheel and keys.
  turn() {
    const { canvas, want } = this;
    const limit = () => {
      want.yaw = Math.max(-RANGE.yaw, Math.min(RANGE.yaw, want.yaw));
      want.pitch = Math.max(-RANGE.pitch, Math.min(RANGE.pitch, want.pitch));
      want.zoom = Math.max(0.6, Math.min(3, want.zoom));
    };
    const straight = () => Object.assign(want, { yaw: 0, pitch: 0, zoom: 1 });
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      if (!event.buttons) return;
      want.yaw -= event.movementX / 160;
      want.pitch += event.movementY / 220;
      limit();
    });
    canvas.addEventListener("dblclick", straight);
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      want.zoom *= Math.exp(-event.deltaY / 600);
      limit();
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: ["yaw", -0.2], ArrowRight: ["yaw", 0.2], ArrowUp: ["pitch", 0.15], ArrowDown: ["pitch", -0.15], "+": ["zoom", 0.15], "-": ["zoom", -0.15] }[event.key];
      if (step) want[step[0]] += step[1];
      else if (event.key === "Home") straight();
      else return;
      event.preventDefault();
      limit();
    });
  }
}
