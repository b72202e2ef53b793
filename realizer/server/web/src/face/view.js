// The head that is edited, in WebGL: clay with heat colours, the zone as wire, and the camera.
import { AmbientLight, BufferAttribute, BufferGeometry, Color, DirectionalLight, DynamicDrawUsage, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial, PerspectiveCamera, Scene, SphereGeometry, Spherical, Vector3, WebGLRenderer, WireframeGeometry } from "three";

const FOV = 20;
const LIMIT = { pitch: 1.3, yaw: 3.1 };
const CLAY = { skin: 0xc9b3a4, left_eye: 0xf2efe9, right_eye: 0xf2efe9, upper_teeth: 0xeee8dc, lower_teeth: 0xeee8dc, tongue: 0xb4615e };
const OTHER = 0x8a8f9c;
const IRIS = 0x3d4a5c;
const [ARROW, OVER] = [0.0075, 0.0012]; // m: the longest arrow, and how far arrows are over the skin
// Influence from nothing to all of it; what a mask holds is drawn in another colour.
const HEAT = [0x2f6fd0, 0x2fb6a8, 0xf2d13c, 0xe0522f].map((hex) => new Color(hex));
const MASKED = new Color(0x8f5bd6);

export class View {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(FOV, 1, 0.02, 20);
    const key = new DirectionalLight(0xffffff, 2.2);
    key.position.set(0.25, 0.45, 1);
    this.camera.add(key);
    this.scene.add(this.camera, new AmbientLight(0xffffff, 1.1));
    this.material = new MeshLambertMaterial({ vertexColors: true, side: 2 });
    const wire = new WireframeGeometry(new SphereGeometry(1, 16, 8));
    this.zone = new LineSegments(wire, new LineBasicMaterial({ color: 0xffffff, transparent: true, opacity: 0.25, depthTest: false }));
    this.zone.visible = false;
    this.ways = Object.assign(new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: 0x101828 })), { frustumCulled: false, visible: false });
    this.scene.add(this.zone, this.ways);
    this.hidden = new Set();
    this.stale = true;
    this.home();
  }

  home() {
    this.orbit = { yaw: 0, pitch: 0, away: 0.95, x: 0, y: -0.045, z: 0.02 };
    this.stale = true;
  }

  // Show another head.
  load(mesh) {
    this.mesh = mesh;
    if (this.shape) {
      this.scene.remove(this.shape);
      this.shape.geometry.dispose();
    }
    const geometry = new BufferGeometry();
    const colours = new Float32Array(3 * mesh.count);
    for (const [name, array] of [["position", mesh.posed], ["normal", mesh.normals], ["color", colours]])
      geometry.setAttribute(name, new BufferAttribute(array, 3).setUsage(DynamicDrawUsage));
    this.shape = Object.assign(new Mesh(geometry, this.material), { frustumCulled: false });
    this.scene.add(this.shape);
    this.clay = new Float32Array(3 * mesh.count);
    for (const [name, [first, last]] of Object.entries(mesh.parts)) {
      const colour = new Color(CLAY[name] ?? OTHER);
      for (let i = first; i < last; i++) colour.toArray(this.clay, 3 * i);
    }
    mesh.eyes.forEach(({ centre, size }, side) => {
      const [first, last] = mesh.parts[side ? "right_eye" : "left_eye"];
      const iris = new Color(IRIS);
      const v = mesh.vertices;
      for (let i = first; i < last; i++)
        if (v[3 * i + 2] > centre[2] && Math.hypot(v[3 * i] - centre[0], v[3 * i + 1] - centre[1]) < 0.42 * size) iris.toArray(this.clay, 3 * i);
    });
    this.show(this.hidden);
    this.paint(null, null);
    this.home();
  }

  // Draw all parts but these.
  show(hidden) {
    this.hidden = hidden;
    const keep = new Uint8Array(this.mesh.count).fill(1);
    for (const name of hidden) if (this.mesh.parts[name]) keep.fill(0, ...this.mesh.parts[name]);
    this.kept = keep;
    const { triangles } = this.mesh;
    this.shape.geometry.setIndex(new BufferAttribute(triangles.filter((_, k) => keep[triangles[k - (k % 3)]]), 1));
    this.stale = true;
  }

  // Colour vertices by how far a field moves them, 0..1, and by a mask; null: clay.
  paint(field, mask) {
    const { array } = this.shape.geometry.attributes.color;
    array.set(this.clay);
    for (let i = 0, k = 0; field && i < this.mesh.count; i++, k = 3 * i) {
      if (!field[k] && !field[k + 1] && !field[k + 2]) continue;
      const amount = Math.min(0.9999, Math.sqrt(field[k] ** 2 + field[k + 1] ** 2 + field[k + 2] ** 2));
      const share = Math.min(0.9, 5 * amount); // the edge of a zone is soft
      const step = amount * (HEAT.length - 1);
      const [low, high, t] = [HEAT[Math.floor(step)], HEAT[Math.floor(step) + 1], step % 1];
      array[k] += share * (low.r + t * (high.r - low.r) - array[k]);
      array[k + 1] += share * (low.g + t * (high.g - low.g) - array[k + 1]);
      array[k + 2] += share * (low.b + t * (high.b - low.b) - array[k + 2]);
    }
    for (let i = 0, k = 0; mask && i < this.mesh.count; i++, k = 3 * i) {
      if (!mask[i]) continue;
      array[k] = 0.55 * MASKED.r + 0.45 * array[k];
      array[k + 1] = 0.55 * MASKED.g + 0.45 * array[k + 1];
      array[k + 2] = 0.55 * MASKED.b + 0.45 * array[k + 2];
    }
    this.touch("color");
  }

  // Draw vertices (3 numbers each), of which only the numbers `changed` are new; null: any.
  pose(at, changed = null) {
    this.mesh.pose(at, changed);
    this.touch("position", "normal");
  }

  touch(...names) {
    for (const name of names) this.shape.geometry.attributes[name].needsUpdate = true;
    this.stale = true;
  }

  // The zone of influence as wire, or none.
  wire(at, radii) {
    this.zone.visible = Boolean(at);
    if (at) {
      this.zone.position.set(...at);
      this.zone.scale.set(...radii);
    }
    this.stale = true;
  }

  // Arrows on the skin along a field of at most 1, from these vertices; null: none.
  arrows(vertices, field) {
    this.ways.visible = Boolean(vertices);
    this.stale = true;
    if (!vertices) return;
    const { posed, normals } = this.mesh;
    const lines = new Float32Array(18 * vertices.length);
    vertices.forEach((i, n) => {
      const up = [0, 1, 2].map((k) => normals[3 * i + k]);
      const way = [0, 1, 2].map((k) => field[3 * i + k]);
      const long = Math.hypot(...way);
      const unit = way.map((x) => x / long);
      const aside = [0, 1, 2].map((k) => unit[(k + 1) % 3] * up[(k + 2) % 3] - unit[(k + 2) % 3] * up[(k + 1) % 3]);
      const far = ARROW * (0.4 + 0.6 * long);
      const from = up.map((x, k) => posed[3 * i + k] + OVER * x);
      const tip = from.map((x, k) => x + far * unit[k]);
      const barb = (side) => tip.map((x, k) => x - 0.35 * far * (unit[k] + 0.6 * side * aside[k]));
      lines.set([...from, ...tip, ...tip, ...barb(1), ...tip, ...barb(-1)], 18 * n);
    });
    this.ways.geometry.dispose();
    this.ways.geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(lines, 3));
  }

  // Draw if something has changed; return whether.
  draw() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (this.width !== width || this.height !== height) {
      Object.assign(this, { width, height, stale: true });
      this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
      this.renderer.setSize(width, height, false);
    }
    if (!this.stale || !this.shape) return false;
    this.stale = false;
    const { yaw, pitch, away, x, y, z } = this.orbit;
    this.camera.position.setFromSpherical(new Spherical(away * Math.max(1, 0.8 / (width / height)), Math.PI / 2 - pitch, yaw)).add(new Vector3(x, y, z));
    this.camera.lookAt(x, y, z);
    this.camera.aspect = width / Math.max(1, height);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
    this.renderer.render(this.scene, this.camera);
    return true;
  }

  // Turn, come nearer or move aside.
  move({ yaw = 0, pitch = 0, nearer = 1, x = 0, y = 0 }) {
    const { orbit } = this;
    orbit.yaw = Math.max(-LIMIT.yaw, Math.min(LIMIT.yaw, orbit.yaw + yaw));
    orbit.pitch = Math.max(-LIMIT.pitch, Math.min(LIMIT.pitch, orbit.pitch + pitch));
    orbit.away = Math.max(0.12, Math.min(2.5, orbit.away / nearer));
    const [right, up] = this.axes;
    for (const [k, axis] of ["x", "y", "z"].entries()) orbit[axis] += x * right[k] + y * up[k];
    this.stale = true;
  }

  // The directions to the right and up on the screen.
  get axes() {
    const { elements } = this.camera.matrixWorld;
    return [0, 4].map((k) => [elements[k], elements[k + 1], elements[k + 2]]);
  }

  // Metres of a pixel at a place.
  pixel(place) {
    const away = this.camera.position.distanceTo(new Vector3(...place));
    return (2 * away * Math.tan((FOV * Math.PI) / 360)) / Math.max(1, this.height);
  }

  // Where a place is on the canvas, in pixels.
  onScreen(place) {
    const at = new Vector3(...place).project(this.camera);
    return [((at.x + 1) / 2) * this.width, ((1 - at.y) / 2) * this.height];
  }

  // Where a pixel of the canvas meets the head.
  hit(x, y) {
    const from = this.camera.position.toArray();
    const to = new Vector3((2 * x) / this.width - 1, 1 - (2 * y) / this.height, 0.5).unproject(this.camera);
    const way = to.sub(this.camera.position).normalize().toArray();
    return this.mesh.hit(from, way, (vertex) => this.kept[vertex]);
  }

  // Whether a vertex faces the camera.
  faces(vertex) {
    const { posed, normals } = this.mesh;
    const at = this.camera.position;
    const k = 3 * vertex;
    return normals[k] * (at.x - posed[k]) + normals[k + 1] * (at.y - posed[k + 1]) + normals[k + 2] * (at.z - posed[k + 2]) > 0;
  }
}
