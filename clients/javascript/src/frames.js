// Messages of the protocol: binary and JSON frames, and errors.

// protocol: written by python -m tests.protocol
/** Version of the protocol; a service that speaks another one refuses `hello`. */
export const VERSION = 1;
const HEADER = 16; // bytes: u8 kind, u8 version, u16 flags, u32 frame, f64 time
const FORGET = 0x100; // flag: forget everything from this time on
const LAST = 0x200; // flag: the last piece of a clip
const SOUND = 4; // kind of a clip
const PICTURE = 3; // kind of a picture
const KINDS = {
  1: ["fap", Int32Array],
  2: ["au", Float32Array],
  3: ["video", Uint8Array],
  4: ["audio", Int16Array],
  5: ["mesh", Int16Array],
  6: ["arkit", Float32Array],
};
export const JSON_STREAMS = ["fap", "au", "arkit", "schedule"];
export const ANSWERS = { hello: "welcome", subscribe: "subscribed", save: "saved", state: "state", ping: "pong" };
// end of protocol

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

/** Return a message of `size` bytes behind its header, and a view of it. */
function headed(kind, flags, number, size) {
  const message = new Uint8Array(HEADER + size);
  const view = new DataView(message.buffer);
  view.setUint8(0, kind);
  view.setUint8(1, VERSION);
  view.setUint16(2, flags, true);
  view.setUint32(4, number, true);
  return [message, view];
}

/** Encode a picture for `track`: the bytes of its file, and a number of your own. */
export function packPicture(number, file) {
  const [message] = headed(PICTURE, 0, number, file.length);
  message.set(file, HEADER);
  return message;
}

/** Encode a piece of a sound clip; `rate` 0: the pieces are a sound file. */
export function packClip({ id, number, rate, sound, final }) {
  const name = new TextEncoder().encode(id);
  const [message, view] = headed(SOUND, final ? LAST : 0, number, 5 + name.length + sound.length);
  view.setUint32(HEADER, rate, true);
  view.setUint8(HEADER + 4, name.length);
  message.set(name, HEADER + 5);
  message.set(sound, HEADER + 5 + name.length);
  return message;
}

export function jsonFrameOf(message) {
  return { stream: message.type, ...message, forget: Boolean(message.flush), values: () => message.values ?? [] };
}

/** Split a frame of a stream with `ahead` into frames of one row. */
export function rowsOf(frame) {
  const { fps, names } = frame.streamInfo;
  const values = frame.values();
  const rows = frame.kind === undefined ? values : Array.from({ length: values.length / names.length }, (_, k) => values.subarray(k * names.length, (k + 1) * names.length));
  return rows.map((row, k) => ({ ...frame, frame: frame.frame + k, time: (frame.frame + k) / fps, forget: false, values: () => row }));
}
