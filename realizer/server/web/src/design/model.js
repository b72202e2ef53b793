// The designer's document: a timeline as its file has it. Every change makes a new timeline, so undo has no end.

const LEAST = 0.04; // s, of a block and of a break
const BREAK = 0.5; // s, the usual break
const DRAFT = "design"; // in localStorage

export const ms = (seconds) => Math.round(seconds * 1000) / 1000;
const keys = new Map(); // name -> its key, which ignores case and separators
export const keyOf = (name) => keys.get(name) ?? keys.set(name, name.trim().replace(/\s*:\s*/g, ":").replace(/[\s_-]+/g, "_").toUpperCase()).get(name);
export const isBreak = ({ expression, start }) => start === undefined && keyOf(expression) === "NEUTRAL";
export const isKeys = ({ expression }) => keyOf(expression) === "KEYFRAMES";
const isStill = (entry) => isBreak(entry) || isKeys(entry); // without onset and offset
const empty = () => ({ timeline: { channel: [{ name: "1", entries: [] }] }, speech: { says: [], words: [], syncs: [], peaks: [] } });

// Events: "change" whenever what is shown differs, "commit" when a change has ended, "select".
export class Design extends EventTarget {
  rows = new Map(); // key of a name -> expression of the library
  past = [];
  future = [];
  selected = null; // an entry
  lane = 0; // number of the channel that new blocks go to
  preview = null; // the state during a gesture
  state = empty();

  // Seconds of a step of the arrow keys.
  get frame() {
    return 0.04;
  }

  get shown() {
    return (this.preview ?? this.state).timeline;
  }

  get speech() {
    return (this.preview ?? this.state).speech;
  }

  // What the service reads: channels without entries are not in a file.
  get file() {
    const channel = this.shown.channel.filter(({ entries }) => entries.length);
    return channel.length ? { ...this.shown, channel } : null;
  }

  row({ expression }) {
    return this.rows.get(keyOf(expression));
  }

  // Seconds of onset and offset, and of the whole, as realizer/expressions/timeline.py has them.
  times(entry) {
    if (isStill(entry)) return { onset: 0, offset: 0, length: entry.duration ?? entry.keys?.at(-1)[0] ?? BREAK };
    const row = this.row(entry) ?? { onset: 0.3, apex: 0.6, offset: 0.5 };
    const [onset, offset] = [entry.onset ?? row.onset, entry.offset ?? row.offset];
    return { onset, offset, length: entry.duration ?? onset + row.apex + offset };
  }

  // [{ entry, start, reached, left, end }] of a channel.
  spans({ entries, start = 0, joins = "both" }) {
    const times = entries.map((entry) => this.times(entry));
    let at = start;
    return entries.map((entry, k) => {
      const { onset, offset, length } = times[k];
      const [before, after] = [times[k - 1], times[k + 1]];
      const rise = k && joins === "onset" ? (isStill(entry) ? before.offset : onset) : k && joins === "offset" ? 0 : onset;
      const fall = !after ? offset : joins === "onset" ? 0 : joins === "offset" ? (isStill(entry) ? after.onset : offset) : offset;
      const part = Math.min(1, length / (rise + fall || 1));
      const span = { entry, start: at, reached: at + rise * part, left: at + length - fall * part, end: at + length };
      at += length;
      return span;
    });
  }

  find(entry) {
    for (const [lane, { entries }] of this.shown.channel.entries()) if (entries.includes(entry)) return [lane, entries.indexOf(entry)];
    return null;
  }

  span(entry) {
    const [lane, k] = this.find(entry);
    return this.spans(this.shown.channel[lane])[k];
  }

  get duration() {
    return Math.max(0, ...this.shown.channel.map((one) => this.spans(one).at(-1)?.end ?? 0));
  }

  // Show a change; without `commit` it is part of a gesture, which `end` ends and `cancel` takes back.
  show(state, commit = true) {
    this.preview = { ...(this.preview ?? this.state), ...state };
    this.dispatchEvent(new Event("change"));
    if (commit) this.end();
  }

  end() {
    if (!this.preview) return;
    this.past.push(this.state);
    this.future = [];
    this.state = this.preview;
    this.preview = null;
    this.kept();
  }

  cancel() {
    this.preview = null;
    this.dispatchEvent(new Event("change"));
  }

  kept() {
    try {
      localStorage.setItem(DRAFT, JSON.stringify(this.state));
    } catch {} // a full or forbidden store: the document is still here
    this.dispatchEvent(new Event("commit"));
  }

  // The state that a page kept, if there is one.
  restore() {
    try {
      const kept = JSON.parse(localStorage.getItem(DRAFT));
      if (!kept?.timeline.channel.some(({ entries }) => entries.length)) return false;
      this.state = { ...kept, speech: { ...empty().speech, ...kept.speech } };
      return true;
    } catch {
      return false;
    }
  }

  step(from, to) {
    if (!from.length) return;
    const [lane, k] = (this.selected && this.find(this.selected)) ?? [];
    to.push(this.state);
    Object.assign(this, { state: from.pop(), preview: null });
    this.dispatchEvent(new Event("change"));
    const same = this.shown.channel[lane]?.entries[k];
    this.select(same && !isBreak(same) ? same : null);
    this.kept();
  }

