import { ANSWERS, JSON_STREAMS, RealizerError, VERSION, frameOf, jsonFrameOf } from "./frames.js";
import { WebSocket, parseXml } from "#platform";
import { Playout } from "./playout.js";
import { Speech } from "./speech.js";
import { Voice, rateOf, samplesOf, timed } from "./voice.js";
import { Waiters, blocksOf } from "./waiters.js";

const AHEAD = 0.2; // s; frames that are sent so long before their time survive most delays
export const BMLA = "http://www.asap-project.org/bmla"; // namespace of the states of blocks
const OWN = "urn:bml-realizer:1";
const MARK = /^(ask-\d+|alive)$/; // ids of pings behind messages without an answer, and of those to a silent service
const RETRY = [0.3, 0.6, 1.2, 2.5, 5]; // s, times 0.5 to 1.5, so that the clients of a service do not return all at once
const PATIENCE = 10; // s for the first message of a connection
const SILENCE = 15; // s without a message, after which the service is asked; it is lost after twice as long without an answer
const nothing = () => {};
const timeOf = (element) => Number(element.getAttribute("globalTime"));
const over = () => new RealizerError("the connection was closed");
const FINAL = 1008; // close code of refusals that another try does not mend
/** Return a rejected promise that need not be handled. */
const rejected = (error) => {
  const promise = Promise.reject(error);
  promise.catch(nothing);
  return promise;
};
const madeId = () => `say-${crypto.getRandomValues(new Uint32Array(1))}`;
const keyOf = ({ stream, character, view }) => JSON.stringify([stream, character ?? "", view ?? ""]);

/**
 * A connection that is restored automatically, with the feedback it missed and its streams.
 *
 * Handlers, as of a WebSocket:
 *   onopen()                    connected or reconnected
 *   onlost(error)               disconnected; a new connection is tried, unless there is an error: then the service refuses
 *                               the token, the session or the version
 *   onfeedback(element, seq)    BML feedback, as an XML element
 *   onwarning(warning)          a warning about a document, or a block of which nothing was heard or moved though something
 *                               was asked for: { id, type, text }. By default it is written to the console
 *   onreply(message)            every JSON message that is not a frame: welcome, subscribed, state, error, ...
 *   onframe(frame)              every frame of every stream, see `frameOf`; its `streamInfo` has the fields of the last
 *                               `subscribed` or `changed` of its stream, such as face, scale and offset of a mesh
 */
export class Realizer {
  onopen = nothing;
  onlost = nothing;
  onfeedback = nothing;
  onwarning = ({ id, type, text }) => console.warn(`realizer: ${id}: ${type ? `${type}: ` : ""}${text}`);
  onreply = nothing;
  onframe = nothing;
  /** seq of the newest feedback; null before the first. */
  seen = null;
  /** The current WebSocket. */
  socket = null;
  #current = null; // the WebSocket, until it is closed here
  #opening = null; // the promise of `connect`
  #fail = nothing; // rejects it
  #retry = null; // timer of the next try
  #watch = null; // timer that looks whether the service is silent
  #token;
  #tries = 0;
  #closed = false;
  #asked = []; // { message, mark, isSent, resolve, reject } of requests without an answer; mark: id of the ping behind it
  #marks = 0;
  // stream, character and view -> { message, take, streamInfo: fields of `subscribed`, playout: with `ahead` }
  #streams = new Map();
  #leftOut = {}; // stream -> count
  #unsent = []; // documents to send once the connection is open
  #waiters = new Waiters();
  #connection = null; // its number in `welcome`
  #welcomed = nothing; // called with the first message of the connection
  #refusal = null; // why the service does not let it in
  #over = over; // () => why nothing is sent any more

