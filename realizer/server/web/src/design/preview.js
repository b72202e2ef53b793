// Frames of the timeline, computed by the service, for the face of the page: at a time, or playing.
const FPS = 25;
const CHUNK = 12; // frames of one request
const KEPT = 600; // frames

export class Preview {
  // ask(request): the service's answer. stage: whose face it is. voice: what is said. ended(): playing has ended.
  constructor(ask, stage, design, voice, ended) {
    Object.assign(this, { ask, stage, design, voice, ended, frames: new Map(), edition: 0, time: 0, began: null, loop: true, single: null });
    design.addEventListener("change", () => this.forget());
  }

  // What is known no longer holds; the picture on the face stays until the next one is there.
  forget() {
    this.edition++;
    this.frames.clear();
    this.single = null;
    this.want(this.time);
  }

  get playing() {
    return this.began !== null;
  }

  // Seconds of what is shown or said.
  get duration() {
    return Math.max(this.design.duration, this.voice.duration);
  }

  play() {
    if (this.time >= this.duration - 1 / FPS) this.time = 0;
    this.began = performance.now() / 1000 - this.time;
    this.voice.play(this.time);
    this.want(this.time);
  }

  pause() {
    if (this.playing) this.voice.stop();
    this.began = null;
  }

  look(time) {
    this.pause();
    this.single = null;
    this.time = Math.max(0, time);
    this.want(this.time);
  }

  // Show action units instead of the timeline; resolve to the service's answer.
  async show(aus) {
    const edition = ++this.edition;
    const answer = await this.ask({ tool: "frames", aus, face: this.stage.name });
    if (edition === this.edition) this.single = [{ time: 0, values: decoded(answer)[0], face: this.stage.name }];
    return answer;
  }

  // The frames to draw and the time among them; null: the face of the session.
  now() {
    if (this.single) return { frames: this.single, time: 0 };
    if (this.playing) this.advance();
    const k = Math.floor(this.time * FPS + 1e-6);
    const pair = [this.frames.get(k), this.frames.get(k + 1)].filter(Boolean);
    if (pair.length) this.last = pair;
    return this.last ? { frames: this.last, time: this.time } : null;
  }

  advance() {
    const { duration, voice } = this;
    const now = performance.now() / 1000;
    if (!voice.source) voice.play(now - this.began); // sound was switched on meanwhile
    const time = Math.max(0, voice.time ?? now - this.began);
    this.began = now - time;
    if (time > duration && !this.loop) {
      this.time = duration;
      this.pause();
      this.ended();
    } else if (time > duration) {
      this.time = duration ? time % duration : 0;
      this.began = now - this.time;
      voice.play(this.time);
    } else this.time = time;
    this.want(this.time);
    if (this.playing) this.want(Math.min(duration, this.time + CHUNK / FPS));
  }

  // Ask for the frames at a time, unless they are known; one request at a time, the newest wish first.
  async want(time) {
    const first = Math.floor(time * FPS + 1e-6);
    const count = this.playing ? CHUNK : 2;
    if (this.frames.has(first) && this.frames.has(first + 1)) return;
    if (!this.design.file || !this.stage.name) return void (this.last = null);
    if (this.waits) return void (this.next = time);
    this.waits = true;
    const { edition } = this;
    try {
      const answer = await this.ask({ tool: "frames", timeline: this.design.file, face: this.stage.name, first, count });
      if (edition === this.edition) decoded(answer).forEach((values, k) => this.frames.set(first + k, { time: (first + k) / FPS, values, face: this.stage.name }));
      while (this.frames.size > KEPT) this.frames.delete(this.frames.keys().next().value);
    } catch {
      return; // the tab says what is wrong; the next change asks again
    } finally {
      this.waits = false;
    }
    const next = edition === this.edition ? this.next : this.time;
    this.next = undefined;
    if (next !== undefined) this.want(next);
  }
}

export const bytesOf = (data) => Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0)).buffer;

// [Int16Array] of the frames of an answer.
function decoded({ data, count }) {
  const all = new Int16Array(bytesOf(data));
  return Array.from({ length: count }, (_, k) => all.subarray((k * all.length) / count, ((k + 1) * all.length) / count));
}