  undo() {
    this.step(this.past, this.future);
  }

  redo() {
    this.step(this.future, this.past);
  }

  clear() {
    this.show(empty());
    this.select(null);
  }

  select(entry) {
    this.selected = entry;
    if (entry) this.lane = this.find(entry)[0];
    this.dispatchEvent(new Event("select"));
  }

  channels(change, commit) {
    this.show({ timeline: { ...this.shown, channel: change([...this.shown.channel]) } }, commit);
  }

  setLane(number, fields) {
    this.channels((all) => all.with(number, tidy({ ...all[number], ...fields })));
  }

  addLane() {
    this.lane = this.shown.channel.length;
    this.channels((all) => [...all, { name: freeName(all), entries: [] }]);
  }

  removeLane(number) {
    this.channels((all) => (all.length > 1 ? all.toSpliced(number, 1) : [{ name: "1", entries: [] }]));
    this.lane = Math.min(this.lane, this.shown.channel.length - 1);
    this.select(null);
  }

  // Change fields of an entry; null removes one. Return the new entry.
  change(entry, fields, commit) {
    const [lane, k] = this.find(entry);
    const made = tidy({ ...entry, ...fields });
    this.channels((all) => all.with(lane, { ...all[lane], entries: all[lane].entries.with(k, made) }), commit);
    this.select(made);
    return made;
  }

  // Put an entry into a channel from `start` on; what is in its way moves behind it.
  place(entry, lane, start, commit) {
    const from = this.find(entry);
    const made = { ...entry };
    this.channels((all) => {
      if (from && from[0] !== lane) all[from[0]] = this.rebuilt(all[from[0]], this.blocks(all[from[0]], entry));
      all[lane] = this.rebuilt(all[lane], [...this.blocks(all[lane], entry), { entry: made, start: Math.max(0, start), end: Math.max(0, start) + this.times(entry).length }]);
      return all;
    }, commit);
    this.select(made);
    return made;
  }

  remove(entry) {
    const [lane, k] = this.find(entry);
    this.channels((all) => all.with(lane, this.rebuilt(all[lane], this.blocks(all[lane], entry))));
    this.select(this.shown.channel[lane].entries.filter((one) => !isBreak(one))[Math.max(0, k - 1)] ?? null);
  }

  duplicate(entry) {
    return this.place({ ...entry }, this.find(entry)[0], this.span(entry).end);
  }

  blocks(channel, without) {
    return this.spans(channel).filter(({ entry }) => entry !== without && !isBreak(entry));
  }

  // A channel with these blocks where they are; breaks fill what is between them.
  rebuilt(channel, blocks) {
    const entries = [];
    const sorted = blocks.toSorted((a, b) => a.start - b.start);
    const begin = ms(sorted[0]?.start ?? 0);
    let at = begin;
    for (const { entry, start, end } of sorted) {
      const gap = ms(start - at);
      if (gap >= LEAST) entries.push({ expression: "neutral", duration: gap });
      entries.push(entry);
      at = (gap >= LEAST ? start : at) + (end - start);
    }
    return tidy({ ...channel, start: begin || null, entries });
  }

  // Whether nothing of a channel plays between two times.
  isFree(lane, start, end) {
    return this.blocks(this.shown.channel[lane]).every((one) => one.end <= start + 1e-6 || one.start >= end - 1e-6);
  }

  // A length within which people were seen to show the expression, unless `free`; and the sentence that stops it.
  limited(entry, length, free) {
    const row = this.row(entry);
    const shown = Math.max(LEAST, ms(length));
    if (free || !row?.possible) return [shown, ""];
    const { onset, offset } = this.times(entry);
    const half = (onset + offset) / 2;
    const whole = (visible) => (visible <= half ? 2 * visible : visible + half);
    const [least, most] = [whole(row.possible[0]), whole(row.possible[1] ?? Infinity)];
    const range = row.possible[1] === null ? `${row.possible[0]} s or longer` : `${row.possible[0]} to ${row.possible[1]} s`;
    const words = `${titleOf(entry)} was never seen for another time than ${range} (Wojdel 2005, table 6.15). Hold Alt to go beyond.`;
    return shown < least - 1e-6 ? [ms(least), words] : shown > most + 1e-6 ? [ms(most), words] : [shown, ""];
  }
}

export const titleOf = ({ expression, faps = [] }) => faps.length ? `FAP ${faps.length > 4 ? `${faps.slice(0, 3).join(", ")} and ${faps.length - 3} more` : faps.join(", ")}` : expression.replace(/^template:/i, "").replaceAll("_", " ").toLowerCase();

// The same without fields that have no value.
function tidy(row) {
  return Object.fromEntries(Object.entries(row).filter(([, value]) => value !== null && value !== undefined));
}

function freeName(channels) {
  let number = channels.length + 1;
  while (channels.some(({ name }) => name === String(number))) number++;
  return String(number);
}
