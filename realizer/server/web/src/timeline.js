// The timeline: each behaviour as scheduled and as it happened, curves of AUs or FAPs, the playhead.
import { at, make } from "./dom.js";

const IDLE = 8; // s shown without a block
const AFTER = 0.6; // s shown after a block's end
const LEAST = 2; // s
const CURVES = 0.25; // s between choices of the curves that move most
const BLOCKS = 12; // in memory
const WORD = 6; // px beside a word
const PEN = Object.assign(document.createElement("canvas").getContext("2d"), { font: "11px system-ui, sans-serif" }); // as .word
const OVER = /DONE|INTERRUPTED|FAILED|REVOKED/;
const STEP = 0.1; // s of an arrow key
const POINTS = 10; // px between lines of the ruler, at least, times the length of its labels

export class Timeline {
  // scrubbed(time): a past time is shown; null is now. oldest(): the oldest time that can be shown.
  constructor(panel, scrubbed, oldest) {
    Object.assign(this, { panel, scrubbed, oldest, blocks: new Map(), current: null, kinds: {}, shownKind: null, scrub: null, now: null });
    this.ruler = make("div.ruler", { ariaHidden: "true" });
    this.lines = make("div.lines");
    this.curves = make("div.lines");
    this.head = make("div.head", {}, make("output"));
    this.slider = make("div.scrub", { role: "slider", tabIndex: 0, ariaLabel: "Time; arrow keys look at the past, End comes back to now" });
    panel.replaceChildren(make("div.sheet", {}, this.ruler, this.lines, this.curves, this.slider, this.head));
    new ResizeObserver(() => (this.stale = true)).observe(panel);
    this.slider.onpointerdown = (event) => {
      this.slider.setPointerCapture(event.pointerId);
      this.touch(event);
    };
    this.slider.onpointermove = (event) => event.buttons && this.touch(event);
    this.slider.onkeydown = (event) => this.key(event);
  }

  reset() {
    this.blocks.clear();
    this.current = null;
    this.stale = true;
    this.look(null);
  }

  // The record of a block; its id may be used again after its end.
  block(id, again) {
    const known = this.blocks.get(id);
    if (known && !(again && known.over)) return known;
    const block = { id, start: null, end: null, ended: null, over: false, lines: [], first: new Map(), happened: new Map() };
    this.blocks.delete(id);
    this.blocks.set(id, block);
    while (this.blocks.size > BLOCKS) this.blocks.delete(this.blocks.keys().next().value);
    return block;
  }

  // Take a message of the stream `schedule`: whole blocks, or only their states.
  plan({ blocks }) {
    for (const one of blocks) {
      const block = this.block(one.block, Boolean(one.behaviours) && !OVER.test(one.state));
      Object.assign(block, { start: one.start ?? block.start, end: one.end ?? block.end, over: block.over || OVER.test(one.state) });
      for (const line of one.behaviours ?? []) {
        if (!block.first.has(line.id)) block.first.set(line.id, line.syncs);
      }
      if (one.behaviours) block.lines = one.behaviours;
      if (block === this.current) this.stale = true;
    }
  }

  // Take feedback: what happened, and when.
  feedback(element) {
    const time = Number(element.getAttribute("globalTime"));
    const [id, behaviour, ...sync] = (element.getAttribute("id") ?? "").split(":");
    if (element.localName === "syncPointProgress") {
      const block = this.block(id);
      block.happened.set(behaviour, [...(block.happened.get(behaviour) ?? []), { name: sync.join(":"), time }]);
      this.stale ||= block === this.current;
    } else if (element.localName === "blockProgress") {
      const block = this.block(id, behaviour === "start");
      if (behaviour === "end") Object.assign(block, { ended: time, over: true });
      else block.start ??= time;
    }
  }

  // Choose the curves: "au" or "fap".
  show(kind) {
    this.shownKind = kind;
    this.looked = -Infinity;
  }

  get range() {
    const { current, now } = this;
    if (!current) return [now - IDLE, now + 0.09 * IDLE];
    const end = Math.max(current.start + LEAST, current.ended ?? current.end ?? now, ...[...current.first.values()].flat().map(({ at }) => at ?? 0));
    const length = Math.min(end, current.start + 3600) - current.start;
    return [current.start - 0.03 * length, current.start + length + AFTER];
  }

