/**
 * The element <bml-face>: a user's own avatar, driven by a session.
 *
 *   <script type="module" src="http://127.0.0.1:8765/bml-face.js"></script>
 *   <bml-face url="ws://127.0.0.1:8765/ws" session="show" avatar="mine.vrm" style="width: 400px; height: 400px"></bml-face>
 *
 *   await document.querySelector("bml-face").realizer.play('<bml id="b"><speech id="s"><text>Hello</text></speech></bml>');
 */
import { Clock, Realizer, Sound } from "./index.js";
import { Avatar, loadAvatar, shapeOf } from "./avatar.js";
import { DirectionalLight, HemisphereLight, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from "three";

export { Avatar, loadAvatar, shapeOf };

const FPS = 30;
const ANGLE = 20; // degrees, of the camera
const AROUND = 2; // height of the picture in heights of the part of the face that moves
const ABOVE = 0.08; // of these heights, from its middle to that of the picture
const KEPT = 1; // s; older frames are dropped
const LINE = 42; // characters of a line of captions, as in subtitles
const READING = 1; // s; so long a line stays after its last word
const GESTURES = ["pointerdown", "keydown"];
const STYLE = `
  :host { display: block; position: relative; min-width: 1px; min-height: 1px; aspect-ratio: 1; }
  :host([hidden]) { display: none; }
  canvas { position: absolute; width: 100%; height: 100%; }
  p { position: absolute; inset: auto 0 0 0; margin: 0; padding: 0.5em; font: 14px/1.4 sans-serif; color: #fff; overflow-wrap: anywhere; }
  [part="error"] { background: #8b1a1acc; }
  [part="captions"] { background: #000a; text-align: center; }
  p:empty { display: none; }`;

/**
 * Attributes: `url` of the service's WebSocket (default: the service that this file comes from), `session`, `token`,
 * `character`, `avatar` (address of a .glb or .vrm file), `muted`, `captions` (shows words as they are spoken, part `captions`). All
 * may change at any time.
 *
 * Events: `load` when an avatar is shown, `error` with `message` when something failed, which is also written below the
 * avatar; part `error` styles it.
 */
export class BmlFace extends (globalThis.HTMLElement ?? class {}) {
  static observedAttributes = ["url", "session", "token", "character", "avatar", "muted", "captions"];
  /** The client of the session, a `Realizer`; null while the element is in no page. */
  realizer = null;
  /** The avatar that is shown, an `Avatar`; null before it is loaded. */
  avatar = null;
  #three = null; // { renderer, scene, camera, observer, frame } while it is in a page
  #clock = new Clock();
  #sound = new Sound(this.#clock);
  #frames = [];
  #names = [];
  #captions = new Map(); // block -> { start, end, lines: [[{ start, end, text }, ...], ...] }
  #changed = new Set();
  #live = false; // from `connectedCallback` on, which comes after the first `attributeChangedCallback`
  #faults = new Map(); // what failed -> message
  #start = () => this.#unmute();

  connectedCallback() {
    const root = this.shadowRoot ?? this.attachShadow({ mode: "open" });
    root.innerHTML = `<style>${STYLE}</style><canvas role="img" aria-label="a talking face"></canvas><p part="captions"></p><p part="error" role="alert"></p>`;
    for (const type of GESTURES) document.addEventListener(type, this.#start);
    try {
      this.#three = this.#stage(root.querySelector("canvas"));
    } catch (error) {
      this.#fail("canvas", error);
    }
    this.#live = true;
    this.#connect();
    this.#load();
  }

  disconnectedCallback() {
    this.#live = false;
    for (const type of GESTURES) document.removeEventListener(type, this.#start);
    this.realizer?.close();
    this.realizer = null;
    this.#sound.mute();
    this.#sound.context?.close();
    this.#sound.context = null;
    this.avatar?.dispose();
    this.avatar = null;
    this.#faults.clear();
    if (!this.#three) return;
    const { renderer, observer, frame } = this.#three;
    cancelAnimationFrame(frame);
    observer.disconnect();
    renderer.dispose();
    renderer.forceContextLoss();
    this.#three = null;
  }

  attributeChangedCallback(name, before, now) {
    if (!this.#live || before === now) return;
    if (name === "muted") return this.#unmute();
    // Attributes that change together connect once.
    if (!this.#changed.size) queueMicrotask(() => this.#apply());
    this.#changed.add(name);
  }

  #apply() {
    const changed = new Set(this.#changed);
    this.#changed.clear();
    if (!this.#live) return;
    if (changed.delete("avatar")) this.#load();
    if (changed.size) this.#connect();
  }

  #stage(canvas) {
    const renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    const scene = new Scene();
    const sun = new DirectionalLight(0xffffff, 2);
    sun.position.set(0.5, 1, 1.5);
    scene.add(new HemisphereLight(0xffffff, 0x888888, 1.5), sun);
    const camera = new PerspectiveCamera(ANGLE, 1, 0.01, 1000);
    const observer = new ResizeObserver(() => {
      const { clientWidth: width, clientHeight: height } = this;
      if (!width || !height) return;
      renderer.setPixelRatio(devicePixelRatio);
      renderer.setSize(width, height, false);
      camera.aspect = width / height;
      camera.updateProjectionMatrix();
      renderer.render(scene, camera);
    });
    observer.observe(this);
    const three = { renderer, scene, camera, observer };
    let last = performance.now();
    const draw = (now) => {
      three.frame = requestAnimationFrame(draw);
      this.#show((now - last) / 1000);
      last = now;
      renderer.render(scene, camera);
    };
    three.frame = requestAnimationFrame(draw);
    return three;
  }

  #connect() {
    this.realizer?.close();
    this.#reset();
    this.#clear("connection");
    const own = (name) => this.getAttribute(name) || undefined;
    const fail = (error) => this.realizer === realizer && this.#fail("connection", error);
    let realizer;
    try {
      realizer = new Realizer({ url: own("url") && new URL(own("url"), location.href), session: own("session"), token: own("token") });
    } catch (error) {
      this.realizer = null;
      return this.#fail("connection", error);
    }
    this.realizer = realizer;
    let wasOpen = false;
    realizer.onopen = () => {
      wasOpen = true;
      this.#reset();
      this.#clear("connection");
    };
    realizer.onlost = (error) => {
      const { origin } = realizer.url;
      const page = location.protocol === "file:" ? "this page, which was opened as a file: open it by HTTP" : "this page";
      const reason = wasOpen ? `lost the connection to ${origin}, connecting again` : `no service at ${origin}, or it refuses ${page}; trying again`;
      fail(error ?? new Error(reason));
    };
    const character = own("character");
    realizer.connect().catch((error) => realizer.socket ?? fail(error)); // `onlost` says why there is no connection
    const take = (frame) => this.realizer === realizer && this.#take(frame);
    const play = (packet) => this.realizer === realizer && this.#sound.packet(packet.time, packet.values(), packet.forget);
    const chosen = character === undefined ? {} : { character };
    realizer.arkit({ ahead: 0, fps: FPS, ...chosen }, take).catch(fail);
    realizer.sound({ rate: this.#sound.rate, ...chosen }, play).catch(fail);
    const plan = (message) => this.realizer === realizer && this.#plan(message);
    if (this.hasAttribute("captions")) realizer.subscribe("schedule", chosen, plan).catch(fail);
    this.#unmute();
  }

  #reset() {
    this.#frames = [];
    this.#captions.clear();
    this.#clock.reset();
    this.#sound.reset();
  }

  /** Start sound, which browsers allow after a gesture, or mute it. */
  #unmute() {
    if (this.hasAttribute("muted")) this.#sound.mute();
    else if (navigator.userActivation?.hasBeenActive ?? true) this.#sound.start();
  }

  async #load() {
    const address = this.getAttribute("avatar");
    this.#clear("avatar");
    try {
      if (!address) throw new Error("avatar: wanted the address of a .glb or .vrm file, got none");
      const avatar = await loadAvatar(new URL(address, document.baseURI));
      if (this.getAttribute("avatar") !== address || !this.#three) return avatar.dispose();
      this.avatar?.dispose();
      this.avatar = avatar;
      this.#three.scene.add(avatar.scene);
      this.#frame();
      this.dispatchEvent(new Event("load"));
    } catch (error) {
      if (this.getAttribute("avatar") === address && this.#live) this.#fail("avatar", error);
    }
  }

  /** Place the camera before the face. */
  #frame() {
    const { camera } = this.#three;
    const box = this.avatar.bounds;
    const middle = box.getCenter(new Vector3());
    const { x, y } = box.getSize(new Vector3());
    middle.y += ABOVE * y;
    const far = (AROUND * Math.max(x, y, 1e-3)) / 2 / Math.tan((ANGLE * Math.PI) / 360);
    camera.position.set(middle.x, middle.y, box.max.z + far);
    camera.near = far / 100;
    camera.far = far * 100;
    camera.lookAt(middle.x, middle.y, box.max.z);
    camera.updateProjectionMatrix();
  }

  #take(frame) {
    this.#clock.heard(frame.time, performance.now() / 1000);
    if (frame.streamInfo.names) this.#names = frame.streamInfo.names;
    this.#frames = this.#frames.filter(({ time }) => time < frame.time && time > frame.time - KEPT);
    this.#frames.push({ time: frame.time, values: frame.values() });
  }

  /** Take the words of the blocks of a message `schedule`. A block whose times have not changed comes without them. */
  #plan({ whole, blocks }) {
    if (whole) this.#captions.clear();
    for (const { block, start, end, behaviours } of blocks) {
      const words = behaviours?.flatMap(({ words = [] }) => words);
      this.#captions.set(block, { start, end, lines: words ? linesOf(words) : (this.#captions.get(block)?.lines ?? []) });
    }
  }

  /** Return the words of the present line that have begun. */
  #caption(time) {
    let said = "";
    for (const [block, { start, end, lines }] of this.#captions) {
      if (start === null || time === null) continue;
      const heard = Math.min(time, end ?? time) - start;
      const begun = lines.findLast(([first]) => first.start <= heard)?.filter((word) => word.start <= heard);
      if (begun && time - start < begun.at(-1).end + READING) said = begun.map(({ text }) => text).join(" ");
      if (end !== null && time > end + KEPT + READING) this.#captions.delete(block);
    }
    return said;
  }

  /** Show the values at the time that is heard, between two frames. */
  #show(passed) {
    const time = this.#sound.playhead() ?? this.#clock.playhead(performance.now() / 1000);
    const captions = this.shadowRoot.querySelector("[part=captions]");
    const said = this.#caption(time);
    if (captions.textContent !== said) captions.textContent = said;
    if (!this.avatar || !this.#frames.length || !this.#names.length) return;
    const next = this.#frames.findIndex((frame) => frame.time > time);
    const b = this.#frames.at(next);
    const a = next > 0 ? this.#frames[next - 1] : b;
    const share = b.time > a.time ? (time - a.time) / (b.time - a.time) : 0;
    this.avatar.show(this.#names, Array.from(a.values, (value, k) => value + share * (b.values[k] - value)), passed);
  }

  #fail(what, error) {
    this.#faults.set(what, error.message);
    this.#write();
    this.dispatchEvent(new ErrorEvent("error", { message: error.message, error }));
  }

  #clear(what) {
    if (this.#faults.delete(what)) this.#write();
  }

  #write() {
    this.shadowRoot.querySelector("[part=error]").textContent = [...this.#faults.values()].join("\n");
  }
}

/** Group words in lines of at most `LINE` characters. */
function linesOf(words) {
  const lines = [];
  let length = LINE;
  for (const word of words) {
    length += 1 + word.text.length;
    if (length > LINE) {
      lines.push([]);
      length = word.text.length;
    }
    lines.at(-1).push(word);
  }
  return lines;
}

globalThis.customElements?.get("bml-face") ?? globalThis.customElements?.define("bml-face", BmlFace);
