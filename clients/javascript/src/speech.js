// Speech that is sent in parts, as its text or its sound is produced.
import { RealizerError } from "./frames.js";

const LONGEST = /[^]{1,20000}/gu; // characters of one message
// Text that follows sooner goes with the next message: a service limits the rate of messages.
const PAUSE = 10; // ms
const nothing = () => {};

/** A speech of an open connection; `Realizer.speech` and `Realizer.voice` open one. */
export class OpenSpeech {
  /** Whether its last message was sent. */
  closing = false;
  /** When the speech started and its syncs were spoken, in seconds on the session clock. */
  progress = { start: null, points: {} };
  #send; // sends text or bytes
  #opening; // fields of the first message
  #ended;
  #isSent = false;

  /**
   * @param {string} id of the speech and of its block
   * @param {object} opening composition, character, language of the message `speech`
   * @param {Promise<Element>} ended
   */
  constructor(id, opening, send, ended) {
    this.id = id;
    this.#opening = opening;
    this.#send = send;
    this.#ended = ended;
  }

  /** Stop speaking at once. */
  stop() {
    if (!this.#isSent) this.post({ append: "" }); // the service cannot stop what it does not know
    this.#send(JSON.stringify({ type: "stop", blocks: [this.id] }));
    this.finish();
  }

  /** Wait for the end: resolves with its feedback, which has `said` if it was interrupted; rejects if it is refused. */
  ended() {
    return this.#ended;
  }

  /** Send the last message. The service ignores what has the id of a speech that was cut off until then. */
  finish() {
    if (!this.closing) this.post({ close: true });
    this.closing = true;
  }

  /** Send the fields of a message `speech`. */
  post(fields) {
    this.send(JSON.stringify({ type: "speech", id: this.id, ...this.#opening, ...fields }));
    this.#opening = {};
    this.#isSent = true;
  }

  send(message) {
    this.#send(message);
  }
}

/** A speech whose text is sent as it comes. */
export class Speech extends OpenSpeech {
  #unsent = "";
  #pause = null; // after a message, in which text waits
  #points = []; // [sync, resolve]
  #over = false; // whether it was stopped, or has ended
  #fault = null;

  constructor(...fields) {
    super(...fields);
    const end = () => {
      this.#over = true;
      this.finish();
    };
    this.ended().then(end, (error) => (this.#fault = error));
  }

  /**
   * Append text, which may contain <sync id="m"/>, SSML and behaviours; whole sentences are spoken. It is sent at once, or a
   * moment after the last message. What follows the end of a speech that was cut off is ignored.
   * @returns {Promise<void>} rejects if the speech was closed or refused
   */
  async append(text) {
    if (this.#fault) throw this.#fault;
    if (this.#over) return;
    if (this.closing) throw new RealizerError(`the speech ${this.id} is closed: nothing can follow`, "refused");
    this.#unsent += text;
    if (this.#pause === null) this.#flush();
  }

  /** End the speech; what was appended is spoken. Closing again does nothing. */
  close() {
    if (this.closing || this.#fault) return;
    this.#flush();
    clearTimeout(this.#pause);
    this.finish();
  }

  stop() {
    this.#over = true;
    clearTimeout(this.#pause);
    super.stop();
  }

  /**
   * Wait until a sync of the text is spoken.
   * @returns {Promise<number>} when, in seconds on the session clock; rejects if the speech ends without it, or is refused
   */
  until(sync) {
    const spoken = new Promise((resolve, reject) => {
      if (sync in this.progress.points) return resolve(this.progress.points[sync]);
      this.#points.push([sync, resolve]);
      this.ended().then(() => reject(new RealizerError(`the speech ${this.id} has ended without a sync ${sync}`, "refused")), reject);
    });
    spoken.catch(nothing); // need not be handled
    return spoken;
  }

  /** Take the time at which a sync was spoken. */
  reach(sync, time) {
    const { points } = this.progress;
    points[sync] ??= time;
    for (const [name, resolve] of this.#points) if (name === sync) resolve(points[sync]);
  }

  #flush() {
    const text = this.#unsent;
    this.#unsent = "";
    this.#pause = null;
    for (const part of text.match(LONGEST) ?? []) this.post({ append: part });
    if (text) this.#pause = setTimeout(() => this.#flush(), PAUSE);
  }
}