  draw(now) {
    if (now === null) return;
    this.now = now;
    let current = null;
    for (const block of this.blocks.values()) if (block.lines.length && block.start !== null && block.start <= now && (!current || block.start >= current.start)) current = block;
    // A block that has ended stays visible as long as its frames are in memory.
    if (current && (current.ended ?? current.end ?? Infinity) < this.oldest()) current = null;
    if (current !== this.current) {
      this.current = current;
      this.stale = true;
    }
    const [from, to] = this.range;
    if (this.stale) this.build(from, to);
    this.stale = false;
    this.mark(from, to);
    if (!this.looked || now - this.looked > CURVES || now < this.looked) {
      this.looked = now;
      const kind = this.kinds[this.shownKind];
      const rows = kind?.rows(from, to) ?? [];
      if (rows.some(({ element }, k) => this.curves.children[k] !== element) || rows.length !== this.curves.childElementCount) this.curves.replaceChildren(...rows.map(({ element }) => element));
      const style = getComputedStyle(this.panel);
      const colours = [style.getPropertyValue("--curve"), style.getPropertyValue("--curve-2")];
      if (!current) this.rule(from, to);
      for (const row of rows) kind.draw(row, from, to, this.scrub ?? now, colours);
    }
    const time = this.scrub ?? now;
    const part = (time - from) / (to - from);
    const inside = part >= 0 && part <= 1;
    this.head.hidden = !inside;
    if (inside) this.head.style.setProperty("--at", part);
    this.head.firstChild.textContent = `${(time - (current?.start ?? now)).toFixed(2)} s`;
    for (const [name, value] of Object.entries({ valuemin: from, valuemax: to, valuenow: time })) this.slider.setAttribute(`aria-${name}`, value.toFixed(2));
  }

  build(from, to) {
    const { current } = this;
    at("playing").textContent = current ? current.id : "";
    const place = (time) => `${(100 * (time - from)) / (to - from)}%`;
    this.lines.replaceChildren(
      ...(current?.lines ?? []).map((line) => {
        const planned = (current.first.get(line.id) ?? line.syncs).filter(({ at }) => at !== null);
        const happened = current.happened.get(line.id) ?? [];
        const lane = make("div.lane");
        if (planned.length) {
          const times = planned.map(({ at }) => at);
          lane.append(bar("planned", place, Math.min(...times), Math.max(...times)));
          lane.append(...planned.map(({ name, at }) => tick("tick", place(at), `${name}: scheduled ${(at - current.start).toFixed(2)} s`)));
        }
        // Words have two rows; one that has no room on them is left out.
        const free = [-Infinity, -Infinity];
        for (const { start, text } of line.words ?? []) {
          const left = (this.slider.clientWidth * (current.start + start - from)) / (to - from);
          const row = free.findIndex((end) => end <= left);
          if (row < 0) continue;
          const word = make(row ? "span.word.low" : "span.word", {}, text);
          word.style.left = place(current.start + start);
          free[row] = left + PEN.measureText(text).width + WORD;
          lane.append(word);
        }
        if (happened.length) {
          const done = happened.at(-1).name === "end";
          const fill = bar("happened", place, happened[0].time, happened.at(-1).time);
          if (!done) fill.dataset.from = happened[0].time;
          lane.append(fill, ...happened.map(({ name, time }) => tick("dot", place(time), `${name}: happened at ${(time - current.start).toFixed(2)} s`)));
        }
        const label = make("span", { title: `${line.element} ${line.id}` }, line.id);
        return make(`div.track${line.words ? ".speech" : ""}`, {}, label, lane);
      }),
    );
    this.rule(from, to);
  }

  // Running blocks grow.
  mark(from, to) {
    for (const fill of this.lines.querySelectorAll("[data-from]")) {
      const start = Number(fill.dataset.from);
      const end = Math.min(this.now, this.current.ended ?? this.now);
      fill.style.width = `${(100 * Math.max(0, end - start)) / (to - from)}%`;
    }
  }

  // Lines of the ruler: seconds from the block's start, or from now.
  rule(from, to) {
    const zero = this.current?.start ?? this.now;
    const room = this.ruler.clientWidth / (POINTS * 6);
    const step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 30, 60, 300, 1200].find((s) => (to - from) / s <= room) ?? 3600;
    const marks = [];
    for (let k = Math.ceil((from - zero) / step); k * step <= to - zero; k++) {
      if (!k && !this.current) continue; // the playhead shows this time
      const mark = make("span", {}, `${Number((k * step).toFixed(1))} s`);
      mark.style.left = `${(100 * (k * step + zero - from)) / (to - from)}%`;
      marks.push(mark);
    }
    this.ruler.replaceChildren(...marks);
  }

  touch(event) {
    const { left, width } = this.slider.getBoundingClientRect();
    const [from, to] = this.range;
    const time = from + Math.min(1, Math.max(0, (event.clientX - left) / width)) * (to - from);
    this.look(time >= this.now ? null : time);
  }

  key(event) {
    const step = { ArrowLeft: -STEP, ArrowRight: STEP, PageUp: -10 * STEP, PageDown: 10 * STEP }[event.key];
    if (event.key === "End" || event.key === "Escape") this.look(null);
    else if (event.key === "Home") this.look(Math.max(this.oldest(), this.range[0]));
    else if (step) this.look((this.scrub ?? this.now) + step);
    else return;
    event.preventDefault();
  }

  // Show the face at a past time; null or a later time: now.
  look(time) {
    this.scrub = time === null || time >= this.now ? null : Math.max(time, this.oldest());
    this.looked = -Infinity;
    this.scrubbed(this.scrub);
  }
}

function bar(name, place, from, to) {
  const element = make(`div.${name}`);
  element.style.left = place(from);
  element.style.width = `calc(${place(to)} - ${place(from)})`;
  return element;
}

function tick(name, left, title) {
  const element = make(`i.${name}`, { title });
  element.style.left = left;
  return element;
}
