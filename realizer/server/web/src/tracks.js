// The recent values of a stream of frames, and the columns that move most, drawn as curves.
import { make } from "./dom.js";

const KEPT = 32; // s
const MOST = 6; // tracks
const SOME = 0.05; // of a column's range: smaller movements are not shown

export class Tracks {
  // reach(name): the value that fills a track.
  constructor(reach, label, group) {
    Object.assign(this, { reach, label, group, names: [], frames: [], shown: "" });
  }

  begin(names) {
    if (names.join() !== this.names.join()) this.frames = [];
    this.names = names;
    this.reaches = names.map(this.reach);
    this.groups = new Map();
    names.forEach((name, k) => {
      const group = this.group(name);
      this.groups.set(group, [...(this.groups.get(group) ?? []), k]);
    });
  }

  reset() {
    this.frames = [];
  }

  add(time, values) {
    if (time <= this.frames.at(-1)?.time) return;
    this.frames.push({ time, values });
    while (this.frames[0].time < time - KEPT) this.frames.shift();
  }

  // Rows for the columns that move in a span of time, most first; unchanged rows are reused.
  rows(from, to) {
    const within = this.frames.filter(({ time }) => time >= from && time <= to);
    const moved = [...this.groups ?? []].map(([group, columns]) => {
      let most = 0;
      for (const k of columns) for (const { values } of within) most = Math.max(most, Math.abs(values[k]) / this.reaches[k]);
      return { group, columns, most };
    });
    const best = moved.filter(({ most }) => most > SOME).sort((a, b) => b.most - a.most).slice(0, MOST);
    best.sort((a, b) => a.columns[0] - b.columns[0]);
    const shown = best.map(({ group }) => group).join();
    if (shown === this.shown && this.made) return this.made;
    this.shown = shown;
    this.made = best.map(({ group, columns }) => {
      const canvas = make("canvas");
      const words = this.label(group);
      const value = make("output");
      const element = make("div.track.curve", {}, make("span", { title: words }, words), make("div.lane", {}, canvas, value));
      return { columns, canvas, value, element };
    });
    return this.made;
  }

  // Draw the curves from..to, and their values at a time.
  draw({ columns, canvas, value }, from, to, time, colours) {
    const here = this.frame(time);
    const digits = this.reaches[columns[0]] > 1 ? 0 : 2;
    value.textContent = here ? [...new Set(columns.map((k) => (here.values[k] + 0).toFixed(digits)))].reverse().join(" | ") : "";
    const ratio = Math.min(devicePixelRatio, 2);
    const [width, height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio];
    if (!width) return;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const pen = canvas.getContext("2d");
    pen.clearRect(0, 0, width, height);
    const signed = columns.some((k) => this.frames.some(({ values }) => values[k] < 0));
    const zero = signed ? height / 2 : height - ratio;
    const x = (time) => ((time - from) / (to - from)) * width;
    const same = columns.length === 2 && this.frames.every(({ values }) => Math.abs(values[columns[0]] - values[columns[1]]) < 0.005 * this.reaches[columns[0]]);
    (same ? columns.slice(0, 1) : columns).forEach((k, nth) => {
      const y = (value) => zero - Math.max(-1, Math.min(1, value / this.reaches[k])) * (signed ? height / 2 : height - 2 * ratio);
      const within = this.frames.filter(({ time }) => time >= from - 0.1 && time <= to + 0.1);
      if (!within.length) return;
      pen.beginPath();
      for (const { time, values } of within) pen.lineTo(x(time), y(values[k]));
      pen.strokeStyle = colours[nth];
      pen.lineWidth = 1.5 * ratio;
      pen.stroke();
      pen.lineTo(x(within.at(-1).time), zero);
      pen.lineTo(x(within[0].time), zero);
      pen.globalAlpha = 0.16;
      pen.fillStyle = colours[nth];
      pen.fill();
      pen.globalAlpha = 1;
    });
  }

  frame(time) {
    return this.frames.findLast((one) => one.time <= time) ?? this.frames[0];
  }

  // name -> value of the frame shown at a time.
  at(time) {
    const frame = this.frame(time);
    return frame && Object.fromEntries(this.names.map((name, k) => [name, frame.values[k]]));
  }
}
