// The face in WebGL: vertices from the mesh stream, lit by the same formula as the stills (see /look.json).

import * as THREE from "three";
import { readGlb } from "./glb.js";

const vertexShader = /* glsl */ `
  attribute vec4 albedo;
  attribute float occlusion;
  attribute float gloss;
  varying vec3 vNormal;
  varying vec3 vAlbedo;
  varying vec2 vSurface;
  void main() {
    vNormal = normal;
    vAlbedo = albedo.rgb;
    vSurface = vec2(occlusion, gloss);
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  }
`;

const fragmentShader = /* glsl */ `
  struct Lamp { vec3 direction; vec3 colour; vec3 wrap; };
  uniform Lamp keyLamp, fillLamp, rimLamp;
  uniform vec3 sky, ground, towards;
  uniform float rimPower, shadow, highlight, dull, sharp, exposure, knee;
  varying vec3 vNormal;
  varying vec3 vAlbedo;
  varying vec2 vSurface;

  vec3 lamp(Lamp l, vec3 n) {
    return max(vec3(0.0), l.colour * (dot(n, l.direction) + l.wrap) / (1.0 + l.wrap));
  }
  vec3 shoulder(vec3 x) {
    return mix(x, 1.0 - (1.0 - knee) * exp(-(x - knee) / (1.0 - knee)), step(knee, x));
  }
  vec3 srgb(vec3 c) {
    c = clamp(c, 0.0, 1.0);
    return mix(c * 12.92, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
  }
  void main() {
    vec3 n = normalize(vNormal);
    float occ = vSurface.x, gloss = vSurface.y;
    float reach = 1.0 - shadow * (1.0 - occ);
    float edge = pow(1.0 - clamp(dot(n, towards), 0.0, 1.0), rimPower);
    vec3 light = (lamp(keyLamp, n) + lamp(fillLamp, n) + lamp(rimLamp, n) * edge) * reach
      + mix(ground, sky, (1.0 + n.y) / 2.0) * occ;
    float facing = max(dot(n, normalize(keyLamp.direction + towards)), 1e-6);
    vec3 shine = gloss * highlight * pow(facing, dull * pow(sharp / dull, gloss)) * keyLamp.colour;
    gl_FragColor = vec4(srgb(shoulder(exposure * (vAlbedo * light + shine * reach))), 1.0);
  }
`;

const uniform = (value) => ({
  value: Array.isArray(value) ? new THREE.Vector3(...value) : value,
});
const lamp = (l) => ({
  value: Object.fromEntries(Object.entries(l).map(([name, v]) => [name, new THREE.Vector3(...v)])),
});

