/** Version of the protocol. */
export const VERSION: number;
/** Namespace of the states of blocks in feedback. */
export const BMLA: string;
/** Delay of what is shown behind the newest data, in seconds. */
export const DELAY: number;

/** Why the service refused a message, or why there is no connection. */
export class RealizerError extends Error {
  /** As in the message `error`, such as "token"; "refused" for a block, "connection" for the connection, "gap" for a
   * session that ended while there was none. */
  code: string;
  /** Message type and field, or block. */
  where: string | null;
}

/** What `subscribed` and `changed` say of a stream, such as `names` and `fps`. */
export interface StreamInfo {
  index: number;
  names?: string[];
  fps?: number;
  rate?: number;
  [field: string]: unknown;
}

// protocol: written by python -m tests.protocol
/** A stream whose messages are frames. */
export type StreamName = "fap" | "au" | "arkit" | "mesh" | "audio" | "video" | "schedule";
// end of protocol

/** A frame of a stream; `A` is the array of its values. */
export interface Frame<A = ArrayLike<number>> {
  stream: StreamName;
  /** Number of the binary message; none in JSON. */
  kind?: number;
  /** Index of the character in binary frames, its id in JSON. */
  character: number | string;
  frame: number;
  /** Seconds on the session clock. */
  time: number;
  /** Discard everything from this time on that was sent before. */
  forget: boolean;
  values(): A;
  streamInfo: StreamInfo;
}

export interface SubscribeOptions {
  encoding?: "binary" | "json" | "text";
  fps?: number;
  character?: string;
  /** Seconds before their time that frames are sent, 0 to 2. */
  ahead?: number;
  [field: string]: unknown;
}

/** FAPU; 68 values. */
export type FapFrame = Frame<Int32Array>;
/** 0 to 1. */
export type AuFrame = Frame<Float32Array>;
/** Weights 0 to 1, and rotations. */
export type ArkitFrame = Frame<Float32Array>;
/** The place of each vertex in 65535ths of the face's scale. */
export type MeshFrame = Frame<Int16Array>;
/** Bytes of a JPEG, PNG or WebP file. */
export type PictureFrame = Frame<Uint8Array>;
/** Mono samples. */
export type SoundFrame = Frame<Int16Array>;

export type Pcm = Int16Array | Float32Array | ArrayBuffer | Uint8Array;
/** [seconds, text], [start, end, text] or an object. */
export type Timed = readonly [number, string] | readonly [number, number, string] | { start: number; end?: number; text: string };

/** A warning about a document. */
export interface Warning {
  /** Of a block, or block:behaviour. */
  id: string;
  type: string;
  text: string;
}

/** The feedback of the end of a block. */
export interface BlockEnd extends Element {
  warnings: Warning[];
  /** False if nothing was heard or moved though something was asked for. */
  shown: boolean;
}

/** A word, when it is spoken; `time` is on the session clock. */
export interface SpokenWord {
  start: number;
  end?: number;
  text: string;
  time: number;
}

export interface SpeechOptions {
  language?: string;
  character?: string;
  composition?: "MERGE" | "APPEND" | "REPLACE";
  id?: string;
}

/** Of speech that comes as text. */
export interface TextOptions extends SpeechOptions {
  /** Whether the text has no Markdown, stage directions and the like. */
  plain?: boolean;
}

export interface SayOptions extends SpeechOptions {
  /** Samples a second of PCM; without it the sound is a file. */
  rate?: number;
  text?: string;
  words?: readonly Timed[];
  /** In IPA. */
  phonemes?: readonly Timed[];
  visemes?: readonly Timed[];
  onword?: (word: SpokenWord) => void;
  visemeSet?: "oculus" | "mpeg4" | "sapi" | "polly";
}

/** A speech that is sent in parts. */
declare abstract class OpenSpeech {
  readonly id: string;
  /** When it started and its syncs were spoken, seconds on the session clock. */
  readonly progress: { start: number | null; points: Record<string, number> };
  close(): void;
  stop(): void;
  ended(): Promise<BlockEnd>;
}

