/**
 * A client of the BML realizer for web pages: it sends BML and receives feedback, frames and sound.
 *
 *   import { Realizer, Clock, Sound } from "http://127.0.0.1:8765/realizer.js";
 *
 *   const realizer = new Realizer({ session: "show" });
 *   realizer.onfeedback = (element) => console.log(element.outerHTML);
 *   realizer.connect();
 *   const { names } = await realizer.arkit({ fps: 30 }, (frame) => move(head, frame.values()));
 *   await realizer.play('<bml id="hello"><speech id="s"><text>Hello there.</text></speech></bml>');
 *
 * Sound, with the face on its clock:
 *
 *   const clock = new Clock();
 *   const sound = new Sound(clock);
 *   button.onclick = () => sound.start(); // browsers require a gesture
 *   await realizer.subscribe("audio", { rate: sound.rate }, (p) => sound.packet(p.time, p.values(), p.forget));
 *   realizer.subscribe("arkit", {}, (frame) => clock.heard(frame.time, performance.now() / 1000));
 *   // the session time to show now: sound.playhead() ?? clock.playhead(performance.now() / 1000)
 *
 * What the messages are: asyncapi.json beside this file.
 */

// protocol: written by python -m tests.protocol
/** Version of the protocol; a service that speaks another one refuses `hello`. */
export const VERSION = 1;
const HEADER = 16; // bytes: u8 kind, u8 version, u16 flags, u32 frame, f64 time
const FORGET = 0x100; // flag: forget everything from this time on
const KINDS = {
  1: ["fap", Int32Array],
  2: ["au", Float32Array],
  3: ["video", Uint8Array],
  4: ["audio", Int16Array],
  5: ["mesh", Int16Array],
  6: ["arkit", Float32Array],
};
const JSON_STREAMS = ["fap", "au", "arkit", "schedule"];
const ANSWERS = { hello: "welcome", subscribe: "subscribed", state: "state", ping: "pong" };
// end of protocol

const AHEAD = 0.2; // s; frames that are sent so long before their time survive most delays
export const BMLA = "http://www.asap-project.org/bmla"; // namespace of the states of blocks
const RETRY = [0.3, 0.6, 1.2, 2.5, 5]; // s
const BLOCK = /<(?:\w+:)?bml\b[^<>]*?\sid\s*=\s*["']([^"'<>]+)["']/g;
const COMMENT = /<!--[^]*?-->|<\?[^]*?\?>/g;
const nothing = () => {};
const keyOf = ({ stream, character, view }) => JSON.stringify([stream, character ?? "", view ?? ""]);

/** Why the service refused a message; `code` and `where` are those of the message `error`. */
export class RealizerError extends Error {
  constructor(message, code = "connection", where = null) {
    super(message);
    this.name = "RealizerError";
    this.code = code;
    this.where = where;
  }
}

/**
 * A connection that is restored automatically, with the feedback it missed and its streams.
 *
 * Handlers, as of a WebSocket:
 *   onopen()                    connected or reconnected
 *   onlost()                    disconnected; a new connection is tried
 *   onfeedback(element, seq)    BML feedback, as an XML element
 *   onreply(message)            every JSON message that is not a frame: welcome, subscribed, state, error, ...
 *   onframe(frame)              every frame of every stream, see `frameOf`; its `streamInfo` has the fields of the last
 *                               `subscribed` or `changed` of its stream, such as face, scale and offset of a mesh
 */
export class Realizer {
  onopen = nothing;
  onlost = nothing;
  onfeedback = nothing;
  onreply = nothing;
  onframe = nothing;
  /** seq of the newest feedback; null before the first. */
  seen = null;
  /** The current WebSocket. */
  socket = null;
  #tries = 0;
  #closed = false;
  #asked = []; // { message, resolve, reject } of requests without an answer
  // stream, character and view -> { message, take, streamInfo: fields of `subscribed`, playout: with `ahead` }
  #streams = new Map();
  #unsent = []; // documents to send once the connection is open
  #awaited = new Map(); // block id -> [{ planned, resolve, reject }]

  /**
   * @param {object} [options]
   * @param {string} [options.url] of the service's WebSocket; default: the service of this file
   * @param {string} [options.token] the access token, if the service requires one
   * @param {string} [options.session] name of the session to join or create; default: a new, random name
   */
  constructor({ url, session, token } = {}) {
    this.url = new URL(url ?? new URL("ws", import.meta.url));
    if (this.url.protocol.startsWith("http")) this.url.protocol = this.url.protocol.replace("http", "ws");
    if (token) this.url.searchParams.set("token", token);
    this.session = session ?? `page-${crypto.getRandomValues(new Uint32Array(2)).join("-")}`;
  }

