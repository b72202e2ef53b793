// 20 ms packets to gapless sound. While it runs, the audio clock is the master of what is shown.

const DRIFT = 0.02; // s; the anchor moves only in silence, and only by more than this

export class Sound {
  constructor(clock) {
    this.clock = clock;
    this.rate = 22050;
    this.context = null;
    this.anchor = null; // audio time minus session time
    this.playing = new Map(); // source -> session time
    this.on = false;
  }

  // Browsers allow sound only after a gesture: call it from one.
  start() {
    // A context at the packets' own rate: each packet resampled by itself would click at its ends.
    this.context ??= new AudioContext({ sampleRate: this.rate, latencyHint: "interactive" });
    this.context.resume();
    this.on = true;
  }

  mute() {
    this.on = false;
    this.forget(-Infinity);
    this.context?.suspend();
  }

  reset() {
    this.forget(-Infinity);
    this.anchor = null;
  }

  get running() {
    return this.on && this.context?.state === "running";
  }

  packet(time, samples, forget) {
    if (forget) this.forget(time);
    if (!this.running || !samples.length) return;
    this.align();
    if (this.anchor === null) return;
    const start = this.anchor + time;
    if (start < this.context.currentTime) return; // too late to be heard
    const buffer = this.context.createBuffer(1, samples.length, this.rate);
    const channel = buffer.getChannelData(0);
    for (let i = 0; i < samples.length; i++) channel[i] = samples[i] / 32768;
    const source = new AudioBufferSourceNode(this.context, { buffer });
    source.connect(this.context.destination);
    source.onended = () => this.playing.delete(source);
    source.start(start);
    this.playing.set(source, time);
  }

  forget(time) {
    for (const [source, start] of this.playing) {
      if (start < time) continue;
      source.stop();
      this.playing.delete(source);
    }
  }

  // The session time that is heard now; null where sound is off, and the page's own clock counts.
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
    // On the sample grid, so that packets join without a seam.
    this.anchor = Math.round(anchor * this.rate) / this.rate;
  }
}