/** A speech whose text comes in parts. */
export class Speech extends OpenSpeech {
  append(text: string): Promise<void>;
  until(sync: string): Promise<number>;
}

/** A speech whose sound comes in parts. */
export class Voice extends OpenSpeech {
  onword: (word: SpokenWord) => void;
  write(pcm: Pcm): void;
  words(words: readonly Timed[]): void;
}

export class Realizer {
  constructor(options?: { url?: string | URL; token?: string; session?: string });
  readonly url: URL;
  readonly session: string;
  readonly open: boolean;
  seen: number | null;
  socket: WebSocket | null;
  onopen: () => void;
  onlost: (error: RealizerError | null) => void;
  onfeedback: (element: Element, seq: number) => void;
  onwarning: (warning: Warning) => void;
  onreply: (message: { type: string; [field: string]: unknown }) => void;
  onframe: (frame: Frame) => void;
  connect(): Promise<void>;
  close(): void;
  send(message: string | Uint8Array): void;
  ask(message: { type: string; [field: string]: unknown }): Promise<Record<string, unknown> | null>;
  play(bml: string): Promise<BlockEnd>;
  ended(block: string): Promise<BlockEnd>;
  say(sound: Pcm, options?: SayOptions): Promise<BlockEnd>;
  speak(text: string, options?: TextOptions): Promise<BlockEnd>;
  speech(id?: string, options?: Omit<TextOptions, "id">): Speech;
  stop(...blocks: string[]): Promise<null>;
  voice(options: SpeechOptions & { rate: number; onword?: (word: SpokenWord) => void }): Voice;
  readonly leftOut: Readonly<Record<string, number>>;
  subscribe(stream: StreamName | "feedback", options?: SubscribeOptions, take?: (frame: Frame) => void): Promise<StreamInfo>;
  unsubscribe(stream: string, character?: string, view?: string): void;
  faps(options?: SubscribeOptions, take?: (frame: FapFrame) => void): Promise<StreamInfo>;
  aus(options?: SubscribeOptions, take?: (frame: AuFrame) => void): Promise<StreamInfo>;
  arkit(options?: SubscribeOptions, take?: (frame: ArkitFrame) => void): Promise<StreamInfo>;
  mesh(options?: SubscribeOptions, take?: (frame: MeshFrame) => void): Promise<StreamInfo>;
  pictures(options?: SubscribeOptions, take?: (frame: PictureFrame) => void): Promise<StreamInfo>;
  sound(options?: SubscribeOptions, take?: (frame: SoundFrame) => void): Promise<StreamInfo>;
}

/** Decode a binary message. */
export function frameOf(buffer: ArrayBuffer): Frame;

/** Encode a picture for `track`: the bytes of its file, and a number of your own. */
export function packPicture(number: number, file: Uint8Array): Uint8Array;

/** Whether a text is BML or another document, for `play`, and not words with some markup in them, for `speak`. */
export function isMarkup(text: string): boolean;

/** An estimate of the session clock. */
export class Clock {
  reset(): void;
  heard(time: number, here: number): void;
  playhead(here: number): number | null;
}

/** Plays packets of the stream `audio` in a page. */
export class Sound {
  constructor(clock: Clock);
  rate: number;
  on: boolean;
  readonly running: boolean;
  start(): void;
  mute(): void;
  reset(): void;
  packet(time: number, samples: Int16Array, forget?: boolean): void;
  forget(time: number): void;
  playhead(): number | null;
}

/** Receive the picture and the sound of a session by WebRTC; browsers only. */
export function watch(options: {
  url?: string | URL;
  session: string;
  token?: string;
  size?: string;
  fps?: number | string;
  camera?: string;
  light?: string;
  background?: string;
  character?: string;
  /** How long the browser should hold back picture and sound, in ms; default: as it likes. */
  buffer?: number | string;
}): Promise<{ stream: MediaStream; connection: RTCPeerConnection; close: () => void }>;
