// The face in WebGL: what is drawn from the GLB, vertices from the stream, light of the rendered stills.
import { Mesh, PerspectiveCamera, Scene, Spherical, Vector3, WebGLRenderer } from "three";
import { backdrop, MIDDLE, REACH, stops } from "./backdrop.js";
import { readGlb } from "./glb.js";
import { Head } from "./head.js";
import { mapsOf, mirrorOf } from "./maps.js";
import { ask } from "./service.js";
import { materialsOf, shadowTarget } from "./surface.js";

const KEPT = 20; // s of frames, for looking back
// The width of the head over the height of the front camera's picture: narrower pictures step back.
const HEAD = 0.66;
const RANGE = { yaw: 1.6, pitch: 0.7 }; // rad
const STILL = 1e-4; // rad, or of the zoom: the camera does not move
// Without a GPU: ms between pictures on average from which on fewer pixels are drawn, and how few of a side at least.
const SLOW = 50;
const FEWEST = 0.5;

export class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    // Without a GPU, detail costs more than everything else.
    const software = drawnInSoftware();
    this.full = (new URLSearchParams(location.search).get("detail") ?? (software ? "plain" : "full")) === "full";
    this.renderer = new WebGLRenderer({ canvas, antialias: this.full, alpha: true });
    this.scene = new Scene();
    this.lampScene = new Scene();
    this.camera = new PerspectiveCamera(12, 1, 0.1, 10);
    this.uniforms = {};
    this.mirrors = {}; // textures of environments, by light
    this.frames = [];
    this.shownFrames = 0;
    this.drawn = 0; // ms; when the last picture was drawn, if there was one at the last call
    this.taken = 0; // ms between pictures, on average
    this.part = 1; // of the pixels of a side
    this.stale = true; // whether the picture differs from the one on the canvas
    canvas.addEventListener("webglcontextrestored", () => this.name && this.load(this.name, this.scale, this.offset));
    this.light = null; // name of a preset; null: the service's default
    this.want = { yaw: 0, pitch: 0, zoom: 1 };
    this.view = { yaw: 0, pitch: 0, zoom: 1 };
    this.turn();
  }

  // Show a face by name; positions in the stream are int16 x scale + offset.
  async load(name, scale, offset) {
    const path = encodeURIComponent((this.awaited = name));
    const [look, glb] = await Promise.all([
      ask(`look.json?face=${path}`).then((answer) => checked(answer).json()),
      ask(`faces/${path}`).then((answer) => checked(answer).arrayBuffer()).then(readGlb),
    ]);
    if (look.background === "/background") await this.fetchPicture();
    const maps = await mapsOf(glb, this.renderer, this.full);
    if (this.awaited !== name) return; // another face was requested in the meantime
    Object.assign(this, { look, preset: look.camera });
    await this.shine(this.light);
    if (this.awaited !== name) return;
    this.clear();
    this.shadows ??= shadowTarget(this.uniforms.shadowSide.value);
    this.set({ ...maps, shadowMap: this.shadows.depthTexture });
    Object.assign(this, { name, scale, offset, head: new Head(glb, this.full) });
    for (const group of this.head.groups) {
      const geometry = this.head.geometry(group);
      const { draw, cast } = materialsOf(group, this.uniforms, this.full);
      if (cast) this.lampScene.add(still(new Mesh(geometry, cast)));
      draw.forEach((material, k) => this.scene.add(Object.assign(still(new Mesh(geometry, material)), { renderOrder: group.holes + k })));
    }
    this.head.pose();
  }

  clear() {
    for (const map of ["albedoMap", "slopeMap", "surfaceMap", "foldMap"]) this.uniforms[map]?.value.dispose();
    for (const { geometry, material } of [...this.scene.children, ...this.lampScene.children]) {
      geometry.dispose();
      material.dispose();
    }
    this.scene.clear();
    this.lampScene.clear();
  }

  // Change uniforms in place: materials share them.
  set(values) {
    for (const [name, value] of Object.entries(values)) {
      this.uniforms[name] ??= {};
      this.uniforms[name].value = value;
    }
    this.stale = true;
  }

  // Fetch the picture behind the face, once.
  async fetchPicture() {
    if (this.picture) return;
    const blob = await ask("background").then((answer) => checked(answer).blob());
    Object.assign(this, { picture: await createImageBitmap(blob), cover: `url(${URL.createObjectURL(blob)}) center / cover` });
  }

  // Light the face by a preset, and draw its backdrop.
  async shine(name) {
    this.light = name;
    if (!this.look) return;
    const lit = name ?? this.look.light;
    this.mirrors[lit] ??= ask(`mirror?light=${lit}`).then((answer) => checked(answer).arrayBuffer()).then((levels) => mirrorOf(levels, this.look.mirror));
    const mirrorMap = await this.mirrors[lit];
    if (this.light !== name) return;
    this.lit = this.look.lights[lit];
    this.set({ ...this.lit.uniforms, mirrorMap });
    const behind = this.picture ? `${this.cover}, ${backdrop(this.lit)}` : this.look.background;
    this.canvas.parentElement.style.background = behind ?? backdrop(this.lit);
  }

  // Draw the backdrop on another canvas, for a film.
  paintBackdrop(pen, width, height) {
    const colour = this.picture ? null : this.look?.background;
    pen.fillStyle = colour ?? "#000";
    if (this.lit && !colour) {
      const gradient = pen.createRadialGradient(0, 0, 0, 0, 0, 1);
      for (const [part, colour] of stops(this.lit)) gradient.addColorStop(part, colour);
      pen.setTransform(REACH[0] * width, 0, 0, REACH[1] * height, MIDDLE[0] * width, MIDDLE[1] * height);
      pen.fillStyle = gradient;
      pen.fillRect(-2, -2, 4, 4);
      pen.setTransform(1, 0, 0, 1, 0, 0);
    } else pen.fillRect(0, 0, width, height);
    if (!this.picture) return;
    const scale = Math.max(width / this.picture.width, height / this.picture.height);
    const [w, h] = [this.picture.width * scale, this.picture.height * scale];
    pen.drawImage(this.picture, (width - w) / 2, (height - h) / 2, w, h);
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
  // `frames` are those among which `playhead` is, if not those of the stream.
  draw(playhead, always = false, frames = this.frames) {
    if (!this.head) return;
    this.fit();
    if (playhead !== null) this.pose(playhead, frames);
    const ease = 0.18;
    for (const axis of ["yaw", "pitch", "zoom"]) {
      const away = this.want[axis] - this.view[axis];
      if (Math.abs(away) < STILL) continue;
      this.view[axis] += away * ease;
      this.stale = true;
    }
    if (!this.stale && !always) {
      this.drawn = 0;
      return;
    }
    this.stale = false;
    if (!this.full) this.pace(performance.now());
    this.aim();
    if (this.full) {
      this.renderer.setRenderTarget(this.shadows);
      this.renderer.render(this.lampScene, this.camera);
      this.renderer.setRenderTarget(null);
    }
    this.renderer.render(this.scene, this.camera);
  }

  // Draw fewer pixels if pictures that follow each other take too long.
  pace(now) {
    if (this.drawn) this.taken += 0.1 * (Math.min(now - this.drawn, 4 * SLOW) - this.taken);
    this.drawn = now;
    if (this.taken < SLOW || this.part === FEWEST) return;
    this.part = Math.max(FEWEST, 0.8 * this.part);
    this.taken = 0;
  }

  // Vertices at `playhead`, interpolated between two frames.
  pose(playhead, frames) {
    if (!frames.length) return;
    const first = Math.max(0, frames.findLastIndex(({ time }) => time <= playhead));
    const a = frames[first];
    const b = frames[first + 1] ?? a;
    if (a.face !== this.name) return; // the face is still being loaded
    const t = b.time > a.time ? Math.min(1, Math.max(0, (playhead - a.time) / (b.time - a.time))) : 0;
    if (this.shown === a.values && this.shownAt === t) return;
    this.shown = a.values;
    this.shownAt = t;
    const out = this.head.vertices;
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
    this.head.pose();
  }

  fit() {
    const width = this.canvas.clientWidth;
    const height = this.canvas.clientHeight;
    const ratio = this.full ? Math.min(devicePixelRatio, 2) : this.part;
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

function still(mesh) {
  mesh.frustumCulled = false;
  mesh.matrixAutoUpdate = false;
  return mesh;
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