  /**
   * @param {object} [options]
   * @param {string} [options.url] of the service's WebSocket; default: the service that this file comes from
   * @param {string} [options.token] the access token, if the service requires one
   * @param {string} [options.session] name of the session to join or create; default: a new, random name
   */
  constructor({ url, session, token } = {}) {
    this.url = new URL(url ?? new URL("ws", import.meta.url));
    if (this.url.protocol === "file:") throw new TypeError("wanted the url of a service, such as ws://127.0.0.1:8765/ws, got none");
    if (this.url.protocol.startsWith("http")) this.url.protocol = this.url.protocol.replace("http", "ws");
    this.#token = token ? { token } : {}; // in `hello`, because addresses are logged
    this.session = session ?? `js-${crypto.getRandomValues(new Uint32Array(2)).join("-")}`;
  }

  /** Whether the connection is open. */
  get open() {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  /**
   * Connect, and reconnect until `close`. Requests made before the connection is open are sent then.
   * @returns {Promise<void>} resolves when the connection is open; rejects if the first attempt fails, though more
   *   follow, unless the service refuses the token (the code of the error is "token"), the session or the version
   */
  connect() {
    if (this.#current?.readyState <= WebSocket.OPEN) return this.#opening;
    clearTimeout(this.#retry);
    this.#closed = false;
    this.#refusal = null;
    this.#over = over;
    globalThis.addEventListener?.("online", this.#online);
    this.#opening = new Promise((resolve, reject) => this.#open(resolve, reject));
    this.#opening.catch(nothing);
    return this.#opening;
  }

  /** Try again at once, because there is a network again. */
  #online = () => {
    if (this.#retry === null || this.#closed) return;
    clearTimeout(this.#retry);
    this.#open();
  };

  #open(resolve = nothing, reject = nothing) {
    this.#retry = null;
    this.#fail = reject;
    const url = new URL(this.url);
    url.searchParams.set("session", this.session);
    if (this.seen !== null) url.searchParams.set("seen", this.seen);
    const socket = (this.socket = this.#current = new WebSocket(url));
    let wasOpen = false;
    let heard = performance.now();
    socket.binaryType = "arraybuffer";
    const patience = setTimeout(() => this.#drop(socket), 1000 * PATIENCE);
    clearInterval(this.#watch);
    this.#watch = setInterval(() => {
      const silent = (performance.now() - heard) / 1000;
      if (silent > 3 * SILENCE) this.#drop(socket);
      else if (silent > SILENCE) this.#post({ type: "ping", id: "alive" });
    }, 1000 * SILENCE);
    this.#watch.unref?.();
    this.#welcomed = () => {
      clearTimeout(patience);
      this.#welcomed = nothing;
      this.#tries = 0;
      resolve();
      this.onopen();
    };
    socket.onopen = () => {
      if (this.#current !== socket) return; // an older one, after `close` and `connect`
      wasOpen = true;
      this.#post({ type: "hello", version: VERSION, ...this.#token });
      for (const { message, playout } of this.#streams.values()) {
        playout?.reset();
        this.#post(message);
      }
      for (const asked of this.#asked) if (asked.message.type !== "subscribe") this.#request(asked);
      for (const text of this.#unsent.splice(0)) this.send(text);
    };
    socket.onmessage = (event) => {
      if (this.#current !== socket) return;
      heard = performance.now();
      this.#receive(event.data);
    };
    socket.onerror = nothing; // `onclose` follows
    socket.onclose = ({ code, reason }) => {
      clearTimeout(patience);
      if (this.#current !== socket) return;
      clearInterval(this.#watch);
      // What comes later waits for the next connection, and is not interrupted.
      if (wasOpen) this.#waiters.interrupt();
      const lost = this.#asked.filter(({ mark, isSent }) => mark && isSent);
      this.#asked = this.#asked.filter((asked) => !lost.includes(asked));
      for (const asked of lost) asked.reject(new RealizerError("the connection was lost"));
      const refusal = this.#refusal ?? socket.refusal ?? (code === FINAL ? new RealizerError(reason, "token") : null);
      reject(refusal ?? new RealizerError(`no connection to ${this.url.origin}${reason ? `: ${reason}` : ""}`));
      if (this.#closed) return;
      if (refusal) this.#end(() => refusal);
      this.onlost(refusal);
      if (refusal) return;
      const pause = RETRY[Math.min(this.#tries++, RETRY.length - 1)] * (0.5 + Math.random());
      this.#retry = setTimeout(() => this.#closed || this.#open(), 1000 * pause);
    };
  }

  /** Give up a connection that does not answer, as if it had been lost. */
  #drop(socket) {
    socket.onclose({ code: 1006, reason: "the service does not answer" });
    socket.onclose = socket.onmessage = socket.onopen = nothing;
    socket.close();
  }

  /** Close the connection; pending promises and those of later calls are rejected. */
  close() {
    this.#current = null; // what still comes of the socket is ignored
    clearTimeout(this.#retry);
    clearInterval(this.#watch);
    globalThis.removeEventListener?.("online", this.#online);
    this.#retry = null;
    this.socket?.close();
    this.#fail(over());
    this.#end(over);
  }

  #end(reason) {
    this.#closed = true;
    this.#over = reason;
    for (const { reject } of this.#asked) reject(reason());
    this.#waiters.abandon(reason);
    this.#asked = [];
    this.#unsent = [];
  }

  /** Send BML, one or more documents. It is lost if the connection is not open. */
  send(text) {
    if (this.open) this.socket.send(text);
  }

  /**
   * Send a control message, such as { type: "state" }.
   * @returns {Promise<object|null>} the answer; null for messages without one, once the service has taken them. Rejects
   *   with a RealizerError if the service refuses it; this need not be handled, as `onreply` gets the error too.
   */
  ask(message) {
    if (this.#closed) return rejected(this.#over());
    // The service answers in order: the pong comes after an error about the message.
    const asked = { message, mark: message.type in ANSWERS ? null : `ask-${this.#marks++}` };
    const answer = new Promise((resolve, reject) => this.#asked.push(Object.assign(asked, { resolve, reject })));
    answer.catch(nothing);
    this.#request(asked);
    return answer;
  }

  #request(asked) {
    asked.isSent = this.open;
    this.#post(asked.message);
    if (asked.mark) this.#post({ type: "ping", id: asked.mark });
  }

  /**
   * Subscribe to a stream, also after a reconnect.
   * @param {string} stream its name in the table of docs/protocol.md
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
    const leaveOut = (count) => (this.#leftOut[stream] = (this.#leftOut[stream] ?? 0) + count);
    const playout = options.ahead > 0 ? new Playout(options.ahead, pass, leaveOut) : null;
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

  /** Subscribe to the vertices of a face, as int16. */
  mesh(options = {}, take = nothing) {
    return this.subscribe("mesh", options, take);
  }

  /** Subscribe to pictures, as files. */
  pictures(options = {}, take = nothing) {
    return this.subscribe("video", options, take);
  }

  /** Subscribe to sound: packets of 20 ms, mono int16. */
  sound(options = {}, take = nothing) {
    return this.subscribe("audio", options, take);
  }

  /** Stream -> number of frames that were long past and left out, because the page stood still or was too slow. */
  get leftOut() {
    return { ...this.#leftOut };
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
   * @returns {Promise<Element>} the feedback of the end, with `warnings`, [{ id, type, text }, ...], about the block, and
   *   `shown`: false if nothing was heard or moved though something was asked for. Rejects if the block is refused
   */
  play(text) {
    const isControl = /^[\s\ufeff]*\{/.test(text);
    const blocks = isControl ? [] : blocksOf(text);
    // The service answers every other text.
    const got = isControl ? "a control message, which `ask` sends" : "nothing";
    if (!blocks.length) return rejected(new RealizerError(`wanted <bml>, got ${got}`, "refused"));
    if (this.#closed) return rejected(this.#over());
    const ends = blocks.map((block) => this.#waiters.add({ ...block, isSent: true, message: blocks }));
    this.#later(text);
    return ends.at(-1);
  }

  /** Send a message as soon as the connection is open. */
  #later(message) {
    if (this.open) this.send(message);
    else if (!this.#closed) this.#unsent.push(message);
  }

  /**
   * Play a clip of any other voice, with lips.
   * @param {Int16Array|Float32Array|ArrayBuffer|Uint8Array} sound PCM if there is a `rate`, else a WAV, FLAC, MP3, Ogg
   *   or WebM file
   * @param {object} [options] rate: samples a second of PCM. text: the words as plain text. words: [[seconds, word],
   *   ...] or [{ start, end, text }, ...]. phonemes, visemes: [[start, end, name], ...]. Without any, lips are read from
   *   the sound. onword: called with each word, and its `time` on the session clock, when it is spoken. visemeSet,
   *   language, character, composition: as in the message `speech`
   * @returns {Promise<Element>} the feedback of the end, as of `play`; rejects if the sound is refused
   */
  say(sound, { rate, text, words, phonemes, visemes, visemeSet, onword, ...opening } = {}) {
    let pcm, description;
    try {
      if (rate !== undefined) pcm = samplesOf(sound);
      else if (sound instanceof ArrayBuffer) pcm = new Uint8Array(sound);
      else if (sound instanceof Uint8Array) pcm = sound;
      else throw new TypeError("sound: wanted the bytes of a file, or samples and their `rate`");
      const times = Object.entries({ words, phonemes, visemes }).filter(([, items]) => items);
      description = Object.fromEntries(times.map(([name, items]) => [name, timed(name, items)]));
      if (rate !== undefined) rateOf(rate);
    } catch (error) {
      return Promise.reject(error);
    }
    if (text !== undefined) description.text = text;
    if (visemeSet !== undefined) description.viseme_set = visemeSet;
    const voice = this.#voice(rate ?? 1, opening, onword);
    voice.expect(description.words ?? []);
    voice.clip(pcm, rate ?? 0, description);
    voice.close();
    return voice.ended();
  }

  /**
   * Speak a text. Markdown, stage directions, emoji and numbers are read as people mean them, SSML and behaviours as what they are.
   * @param {string} text
   * @param {object} [options] id of the block; language, character, composition, and plain for a text without all that, as in the message `speech`
   * @returns {Promise<Element>} its end; rejects if it is refused
   */
  async speak(text, { id, ...opening } = {}) {
    const speech = this.speech(id, opening);
    await speech.append(text);
    speech.close();
    return speech.ended();
  }

  /**
   * Open a speech whose text is sent as it comes.
   * @param {string} [id] of the speech and of its block: a letter or _, then up to 63 letters, digits, - and _. Other blocks refer to a sync of its text as `ID:ID:sync`
   * @param {object} [opening] language, character, composition: as in the message `speech`
   * @returns {Speech}
   */
  speech(id = madeId(), opening = {}) {
    const speech = new Speech(id, opening, (message) => this.#later(message), this.#ended(id, () => speech));
    return speech;
  }

  /** End blocks gracefully: those of the ids, or all. Rejects, after stopping the others, if one is unknown. */
  stop(...blocks) {
    return this.ask({ type: "stop", ...(blocks.length ? { blocks } : {}) });
  }

  /**
   * Open a speech of any other voice whose sound comes in parts.
   * @param {object} options rate: samples a second. onword: as of `say`. id of the speech and of its block, language,
   *   character, composition: as in the message `speech`
   * @returns {Voice}
   */
  voice({ rate, onword, ...opening } = {}) {
    return this.#voice(rate, opening, onword);
  }

  #voice(rate, { id = madeId(), ...opening }, onword = nothing) {
    rateOf(rate); // before anything waits for the speech
    const voice = new Voice(rate, id, opening, (message) => this.#later(message), this.#ended(id, () => voice));
    voice.onword = onword;
    return voice;
  }

  /** Wait for the end of a block that was sent. An id that nobody sends is waited for until the connection is closed. */
  ended(id) {
    return this.#ended(id);
  }

  #ended(id, speech = null) {
    return this.#closed ? rejected(this.#over()) : this.#waiters.add({ ids: [id], speech, isSent: Boolean(speech) });
  }

  #post(message) {
    this.send(JSON.stringify(message));
  }

  #receive(data) {
    if (data instanceof ArrayBuffer) return this.#frame(frameOf(data));
    if (!data.startsWith("{")) return this.#feedback(data);
    const message = JSON.parse(data);
    if (JSON_STREAMS.includes(message.type)) return this.#frame(jsonFrameOf(message));
    if (message.type === "welcome") {
      this.#connection = message.connection;
      this.#welcomed();
    } else if (message.type === "gap") this.#gap(message);
    if (message.type === "subscribed" || message.type === "changed") {
      const stream = this.#streams.get(keyOf(message));
      if (stream) stream.streamInfo = { ...stream.streamInfo, ...message };
    }
    if (message.type === "error" && this.#welcomed !== nothing && message.where?.startsWith("hello.")) {
      this.#refusal = new RealizerError(message.message, message.code, message.where);
      this.socket.close();
    }
    if (message.type === "error" && /^(speech(?!\.append)\b|clip:)/.test(message.where)) this.#refuse(message);
    this.#answer(message);
    if (message.type !== "pong" || !MARK.test(message.id)) this.onreply(message);
  }

  /** Some feedback is not available. Without any that was seen, this is a new session of the same name. */
  #gap({ seen, first }) {
    this.seen = null;
    if (seen < first) return;
    const other = (id) => new RealizerError(`${id}: the session has ended; this is another one of its name`, "gap", id);
    this.#waiters.abandon(other, { interrupted: true });
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
    const { type, id, where = "" } = message;
    const fits = ({ message: asked, mark }) => {
      if (where === "type") return message.message.endsWith(`got ${JSON.stringify(asked.type)}`);
      if (type === "error") return where.split(".")[0] === asked.type && (id ?? asked.id) === asked.id; // ids of speeches
      if (mark || type === "pong") return type === "pong" && id === (mark ?? asked.id);
      return ANSWERS[asked.type] === type && (type !== "subscribed" || keyOf(asked) === keyOf(message));
    };
    const k = this.#asked.findIndex(fits);
    if (k < 0) return;
    const [{ mark, resolve, reject }] = this.#asked.splice(k, 1);
    if (type === "error") reject(new RealizerError(message.message, message.code, message.where));
    else resolve(mark ? null : message);
  }

  /** Reject what waits for a speech whose message or clip (named SPEECH-NUMBER) the service has refused. */
  #refuse({ id, where, code, message }) {
    const speech = id ?? where.replace(/^clip:|-\d+$/g, "");
    if (this.#waiters.fail(speech, new RealizerError(message, code, where))) this.#post({ type: "speech", id: speech, close: true });
  }

  #feedback(text) {
    const element = parseXml(text);
    const seq = Number(Array.from(element.attributes).find((a) => a.localName === "seq")?.value);
    if (seq) this.seen = seq;
    const id = element.getAttribute("id");
    if (element.localName === "predictionFeedback") {
      for (const block of Array.from(element.getElementsByTagName("bml"))) {
        const isNew = block.getAttributeNS(BMLA, "status") === "IN_PREP";
        this.#waiters[isNew ? "acknowledge" : "plan"](block.getAttribute("id"));
      }
    } else if (element.localName === "blockProgress" && id.endsWith(":end")) {
      element.shown = element.getAttributeNS(OWN, "shown") !== "false";
      if (!element.shown) this.onwarning({ id: id.slice(0, -4), type: "", text: "nothing of it was heard or moved" });
      this.#waiters.end(id.slice(0, -4), element);
    } else if (element.localName === "blockProgress") this.#waiters.start(id.slice(0, -6), timeOf(element));
    else if (element.localName === "syncPointProgress") {
      const [, speech, behaviour, sync] = id.match(/^([^:]*)\.[^.:]*:([^:]*):(.*)$/) ?? []; // in blocks speech.1, speech.2, ...
      if (behaviour === speech) this.#waiters.reach(speech, sync, timeOf(element));
    }
    else if (element.localName === "warningFeedback") {
      const warning = { id, type: element.getAttribute("type"), text: element.textContent };
      this.onwarning(warning);
      const sender = element.getAttributeNS(OWN, "inUseFor"); // of the block; other clients get the warning too
      if (!sender || Number(sender) === this.#connection) this.#waiters.warn(warning);
      if (!sender || Number(sender) === this.#connection) this.#waiters.refuse(id, element.textContent, Boolean(sender));
    }
    this.onfeedback(element, seq);
  }
}
