// The session's sound, and the clock that frames are shown by: the sound's where it plays, otherwise ours.

const DELAY = 0.1; // s: packets arrive up to this much ahead, frames wait this long, so that both stay in step

export class Clock {
  constructor() {
    this.offset = null; // session time - performance time, as the fastest message saw it
    this.sound = null;
  }

  // A frame of session time `time` has just come: it cannot have been sent before its time.
  hear(time) {
    const offset = time - performance.now() / 1000;
    // The largest offset is the message with the least delay; it leaks, so that a drifting clock is followed.
    this.offset = this.offset === null ? offset : Math.max(offset, this.offset - 0.0005);
  }

  // Session time that should be on screen now.
  now() {
    if (this.offset === null) return -Infinity;
    return performance.now() / 1000 + this.offset - DELAY;
  }
}

export class Sound {
  constructor(clock, rate) {
    this.clock = clock;
    this.rate = rate;
    this.context = null;
    this.pending = new Set();
  }

  get on() {
    return this.context !== null && this.context.state === "running";
  }

  async toggle() {
    if (this.context === null) this.context = new AudioContext();
    if (this.context.state === "running") await this.context.suspend();
    else await this.context.resume();
    return this.on;
  }

  play(frame) {
    if (frame.forget) this.forget(frame.time);
    if (!this.on) return;
    const pcm = new Int16Array(frame.buffer, frame.offset);
    if (!pcm.length) return;
    const buffer = this.context.createBuffer(1, pcm.length, this.rate);
    const samples = buffer.getChannelData(0);
    for (let i = 0; i < pcm.length; i += 1) samples[i] = pcm[i] / 32768;
    // Packets are placed by their time on one line, so that they join without a seam.
    const line = this.context.currentTime - this.clock.now();
    if (this.line === undefined || Math.abs(line - this.line) > 0.06) this.line = line;
    const at = this.line + frame.time;
    if (at < this.context.currentTime) return;
    const source = this.context.createBufferSource();
    source.buffer = buffer;
    source.connect(this.context.destination);
    source.start(at);
    const entry = { source, time: frame.time };
    this.pending.add(entry);
    source.onended = () => this.pending.delete(entry);
  }

  // Sound from this session time on was taken back.
  forget(time) {
    for (const entry of this.pending) {
      if (entry.time < time) continue;
      entry.source.stop();
      this.pending.delete(entry);
    }
  }
}
