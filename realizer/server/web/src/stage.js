// The face in WebGL: rest mesh from the GLB, vertices from the stream, light of the rendered stills.
import { BufferAttribute, BufferGeometry, DoubleSide, Mesh, PerspectiveCamera, Scene, ShaderMaterial, Spherical, Vector3, WebGLRenderer } from "three";
import { readGlb } from "./glb.js";
import { Furrows, Glints } from "./figure.js";
import { ask } from "./service.js";
import { Subdivision } from "./subdivision.js";
import { backdrop, fragment, lightUniforms, MIDDLE, REACH, stops, vertex } from "./light.js";

const KEPT = 20; // s of frames, for looking back
// The width of the head over the height of the front camera's picture: narrower pictures step back.
const HEAD = 0.66;
const RANGE = { yaw: 1.6, pitch: 0.7 }; // rad
const STILL = 1e-4; // rad, or of the zoom: the camera does not move

export class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    // Without a GPU, smooth edges and four times as many triangles cost more than everything else.
    const software = drawnInSoftware();
    this.smooth = new URLSearchParams(location.search).get("smooth") ?? (software ? "no" : "yes");
    this.renderer = new WebGLRenderer({ canvas, antialias: !software, alpha: true });
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(12, 1, 0.1, 10);
    this.material = new ShaderMaterial({ vertexShader: vertex, fragmentShader: fragment, side: DoubleSide });
    this.frames = [];
    this.shownFrames = 0;
    this.stale = true; // whether the picture differs from the one on the canvas
    canvas.addEventListener("webglcontextrestored", () => (this.stale = true));
    this.light = null; // name of a preset; null: the service's default
    this.want = { yaw: 0, pitch: 0, zoom: 1 };
    this.view = { yaw: 0, pitch: 0, zoom: 1 };
    this.turn();
  }

  // Show a face by name; positions in the stream are int16 x scale + offset.
  async load(name, scale, offset) {
    const path = encodeURIComponent((this.awaited = name));
    const [look, glb] = await Promise.all([
      ask(`look.json?face=${path}&smooth=${this.smooth}`).then((answer) => checked(answer).json()),
      ask(`faces/${path}`).then((answer) => checked(answer).arrayBuffer()),
    ]);
    if (this.awaited !== name) return; // another face was requested in the meantime
    const { attributes, indices } = readGlb(glb);
    // The stream moves the vertices of the original mesh; what is drawn is a smooth subdivision of it.
    this.original = new BufferGeometry();
    this.original.setAttribute("position", new BufferAttribute(new Float32Array(attributes.POSITION.array), 3));
    this.original.setIndex(new BufferAttribute(indices, 1));
    this.subdivision = new Subdivision(indices, attributes.POSITION.array.length / 3, look.subdivided);
    const geometry = new BufferGeometry();
    const put = (as, { array, size, normalized }) =>
      geometry.setAttribute(as, new BufferAttribute(this.subdivision.mean(array, size, new array.constructor(size * this.subdivision.count)), size, normalized));
    put("albedo", attributes.COLOR_0);
    put("occlusion", attributes._OCCLUSION);
    put("gloss", attributes._GLOSS);
    for (const as of ["position", "normal"])
      geometry.setAttribute(as, new BufferAttribute(new Float32Array(3 * this.subdivision.count), 3));
    geometry.setIndex(new BufferAttribute(this.subdivision.triangles, 1));
    this.refine(geometry);
    Object.assign(this, { name, look, preset: look.camera, scale, offset });
    for (const part of [this.mesh, this.furrows?.mesh, this.glints?.mesh]) part?.geometry.dispose();
    this.scene.clear();
    this.mesh = new Mesh(geometry, this.material);
    this.mesh.frustumCulled = false;
    this.furrows = new Furrows(look.furrows, geometry, this.material);
    this.glints = new Glints(look.glints);
    this.scene.add(this.mesh, this.furrows.mesh, this.glints.mesh);
    this.shine(this.light);
  }

  // Light the face by a preset, and draw its backdrop.
  shine(name) {
    this.light = name;
    if (!this.look) return;
    this.lit = this.look.lights[name] ?? this.look.light;
    // In place: three.js keeps the objects of a program's first use.
    for (const [uniform, { value }] of Object.entries(lightUniforms(this.lit, this.look.furrows.shade))) {
      this.material.uniforms[uniform] ??= {};
      this.material.uniforms[uniform].value = value;
    }
    this.canvas.parentElement.style.background = this.look.background ?? backdrop(this.lit);
    this.stale = true;
  }

  // Draw the backdrop on another canvas, for a film.
  paintBackdrop(pen, width, height) {
    pen.fillStyle = this.look?.background ?? "#000";
    if (this.lit && !this.look.background) {
      const gradient = pen.createRadialGradient(0, 0, 0, 0, 0, 1);
      for (const [part, colour] of stops(this.lit)) gradient.addColorStop(part, colour);
      pen.setTransform(REACH[0] * width, 0, 0, REACH[1] * height, MIDDLE[0] * width, MIDDLE[1] * height);
      pen.fillStyle = gradient;
      pen.fillRect(-2, -2, 4, 4);
      pen.setTransform(1, 0, 0, 1, 0, 0);
    } else pen.fillRect(0, 0, width, height);
  }

  reset() {
    this.frames = [];
  }

  // Add vertices of the face of that name.
  add(time, values, face) {
    const late = this.frames.at(-1);
    if (late && time <= late.time) return;
    this.frames.push({ time, values, face });
    while (this.frames[0].time < time - KEPT) this.frames.shift();
  }

  // The session time of the oldest frame in memory.
  get oldest() {
    return this.frames[0]?.time ?? Infinity;
  }

  // Draw the face if something has changed, or `always`: the canvas keeps its picture on the page only.
  draw(playhead, always = false) {
    if (!this.mesh) return;
    this.fit();
    if (playhead !== null) this.pose(playhead);
    const ease = 0.18;
    for (const axis of ["yaw", "pitch", "zoom"]) {
      const away = this.want[axis] - this.view[axis];
      if (Math.abs(away) < STILL) continue;
      this.view[axis] += away * ease;
      this.stale = true;
    }
    if (!this.stale && !always) return;
    this.stale = false;
    this.aim();
    this.glints.pose(this.mesh.geometry, this.lit, this.camera);
    this.renderer.render(this.scene, this.camera);
  }

  // Vertices at `playhead`, interpolated between two frames.
  pose(playhead) {
    if (!this.frames.length) return;
    const first = Math.max(0, this.frames.findLastIndex(({ time }) => time <= playhead));
    const a = this.frames[first];
    const b = this.frames[first + 1] ?? a;
    const { position } = this.original.attributes;
    if (a.face !== this.name) return; // the face is still being loaded
    const t = b.time > a.time ? Math.min(1, Math.max(0, (playhead - a.time) / (b.time - a.time))) : 0;
    if (this.shown === a.values && this.shownAt === t) return;
    this.shown = a.values;
    this.shownAt = t;
    const out = position.array;
    const { scale, offset } = this;
    this.shownFrames += 1;
    let moved = false;
    for (let i = 0; i < out.length; i++) {
      const before = out[i];
      out[i] = (a.values[i] + (b.values[i] - a.values[i]) * t) * scale + offset[i % 3];
      moved ||= out[i] !== before;
    }
    if (!moved) return;
    this.stale = true;
    this.refine(this.mesh.geometry);
    this.furrows.pose(this.mesh.geometry);
  }

  // Move the drawn vertices and normals to the original mesh.
  refine(geometry) {
    this.original.computeVertexNormals();
    const { position, normal } = this.original.attributes;
    this.subdivision.places(position.array, geometry.attributes.position.array);
    this.subdivision.normals(normal.array, geometry.attributes.normal.array);
    for (const name of ["position", "normal"]) geometry.attributes[name].needsUpdate = true;
  }

  fit() {
    const width = this.canvas.clientWidth;
    const height = this.canvas.clientHeight;
    const ratio = Math.min(devicePixelRatio, 2);
    if (this.width === width && this.height === height && this.ratio === ratio) return;
    Object.assign(this, { width, height, ratio, stale: true });
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
  }

  aim() {
    const { preset, view, camera } = this;
    const target = new Vector3(...preset.target);
    const away = new Spherical().setFromVector3(new Vector3(...preset.position).sub(target));
    away.theta += view.yaw;
    away.phi = Math.min(2.8, Math.max(0.3, away.phi - view.pitch));
    camera.position.setFromSpherical(away).add(target);
    camera.aspect = this.width / Math.max(1, this.height);
    const half = (Math.tan((preset.fovy * Math.PI) / 360) * Math.max(1, HEAD / camera.aspect)) / view.zoom;
    camera.fov = (2 * Math.atan(half) * 180) / Math.PI;
    camera.near = preset.near;
    camera.far = preset.far;
    camera.lookAt(target);
    camera.updateMatrixWorld();
    camera.updateProjectionMatrix();
  }

  // Orbit by dragging, wheel and keys.
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

function drawnInSoftware() {
  const context = document.createElement("canvas").getContext("webgl2");
  const info = context?.getExtension("WEBGL_debug_renderer_info");
  const name = info ? context.getParameter(info.UNMASKED_RENDERER_WEBGL) : "";
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}

function checked(answer) {
  if (!answer.ok) throw new Error(`${answer.url}: ${answer.status}`);
  return answer;
}
