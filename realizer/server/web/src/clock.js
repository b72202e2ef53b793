// The session's clock as seen from here: the frame that came soonest after its time tells the offset.

export const DELAY = 0.1; // s; the jitter buffer: what is shown is this much older than what has come
const MEMORY = 5; // s

export class Clock {
  constructor() {
    this.reset();
  }

  reset() {
    this.offsets = [];
    this.offset = null;
  }

  // A frame of session time `time` came at `here` (both in seconds).
  heard(time, here) {
    const offset = here - time;
    while (this.offsets.length && (this.offsets[0].here < here - MEMORY)) this.offsets.shift();
    while (this.offsets.length && this.offsets.at(-1).offset >= offset) this.offsets.pop();
    this.offsets.push({ here, offset });
    this.offset = this.offsets[0].offset;
  }

  // The session time that should be seen and heard at `here`; null before the first frame.
  playhead(here) {
    return this.offset === null ? null : here - this.offset - DELAY;
  }
}
