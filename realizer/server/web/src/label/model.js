// The labels of a recording: lanes of the annotator who works here, which change, and of another one, which do not.
import { Design, ms } from "../design/model.js";

const KNOWN = {}; // an expression about which no rule holds

// Events: those of Design, and "told" with a sentence.
export class Labels extends Design {
  facts = { frames: 0, fps: 25, words: [] };
  version = null; // of the labels that the corpus has

  get frame() {
    return 1 / this.facts.fps;
  }

  get duration() {
    return this.facts.frames / this.facts.fps;
  }

  // Show a recording: labels are [start, end, expression] of both annotators.
  load(facts, key, own, other) {
    const lanes = [...packed(own.labels, own.name, true), ...(other ? packed(other.labels, other.name, false) : [])];
    Object.assign(this, { facts, key, preview: null, past: [], future: [], selected: null, lane: 0 });
    this.state = { timeline: { channel: lanes }, speech: { words: facts.words, peaks: [], ...this.sound } };
    this.dispatchEvent(new Event("change"));
    this.select(null);
  }

  // The wave of the film's sound.
  hear(sound) {
    this.sound = sound;
    this.state = { ...this.state, speech: { ...this.state.speech, ...sound } };
    this.dispatchEvent(new Event("change"));
  }

  row() {
    return KNOWN;
  }

  times({ duration }) {
    return { onset: 0, offset: 0, length: duration };
  }

  spans({ entries }) {
    return entries.map((entry) => ({ entry, start: entry.start, reached: entry.start, left: entry.start + entry.duration, end: entry.start + entry.duration }));
  }

  rebuilt(channel, blocks) {
    return { ...channel, entries: blocks.map(({ entry }) => entry) };
  }

  isOwn(entry) {
    const [lane] = this.find(entry) ?? [];
    return lane === undefined || this.shown.channel[lane].own;
  }

  // A time on a frame of the recording.
  grid(time, least = 0) {
    return ms(Math.min(this.facts.frames, Math.max(least, Math.round(time * this.facts.fps))) / this.facts.fps);
  }

  // Labels do not move each other; at the end of a gesture those that overlap get lanes of their own.
  place(entry, wanted, start, commit) {
    if (!this.isOwn(entry)) return entry;
    const [from] = this.find(entry) ?? [];
    const to = this.shown.channel[wanted]?.own ? wanted : (from ?? 0);
    const made = { ...entry, start: Math.min(this.grid(start), ms(Math.max(0, this.duration - entry.duration))) };
    this.channels((all) => {
      if (from !== undefined) all[from] = { ...all[from], entries: all[from].entries.filter((one) => one !== entry) };
      all[to] = { ...all[to], entries: [...all[to].entries, made].sort((a, b) => a.start - b.start) };
      return all;
    }, commit);
    if (this.find(made)) this.select(made);
    return made;
  }

  change(entry, { intensity, ...fields }, commit) {
    if (!this.isOwn(entry) || !Object.keys(fields).length) return entry;
    const [lane, k] = this.find(entry);
    const made = { ...entry, ...fields };
    this.channels((all) => all.with(lane, { ...all[lane], entries: all[lane].entries.with(k, made) }), commit);
    if (this.find(made)) this.select(made);
    return made;
  }

  remove(entry) {
    if (this.isOwn(entry)) super.remove(entry);
  }

  duplicate(entry) {
    return this.isOwn(entry) && super.duplicate(entry);
  }

  addLane() {} // they come as they are needed

  limited(entry, length) {
    return [this.grid(length, 1), ""];
  }

  end() {
    if (!this.preview) return;
    const lanes = this.shown.channel.filter(({ own }) => own);
    const labels = rows(lanes);
    const twice = labels.find(([start, , text], k) => labels.some((other, j) => j < k && other[2] === text && start < other[1] - 1e-6));
    if (twice) {
      this.cancel();
      this.select(null);
      return void this.dispatchEvent(new CustomEvent("told", { detail: `Labels of one expression cannot overlap: there is ${twice[2]} already at ${twice[0].toFixed(2)} s.` }));
    }
    this.preview = { ...this.preview, timeline: { channel: [...apart(lanes), ...this.shown.channel.filter(({ own }) => !own)] } };
    this.dispatchEvent(new Event("change"));
    super.end();
    this.select(this.selected && this.find(this.selected) ? this.selected : null);
  }

  // The labels of the annotator who works here.
  get labels() {
    return rows(this.shown.channel.filter(({ own }) => own));
  }

  kept() {
    try {
      localStorage.setItem(this.key, JSON.stringify({ labels: this.labels, version: this.version }));
    } catch {} // a full or forbidden store: the labels are still here
    this.dispatchEvent(new Event("commit"));
  }

  // What a page kept of these labels and did not save.
  draft(key) {
    try {
      return JSON.parse(localStorage.getItem(key));
    } catch {
      return null;
    }
  }
}

function rows(lanes) {
  return lanes.flatMap(({ entries }) => entries.map(({ start, duration, expression }) => [start, ms(start + duration), expression])).sort((a, b) => a[0] - b[0] || a[1] - b[1]);
}

function packed(labels, name, own) {
  return apart([{ name, own, entries: labels.map(([start, end, expression]) => ({ expression, start, duration: ms(end - start) })) }]);
}

// The same entries in as many lanes as they need: each stays in its lane if there is room.
function apart(lanes) {
  const { name, own } = lanes[0];
  const found = lanes.map(() => []);
  const all = lanes.flatMap(({ entries }, lane) => entries.map((entry) => ({ entry, lane }))).sort((a, b) => a.entry.start - b.entry.start || a.lane - b.lane);
  for (const { entry, lane } of all) {
    const isFree = (one) => !one.length || one.at(-1).start + one.at(-1).duration <= entry.start + 1e-6;
    const place = isFree(found[lane]) ? found[lane] : (found.find(isFree) ?? found[found.push([]) - 1]);
    place.push(entry);
  }
  const used = found.filter((entries, k) => !k || entries.length);
  return used.map((entries, k) => {
    const same = lanes[k] && lanes[k].entries.length === entries.length && entries.every((entry, j) => entry === lanes[k].entries[j]);
    return same ? lanes[k] : { name: k ? `${name} ${k + 1}` : name, own, entries };
  });
}
