import { rowsOf } from "./frames.js";

/** Delay of what is shown behind the newest data, in seconds, so that late packets are not missed. */
export const DELAY = 0.1;
const MEMORY = 5; // s
const GAP = 0.5; // s without a frame, in which the page stood still: what it knew of the clock is no older
const CATCH_UP = 0.01; // s for which frames long past wait for newer ones
const LATE = 0.2; // s; of frames that are due for longer only the newest one is passed on

/** An estimate of the session clock: the frame with the least delay determines the offset. */
export class Clock {
  constructor() {
    this.reset();
  }

  /** Start again, as after a new connection. */
  reset() {
    this.offsets = [];
    this.offset = null;
    this.last = Infinity;
  }

  /** Note that a frame of session time `time` arrived at `here`, both in seconds, on any local clock. */
  heard(time, here) {
    const offset = here - time;
    const gap = here - this.last;
    if (gap > GAP) this.offsets = this.offsets.map((known) => ({ ...known, here: known.here + gap }));
    this.last = here;
    while (this.offsets.length && this.offsets[0].here < here - MEMORY) this.offsets.shift();
    while (this.offsets.length && this.offsets.at(-1).offset >= offset) this.offsets.pop();
    this.offsets.push({ here, offset });
    this.offset = this.offsets[0].offset;
  }

  /** The session time to show and play at `here`; null before the first frame. */
  playhead(here) {
    return this.offset === null ? null : here - this.offset - DELAY;
  }
}

/**
 * Passes on frames that arrive up to `ahead` seconds early, each at its time, and drops those that were taken back. Of frames
 * long past it passes on the newest one; `leaveOut` is called with the number of the others.
 */
export class Playout {
  #ahead;
  #take;
  #leaveOut;
  #clock = new Clock();
  #frames = [];
  #next = 0; // number of the first frame that was not passed on
  #timer = null;
  #catchesUp = false;

  constructor(ahead, take, leaveOut = () => {}) {
    this.#ahead = ahead;
    this.#leaveOut = leaveOut;
    this.#take = take;
  }

  /** Drop everything, as after a new connection. */
  reset() {
    clearTimeout(this.#timer);
    this.#clock.reset();
    this.#frames = [];
    this.#next = 0;
  }

  /** Add the rows of a frame, instead of those from its first one on. */
  add(frame) {
    const rows = rowsOf(frame);
    this.#frames = this.#frames.filter((old) => old.frame < frame.frame);
    this.#frames.push(...rows.filter((row) => row.frame >= this.#next));
    // The last row of a message is sent `ahead` before its time.
    const here = performance.now() / 1000;
    this.#clock.heard(rows.at(-1).time - this.#ahead, here);
    // Of frames long past, more may be on their way.
    const isLate = this.#frames[0]?.time < here - this.#clock.offset - LATE;
    if (!isLate) this.#play();
    else if (!this.#catchesUp) {
      clearTimeout(this.#timer);
      this.#timer = setTimeout(() => this.#play(), 1000 * CATCH_UP);
    }
    this.#catchesUp = isLate;
  }

  #play() {
    clearTimeout(this.#timer);
    this.#catchesUp = false;
    const now = performance.now() / 1000 - this.#clock.offset;
    if (this.#frames[0]?.time < now - LATE) {
      const newest = this.#frames.findLastIndex(({ time }) => time <= now);
      if (newest) this.#leaveOut(newest);
      this.#frames.splice(0, newest);
    }
    while (this.#frames.length && this.#frames[0].time <= now) {
      const frame = this.#frames.shift();
      this.#next = frame.frame + 1;
      this.#take(frame);
    }
    if (this.#frames.length) this.#timer = setTimeout(() => this.#play(), 1000 * (this.#frames[0].time - now));
  }
}
