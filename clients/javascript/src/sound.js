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