  /** Whether the connection is open. */
  get open() {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  /** Connect, and reconnect until `close`. Requests made before the connection is open are sent then. */
  connect() {
    this.#closed = false;
    const url = new URL(this.url);
    url.searchParams.set("session", this.session);
    if (this.seen !== null) url.searchParams.set("seen", this.seen);
    const socket = (this.socket = new WebSocket(url));
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.#tries = 0;
      for (const { message, playout } of this.#streams.values()) {
        playout?.reset();
        this.#post(message);
      }
      for (const { message } of this.#asked) if (message.type !== "subscribe") this.#post(message);
      for (const text of this.#unsent.splice(0)) this.send(text);
      this.onopen();
    };
    socket.onmessage = (event) => this.#receive(event.data);
    socket.onclose = () => {
      if (this.#closed) return;
      this.onlost();
      setTimeout(() => this.#closed || this.connect(), 1000 * RETRY[Math.min(this.#tries++, RETRY.length - 1)]);
    };
  }

  /** Close the connection; pending promises are rejected. */
  close() {
    this.#closed = true;
    this.socket?.close();
    const over = new RealizerError("the connection was closed");
    for (const { reject } of [...this.#asked, ...[...this.#awaited.values()].flat()]) reject(over);
    this.#asked = [];
    this.#unsent = [];
    this.#awaited.clear();
  }

  /** Send BML, one or more documents. It is lost if the connection is not open. */
  send(text) {
    if (this.open) this.socket.send(text);
  }

  /**
   * Send a control message, such as { type: "state" }.
   * @returns {Promise<object|null>} the answer; null immediately for messages without one. Rejects with a
   *   RealizerError if the answer is an error; this need not be handled, as `onreply` gets it too.
   */
  ask(message) {
    this.#post(message);
    if (!(message.type in ANSWERS)) return Promise.resolve(null);
    const answer = new Promise((resolve, reject) => this.#asked.push({ message, resolve, reject }));
    answer.catch(nothing);
    return answer;
  }

  /**
   * Subscribe to fap, au, arkit, mesh, audio, video, schedule or feedback, also after a reconnect.
   * @param {string} stream
   * @param {object} [options] encoding, fps, character, ... of the message `subscribe`. With `ahead` the service sends
   *   frames up to that many seconds before their time, and each is passed on at its time
   * @param {function} [take] called with every frame
   * @returns {Promise<object>} the message `subscribed`, which describes the values
   */
  subscribe(stream, options = {}, take = nothing) {
    const message = { type: "subscribe", stream, ...options };
    const key = keyOf(message);
    const pass = (frame) => {
      take(frame);
      this.onframe(frame);
    };
    const playout = options.ahead > 0 ? new Playout(options.ahead, pass) : null;
    this.#streams.get(key)?.playout?.reset();
    this.#streams.set(key, { message, take, streamInfo: { index: 0 }, playout });
    const answer = this.ask(message);
    answer.catch(() => {
      if (this.#streams.get(key)?.message === message) this.#streams.delete(key);
    });
    return answer;
  }

  /** Subscribe to FAPs: `subscribe` with frames that are sent 0.2 s ahead. */
  faps(options = {}, take = nothing) {
    return this.subscribe("fap", { ahead: AHEAD, ...options }, take);
  }

  /** Subscribe to action units, as `faps`. */
  aus(options = {}, take = nothing) {
    return this.subscribe("au", { ahead: AHEAD, ...options }, take);
  }

  /** Subscribe to ARKit's weights and rotations, as `faps`. */
  arkit(options = {}, take = nothing) {
    return this.subscribe("arkit", { ahead: AHEAD, ...options }, take);
  }

  /** End a stream; `view` is the name of a video's view. */
  unsubscribe(stream, character, view) {
    const key = keyOf({ stream, character, view });
    this.#streams.get(key)?.playout?.reset();
    this.#streams.delete(key);
    this.#post({ type: "unsubscribe", stream, character, view });
  }

  /**
   * Send BML as soon as the connection is open, and wait for the end of its last block.
   * @returns {Promise<Element>} the feedback of the end; rejects if the block is refused
   */
  play(text) {
    const bare = text.replace(COMMENT, "");
    // The service answers every text except an empty one.
    if (!bare.trim()) return Promise.reject(new RealizerError("wanted <bml>, got nothing", "refused"));
    const ids = [...bare.matchAll(BLOCK)];
    const end = this.ended(ids.length ? ids.at(-1)[1] : "<no id>");
    if (this.open) this.send(text);
    else this.#unsent.push(text);
    return end;
  }

  /** Wait for the end of a block that was sent. */
  ended(id) {
    const end = new Promise((resolve, reject) => {
      this.#awaited.set(id, [...(this.#awaited.get(id) ?? []), { planned: false, resolve, reject }]);
    });
    end.catch(nothing);
    return end;
  }

  #post(message) {
    this.send(JSON.stringify(message));
  }

  #receive(data) {
    if (data instanceof ArrayBuffer) return this.#frame(frameOf(data));
    if (!data.startsWith("{")) return this.#feedback(data);
    const message = JSON.parse(data);
    if (JSON_STREAMS.includes(message.type)) return this.#frame(jsonFrameOf(message));
    // A new session of the same name: its numbers start again.
    if (message.type === "gap") this.seen = null;
    if (message.type === "subscribed" || message.type === "changed") {
      const stream = this.#streams.get(keyOf(message));
      if (stream) stream.streamInfo = { ...stream.streamInfo, ...message };
    }
    this.#answer(message);
    this.onreply(message);
  }

  #frame(frame) {
    let waits = false;
    for (const { message, take, streamInfo, playout } of this.#streams.values()) {
      // JSON frames name the character like the subscription, binary frames have its index.
      const own = frame.kind === undefined ? message.character : streamInfo.index;
      if (message.stream !== frame.stream || own !== frame.character) continue;
      frame.streamInfo = streamInfo;
      if (playout) {
        waits = true;
        if (streamInfo.names) playout.add(frame); // before `subscribed` it is of another subscription
      } else take(frame);
    }
    if (!waits) this.onframe(frame);
  }

  #answer(message) {
    const error = message.type === "error";
    const fits = error
      ? ({ message: { type } }) => message.where?.split(".")[0] === type
      : ({ message: { type, ...asked } }) =>
          ANSWERS[type] === message.type && (type !== "subscribe" || keyOf(asked) === keyOf(message));
    const k = this.#asked.findIndex(fits);
    if (k < 0) return;
    const [{ resolve, reject }] = this.#asked.splice(k, 1);
    error ? reject(new RealizerError(message.message, message.code, message.where)) : resolve(message);
  }

  #feedback(text) {
    const element = new DOMParser().parseFromString(text, "text/xml").documentElement;
    const seq = Number([...element.attributes].find((a) => a.localName === "seq")?.value);
    if (seq) this.seen = seq;
    const id = element.getAttribute("id");
    if (element.localName === "predictionFeedback") {
      for (const block of element.children) {
        if (block.getAttributeNS(BMLA, "status") !== "IN_PREP") for (const one of this.#awaited.get(block.getAttribute("id")) ?? []) one.planned = true;
      }
    } else if (element.localName === "blockProgress" && id.endsWith(":end")) {
      this.#settle(id.slice(0, -4), (one) => one.resolve(element));
    } else if (element.localName === "warningFeedback" && this.#awaited.get(id)?.some((one) => !one.planned)) {
      // A warning about the block itself refuses it, unless its prediction was already sent.
      this.#settle(id, (one) => one.reject(new RealizerError(element.textContent, "refused", id)));
    }
    this.onfeedback(element, seq);
  }

  #settle(id, how) {
    for (const one of this.#awaited.get(id) ?? []) how(one);
    this.#awaited.delete(id);
  }
}

/**
 * Decode a binary message.
 * @returns {object} stream, kind, character (its index in `subscribed`), frame (its number), time (seconds
 *   on the session clock), forget (discard everything from this time on that was sent before), values(): a typed array;
 *   for a picture the bytes of its file
 */
export function frameOf(buffer) {
  const view = new DataView(buffer);
  const kind = view.getUint8(0);
  if (!(kind in KINDS)) throw new RealizerError(`wanted a frame of kind ${Object.keys(KINDS)}, got ${kind}`);
  const [stream, Values] = KINDS[kind];
  return {
    stream,
    kind,
    character: view.getUint16(2, true) & 0xff,
    forget: Boolean(view.getUint16(2, true) & FORGET),
    frame: view.getUint32(4, true),
    time: view.getFloat64(8, true),
    values: () => new Values(buffer, HEADER),
  };
}

function jsonFrameOf(message) {
  return { stream: message.type, ...message, forget: Boolean(message.flush), values: () => message.values ?? [] };
}

/** Split a frame of a stream with `ahead` into frames of one row. */
function rowsOf(frame) {
  const { fps, names } = frame.streamInfo;
  const values = frame.values();
  const rows = frame.kind === undefined ? values : Array.from({ length: values.length / names.length }, (_, k) => values.subarray(k * names.length, (k + 1) * names.length));
  return rows.map((row, k) => ({ ...frame, frame: frame.frame + k, time: (frame.frame + k) / fps, forget: false, values: () => row }));
}

/** Delay of what is shown behind the newest data, in seconds, so that late packets are not missed. */
export const DELAY = 0.1;
const MEMORY = 5; // s

/** An estimate of the session clock: the frame with the least delay determines the offset. */
export class Clock {
  constructor() {
    this.reset();
  }

  /** Start again, as after a new connection. */
  reset() {
    this.offsets = [];
    this.offset = null;
  }

  /** Note that a frame of session time `time` arrived at `here`, both in seconds, on any local clock. */
  heard(time, here) {
    const offset = here - time;
    while (this.offsets.length && this.offsets[0].here < here - MEMORY) this.offsets.shift();
    while (this.offsets.length && this.offsets.at(-1).offset >= offset) this.offsets.pop();
    this.offsets.push({ here, offset });
    this.offset = this.offsets[0].offset;
  }

  /** The session time to show and play at `here`; null before the first frame. */
  playhead(here) {
    return this.offset === null ? null : here - this.offset - DELAY;
  }
}

/** Passes on frames that arrive up to `ahead` seconds early, each at its time, and drops those that were taken back. */
class Playout {
  #ahead;
  #take;
  #clock = new Clock();
  #frames = [];
  #next = 0; // number of the first frame that was not passed on
  #timer = null;

  constructor(ahead, take) {
    this.#ahead = ahead;
    this.#take = take;
  }

  /** Drop everything, as after a new connection. */
  reset() {
    clearTimeout(this.#timer);
    this.#clock.reset();
    this.#frames = [];
    this.#next = 0;
  }

  /** Add the rows of a frame, instead of those from its first one on. */
  add(frame) {
    const rows = rowsOf(frame);
    this.#frames = this.#frames.filter((old) => old.frame < frame.frame);
    this.#frames.push(...rows.filter((row) => row.frame >= this.#next));
    // The last row of a message is sent `ahead` before its time.
    this.#clock.heard(rows.at(-1).time - this.#ahead, performance.now() / 1000);
    this.#play();
  }

  #play() {
    clearTimeout(this.#timer);
    const now = performance.now() / 1000 - this.#clock.offset;
    while (this.#frames.length && this.#frames[0].time <= now) {
      const frame = this.#frames.shift();
      this.#next = frame.frame + 1;
      this.#take(frame);
    }
    if (this.#frames.length) this.#timer = setTimeout(() => this.#play(), 1000 * (this.#frames[0].time - now));
  }
}

const DRIFT = 0.02; // s; the anchor moves only in silence, and only by more than this

/** Plays 20 ms packets without gaps. While it runs, the audio clock determines what is shown. */
export class Sound {
  /** Samples a second, for `subscribe`. */
  rate = 22050;
  /** Whether it was started and not muted. */
  on = false;

  constructor(clock) {
    this.clock = clock;
    this.context = null;
    this.anchor = null; // audio time minus session time
    this.playing = new Map(); // source -> session time
  }

  /** Start sound. Browsers allow it only after a gesture: call it from one. */
  start() {
    // A context at the packets' own rate: resampling each packet separately would click at its ends.
    this.context ??= new AudioContext({ sampleRate: this.rate, latencyHint: "interactive" });
    this.context.resume();
    this.on = true;
  }

  /** Be silent until `start`. */
  mute() {
    this.on = false;
    this.forget(-Infinity);
    this.context?.suspend();
  }

  /** Start again, as after a new connection. */
  reset() {
    this.forget(-Infinity);
    this.anchor = null;
  }

  /** Whether sound can be heard now. */
  get running() {
    return this.on && this.context?.state === "running";
  }

  /** Play a packet of the stream `audio`. */
  packet(time, samples, forget) {
    if (forget) this.forget(time);
    if (!this.running || !samples.length) return;
    this.align();
    if (this.anchor === null) return;
    const start = this.anchor + time;
    if (start < this.context.currentTime) return; // too late to play
    const buffer = this.context.createBuffer(1, samples.length, this.rate);
    const channel = buffer.getChannelData(0);
    for (let i = 0; i < samples.length; i++) channel[i] = samples[i] / 32768;
    const source = new AudioBufferSourceNode(this.context, { buffer });
    source.connect(this.context.destination);
    source.onended = () => this.playing.delete(source);
    source.start(start);
    this.playing.set(source, time);
  }

  /** Cancel the sound from a session time on. */
  forget(time) {
    for (const [source, start] of this.playing) {
      if (start < time) continue;
      source.stop();
      this.playing.delete(source);
    }
  }

  /** The session time that is audible now; null if sound is off: then use the Clock. */
  playhead() {
    if (!this.running) return null;
    this.align();
    return this.anchor === null ? null : this.context.currentTime - this.anchor - (this.context.outputLatency || 0);
  }

  align() {
    const target = this.clock.playhead(performance.now() / 1000);
    if (target === null || this.playing.size) return;
    const anchor = this.context.currentTime - target;
    if (this.anchor !== null && Math.abs(anchor - this.anchor) < DRIFT) return;
    // On the sample grid, so that packets join without a click.
    this.anchor = Math.round(anchor * this.rate) / this.rate;
  }
}
