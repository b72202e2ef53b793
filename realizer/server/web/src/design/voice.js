// The sound of what is said, in step with the preview; it is heard while sound is on.
import { bytesOf } from "./preview.js";

const GRAIN = 0.12; // s, heard at each step of a scrub

export class Voice {
  // ask(request): the service's answer. sound: the page's; recorder: films what is heard.
  constructor(ask, sound, recorder) {
    Object.assign(this, { ask, sound, recorder, buffer: null, says: null, source: null });
  }

  // Make sound of [[start, text]]; none where the voice is silent.
  async load(says) {
    if (says === this.says) return;
    Object.assign(this, { says, buffer: null });
    this.stop();
    const { rate, data } = says.length ? await this.ask({ tool: "sound", says }) : { data: "" };
    if (says !== this.says || !data) return;
    const samples = Float32Array.from(new Int16Array(bytesOf(data)), (value) => value / 32768);
    this.buffer = new AudioBuffer({ length: samples.length, sampleRate: rate });
    this.buffer.copyToChannel(samples, 0);
  }

  get duration() {
    return this.buffer?.duration ?? 0;
  }

  // Play from a time on, for `seconds` or to the end.
  play(time, seconds) {
    this.stop();
    if (!this.buffer || !this.sound.running || time >= this.duration) return;
    const { context } = this.sound;
    this.source = new AudioBufferSourceNode(context, { buffer: this.buffer });
    this.source.connect(context.destination);
    if (this.recorder.heard) this.source.connect(this.recorder.heard);
    this.origin = context.currentTime - time;
    this.source.start(0, time, seconds);
  }

  stop() {
    this.source?.stop();
    this.source = null;
  }

  // A moment of the sound at a time.
  scrub(time) {
    this.play(time, GRAIN);
  }

  // The time that is heard now; null: none.
  get time() {
    const { context, running } = this.sound;
    return this.source && running ? context.currentTime - this.origin - (context.outputLatency || 0) : null;
  }
}