export class FaceView {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace; // the shader writes sRGB itself
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(16, 1, 0.1, 10);
    this.turn = { yaw: 0, pitch: 0 };
    this.dirty = true;
    this.frames = 0;
    this.listen();
  }

  async load(name) {
    const [look, glb] = await Promise.all([
      fetch(`/look.json?face=${encodeURIComponent(name)}`).then((r) => this.checked(r).json()),
      fetch(`/faces/${encodeURIComponent(name)}`).then((r) => this.checked(r).arrayBuffer()),
    ]);
    this.look = look;
    const { attributes, indices } = readGlb(glb);
    const geometry = new THREE.BufferGeometry();
    const positions = new Float32Array(attributes.POSITION.array);
    geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3).setUsage(THREE.DynamicDrawUsage));
    geometry.setAttribute("normal", new THREE.BufferAttribute(new Float32Array(positions.length), 3));
    const of = ({ array, size, normalized }) => new THREE.BufferAttribute(array, size, normalized);
    geometry.setAttribute("albedo", of(attributes.COLOR_0));
    geometry.setAttribute("occlusion", of(attributes._OCCLUSION));
    geometry.setAttribute("gloss", of(attributes._GLOSS));
    geometry.setIndex(new THREE.BufferAttribute(indices, 1));
    geometry.computeVertexNormals();
    const { light } = look;
    this.material = new THREE.ShaderMaterial({
      vertexShader,
      fragmentShader,
      uniforms: {
        keyLamp: lamp(light.key),
        fillLamp: lamp(light.fill),
        rimLamp: lamp(light.rim),
        sky: uniform(light.sky),
        ground: uniform(light.ground),
        towards: uniform([0, 0, 1]),
        rimPower: uniform(light.rim_power),
        shadow: uniform(light.shadow),
        highlight: uniform(light.highlight),
        dull: uniform(light.dull),
        sharp: uniform(light.sharp),
        exposure: uniform(light.exposure),
        knee: uniform(light.knee),
      },
    });
    this.scene.clear();
    this.mesh = new THREE.Mesh(geometry, this.material);
    this.mesh.frustumCulled = false;
    this.scene.add(this.mesh);
    const css = (c) => `rgb(${c.map((v) => Math.round(v * 255)).join(" ")})`;
    const middle = css(light.backdrop_middle);
    this.canvas.parentElement.style.background = middle;
    this.renderer.setClearColor(new THREE.Color(...light.backdrop_middle), 1);
    this.dirty = true;
  }

  checked(response) {
    if (!response.ok) throw new Error(`${response.url}: ${response.status}`);
    return response;
  }

  // A mesh frame: int16 x scale + offset, in metres.
  show(frame, { scale, offset }) {
    if (!this.mesh) return;
    const values = new Int16Array(frame.buffer, frame.offset);
    const { position } = this.mesh.geometry.attributes;
    if (values.length !== position.array.length) return;
    const out = position.array;
    for (let i = 0; i < values.length; i += 3) {
      out[i] = values[i] * scale + offset[0];
      out[i + 1] = values[i + 1] * scale + offset[1];
      out[i + 2] = values[i + 2] * scale + offset[2];
    }
    position.needsUpdate = true;
    this.mesh.geometry.computeVertexNormals();
    this.frames += 1;
    this.dirty = true;
  }

  draw() {
    if (!this.mesh) return;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const ratio = Math.min(devicePixelRatio, 2);
    const size = this.renderer.getSize(new THREE.Vector2());
    if (size.x !== width || size.y !== height || this.renderer.getPixelRatio() !== ratio) {
      this.renderer.setPixelRatio(ratio);
      this.renderer.setSize(width, height, false);
      this.dirty = true;
    }
    if (!this.dirty || !width || !height) return;
    this.dirty = false;
    const preset = this.look.camera;
    const target = new THREE.Vector3(...preset.target);
    const away = new THREE.Vector3(...preset.position).sub(target);
    const spherical = new THREE.Spherical().setFromVector3(away);
    spherical.theta += this.turn.yaw;
    spherical.phi = Math.min(2.6, Math.max(0.6, spherical.phi + this.turn.pitch));
    this.camera.position.setFromSpherical(spherical).add(target);
    this.camera.aspect = width / height;
    // The preset frames a square; a picture taller than wide keeps the whole head in view.
    const half = Math.tan((preset.fovy * Math.PI) / 360) / Math.min(1, this.camera.aspect * 1.15);
    this.camera.fov = (2 * Math.atan(half) * 180) / Math.PI;
    this.camera.near = preset.near;
    this.camera.far = preset.far;
    this.camera.lookAt(target);
    this.camera.updateProjectionMatrix();
    this.material.uniforms.towards.value.copy(this.camera.position).sub(target).normalize();
    this.renderer.render(this.scene, this.camera);
  }

  listen() {
    const { canvas, turn } = this;
    let from = null;
    canvas.addEventListener("pointerdown", (e) => {
      from = { x: e.clientX, y: e.clientY, ...turn };
      canvas.setPointerCapture(e.pointerId);
    });
    canvas.addEventListener("pointermove", (e) => {
      if (!from) return;
      turn.yaw = from.yaw - (e.clientX - from.x) * 0.008;
      turn.pitch = from.pitch - (e.clientY - from.y) * 0.006;
      this.dirty = true;
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => (from = null));
    const front = () => {
      turn.yaw = turn.pitch = 0;
      this.dirty = true;
    };
    canvas.addEventListener("dblclick", front);
    canvas.addEventListener("keydown", (e) => {
      const step = { ArrowLeft: ["yaw", -1], ArrowRight: ["yaw", 1], ArrowUp: ["pitch", -1], ArrowDown: ["pitch", 1] }[e.key];
      if (step) turn[step[0]] += step[1] * 0.12;
      else if (e.key === "Home") front();
      else return;
      e.preventDefault();
      this.dirty = true;
    });
  }
}
