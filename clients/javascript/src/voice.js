// Speech of any other voice: sound that is sent in clips, with or without the times of its words.
import { RealizerError, packClip } from "./frames.js";
import { OpenSpeech } from "./speech.js";

const PIECE = 0.2; // s; a clip without words is sent in pieces of this length, the first of which starts the speech
const LONGEST = 1 << 20; // bytes of a message
const LOUDEST = 4; // floats beyond it are not within -1 to 1 and a little too loud, but int16 samples

/** A speech that is sent as sound comes; `Realizer.voice` opens one. */
export class Voice extends OpenSpeech {
  #rate;
  #samples = []; // Int16Arrays that are not sent
  #waiting = 0; // samples in them
  #sent = 0; // samples that are
  #words = []; // { start, text } of the speech that are not sent
  #timed = false; // whether there were any
  #given = []; // all words, and how many of them were spoken
  #spoken = 0;
  /** Called with each word, and its `time` on the session clock, when it is spoken. */
  onword = () => {};
  #clips = 0;
  #closed = false;

  /** @param {number} rate samples a second */
  constructor(rate, ...fields) {
    super(...fields);
    this.#rate = rateOf(rate);
  }

  /**
   * Add mono sound, which begins to be spoken at once. Give the words of a sound before it.
   * @param {Int16Array|Float32Array|ArrayBuffer|Uint8Array} pcm samples; bytes are little-endian int16
   */
  write(pcm) {
    if (this.#closed) throw new RealizerError(`the speech ${this.id} is closed: nothing can follow`, "refused");
    const samples = samplesOf(pcm);
    this.#samples.push(samples);
    this.#waiting += samples.length;
    // A clip with words ends where a word begins, because the end of the last one is not known yet.
    const starts = this.#words.map(({ start }) => Math.round(start * this.#rate) - this.#sent);
    const ready = this.#timed ? (starts.findLast((start) => start <= this.#waiting) ?? 0) : this.#waiting;
    if (ready >= PIECE * this.#rate) this.#flush(ready);
  }

  /**
   * Add words: [[seconds from the start of the speech, word], ...], in order.
   */
  words(words) {
    const added = timed("words", words);
    this.#words.push(...added);
    this.expect(added);
    this.#timed ||= this.#words.length > 0;
  }

  /** Take words of which each is reported when it is spoken. */
  expect(words) {
    this.#given.push(...words);
  }

  /** Take a sync point: the known words of a clip are `word-1`, `word-2`, ... */
  reach(sync, time) {
    if (/^word-\d+$/.test(sync) && this.#spoken < this.#given.length) this.onword({ ...this.#given[this.#spoken++], time });
  }

  /** End the speech; what was written is spoken. Closing again does nothing. */
  close() {
    if (this.#closed) return;
    if (this.#waiting) this.#flush(this.#waiting);
    this.#closed = true;
    this.finish();
  }

  stop() {
    super.stop();
    this.#closed = true;
  }

  /** Send so many samples as a clip, with the words that begin in it. */
  #flush(count) {
    const joined = new Int16Array(this.#waiting);
    let at = 0;
    for (const part of this.#samples) {
      joined.set(part, at);
      at += part.length;
    }
    this.#samples = count < joined.length ? [joined.subarray(count)] : [];
    this.#waiting -= count;
    const begin = this.#sent / this.#rate;
    this.#sent += count;
    const inside = this.#words.filter(({ start }) => Math.round(start * this.#rate) < this.#sent);
    this.#words = this.#words.slice(inside.length);
    const words = inside.map(({ start, text }) => ({ start: Math.max(0, start - begin), text }));
    this.clip(joined.subarray(0, count), this.#rate, words.length ? { words } : {});
  }

  /**
   * Send a clip, and append it to the speech, with the fields of `speech` that describe it. With words before its sound, no
   * mouth shapes are recognised in it. Otherwise the speech follows the first piece: it begins while the rest is on its way.
   */
  clip(sound, rate, description) {
    const id = `${this.id}-${this.#clips++}`;
    const bytes = new Uint8Array(sound.buffer, sound.byteOffset, sound.byteLength);
    const isDescribed = description.text !== undefined || ["words", "phonemes", "visemes"].some((name) => description[name]?.length);
    if (isDescribed) this.post({ clip: id, ...description });
    for (let at = 0, number = 0; at < Math.max(1, bytes.length); at += LONGEST, number++) {
      this.send(packClip({ id, number, rate, sound: bytes.subarray(at, at + LONGEST), final: at + LONGEST >= bytes.length }));
      if (!number && !isDescribed) this.post({ clip: id, ...description });
    }
  }
}

/** Return { start, end?, text } of words, phonemes or visemes that are [seconds, text] or [start, end, text]. */
export function timed(name, items) {
  return Array.from(items, (item, k) => {
    const fields = Array.isArray(item) ? item : [item?.start, item?.end, item?.text];
    const [start, end, text] = fields.length === 2 ? [fields[0], undefined, fields[1]] : fields;
    if (typeof start !== "number" || typeof text !== "string") {
      throw new TypeError(`${name}[${k}]: wanted [seconds, text] or [start, end, text], got ${JSON.stringify(item)}`);
    }
    if (!(start >= 0)) throw new RangeError(`${name}[${k}]: wanted seconds from 0 on, got ${JSON.stringify(item)}`);
    return { start, ...(end === undefined ? {} : { end }), text };
  });
}

/** Return mono samples as Int16Array. */
export function samplesOf(pcm) {
  if (pcm instanceof Int16Array) return pcm;
  if (pcm instanceof Float32Array) {
    const wrong = pcm.find((x) => !(Math.abs(x) <= LOUDEST));
    if (wrong !== undefined) throw new RangeError(`sound: wanted floats from -1 to 1, got ${wrong}`);
    return Int16Array.from(pcm, (x) => Math.round(Math.max(-1, Math.min(1, x)) * 32767));
  }
  const bytes = pcm instanceof ArrayBuffer ? new Uint8Array(pcm) : pcm;
  if (!(bytes instanceof Uint8Array)) throw new TypeError("sound: wanted Int16Array, Float32Array, or bytes of int16 samples");
  if (bytes.length % 2) throw new TypeError(`sound: wanted samples of two bytes, got ${bytes.length} bytes`);
  return new Int16Array(bytes.slice().buffer);
}

export function rateOf(rate) {
  if (!Number.isInteger(rate) || rate <= 0) throw new TypeError(`rate: wanted samples a second, got ${rate}`);
  return rate;
}
