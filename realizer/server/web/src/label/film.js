// The film of a recording, or the points that move where there is no film that the browser shows.

export class Film {
  constructor(video, canvas) {
    Object.assign(this, { video, canvas, time: 0, frame: 0.04, duration: 0, began: null, points: null });
  }

  // Show a recording. Resolve to whether its film can be shown.
  async load({ fps, frames, media, points, arrays }) {
    this.pause();
    if (this.video.src) URL.revokeObjectURL(this.video.src);
    Object.assign(this, { frame: 1 / fps, duration: frames / fps, time: 0, points: points ? { each: points, places: arrays.points } : null, blob: null });
    this.video.hidden = !media;
    this.canvas.hidden = !this.points;
    this.video.removeAttribute("src");
    this.shown = null;
    if (!media) return true;
    this.blob = new Blob([arrays.film], { type: media });
    this.video.src = URL.createObjectURL(this.blob);
    return new Promise((resolve) => {
      this.video.onloadeddata = () => resolve(this.video.videoWidth > 0);
      this.video.onerror = () => resolve(false);
    });
  }

  // The wave of the film's sound: { peaks, rate }, so many a second; null without sound.
  async sound() {
    try {
      const heard = await new OfflineAudioContext(1, 1, 8000).decodeAudioData(await this.blob.arrayBuffer());
      const values = heard.getChannelData(0);
      const rate = Math.min(100, 16000 / heard.duration); // a canvas can only be so wide
      const peaks = Array.from({ length: Math.floor(heard.duration * rate) }, (_, k) => {
        let most = 0;
        for (let i = Math.floor((k * 8000) / rate); i < ((k + 1) * 8000) / rate; i++) most = Math.max(most, Math.abs(values[i] ?? 0));
        return most;
      });
      const loudest = Math.max(...peaks);
      return loudest > 1e-3 ? { rate, peaks: peaks.map((peak) => peak / loudest) } : null;
    } catch {
      return null;
    }
  }

  get playing() {
    return this.began !== null;
  }

  play() {
    if (this.time >= this.duration - this.frame / 2) this.seek(0);
    this.began = performance.now() / 1000 - this.time;
    if (this.blob) this.video.play().catch(() => this.pause());
  }

  pause() {
    const played = this.playing;
    this.began = null;
    this.video.pause();
    if (played) this.seek(Math.floor(this.time / this.frame + 1e-6) * this.frame);
  }

  // Show the frame at a time.
  seek(time) {
    this.time = Math.min(Math.max(0, this.duration - this.frame), Math.max(0, Math.round(time / this.frame) * this.frame));
    if (this.playing) this.began = performance.now() / 1000 - this.time;
    if (this.blob) this.video.currentTime = this.time + this.frame / 2; // in the middle of the frame: no doubt which
  }

  // The time of now. While it plays, it goes from `first` to `last`, and again if it shall.
  now(first, last, again) {
    if (!this.playing) return this.time;
    this.time = this.blob ? this.video.currentTime : performance.now() / 1000 - this.began;
    if (this.time < last - this.frame / 2 && !this.video.ended) return this.time;
    if (!again) this.pause();
    this.seek(again ? first : last);
    if (again && this.blob) this.video.play().catch(() => this.pause());
    return this.time;
  }

  // Draw the points of now.
  draw() {
    if (!this.points) return;
    const { each, places } = this.points;
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    const k = Math.min(places.length / each / 2 - 1, Math.round(this.time / this.frame));
    const key = `${k} ${width} ${height}`;
    if (key === this.shown || !width) return;
    this.shown = key;
    Object.assign(this.canvas, { width: width * devicePixelRatio, height: height * devicePixelRatio });
    const pen = this.canvas.getContext("2d");
    pen.scale(devicePixelRatio, devicePixelRatio);
    const [left, right, low, high] = (this.points.room ??= extent(places));
    const scale = 0.86 * Math.min(width / (right - left || 1), height / (high - low || 1));
    pen.fillStyle = "#fff";
    for (let i = 2 * each * k; i < 2 * each * (k + 1); i += 2) {
      if (!Number.isFinite(places[i])) continue;
      pen.beginPath();
      pen.arc(width / 2 + (places[i] - (left + right) / 2) * scale, height / 2 - (places[i + 1] - (low + high) / 2) * scale, 3, 0, 7);
      pen.fill();
    }
  }
}

function extent(places) {
  const room = [Infinity, -Infinity, Infinity, -Infinity];
  for (let i = 0; i < places.length; i += 2) {
    if (!Number.isFinite(places[i])) continue;
    room[0] = Math.min(room[0], places[i]);
    room[1] = Math.max(room[1], places[i]);
    room[2] = Math.min(room[2], places[i + 1]);
    room[3] = Math.max(room[3], places[i + 1]);
  }
  return room;
}
