// The lanes of the designer: blocks with handles, by mouse, touch and keyboard; words and sound of a speech above.
import { make } from "../dom.js";
import { Gestures } from "./gestures.js";
import { isBreak, isKeys, ms, titleOf } from "./model.js";

const HANDLES = { start: "start", onset: "end of the onset", offset: "begin of the offset", end: "end", amount: "amount" };

const NONE = [];

export class Lanes extends Gestures {
  // told(sentence): what a gesture meets. scrub(time): another time is looked at. inspect(): look at the block's fields.
  constructor(panel, design, { told, scrub, inspect }) {
    super();
    Object.assign(this, { panel, design, told, scrub, inspect, drawn: [], scale: 100, marks: new Map(), companions: [] });
    this.ruler = make("div.d-ruler", { role: "slider", tabIndex: 0, ariaLabel: "Time; arrow keys change it" });
    this.lanes = make("div.d-lanes");
    this.line = make("i.d-line", { hidden: true });
    this.head = make("i.d-head");
    panel.replaceChildren(make("div.d-sheet", {}, this.ruler, this.lanes, this.line, this.head));
    design.addEventListener("change", () => this.draw());
    design.addEventListener("select", () => this.mark());
    this.lanes.onpointerdown = (event) => this.grab(event);
    this.lanes.onkeydown = (event) => this.key(event);
    this.lanes.addEventListener("focusin", ({ target }) => target.entry && target.entry !== design.selected && design.find(target.entry) && design.select(target.entry));
    this.ruler.onpointerdown = (event) => this.rule(event);
    this.ruler.onkeydown = (event) => {
      const step = { ArrowLeft: -design.frame, ArrowRight: design.frame, PageUp: -1, PageDown: 1, Home: -Infinity }[event.key];
      if (!step) return;
      event.preventDefault();
      scrub(Math.max(0, this.time + step));
    };
    new ResizeObserver(() => this.fit()).observe(panel);
    this.draw();
  }

  // Seconds that are shown at least.
  get reach() {
    return Math.max(4, this.design.duration + 1, ...(this.design.speech.words).map(([, end]) => end));
  }

  // Fit the time across, but never under a pointer.
  fit() {
    if (this.dragging) return;
    const room = this.panel.clientWidth - this.labels;
    this.scale = Math.max(room / this.reach, this.zoom ?? 0, 12);
    this.panel.style.setProperty("--s", `${this.scale}px`);
    this.panel.style.setProperty("--reach", this.reach);
    this.drawRuler();
  }

  get labels() {
    return parseFloat(getComputedStyle(this.panel).getPropertyValue("--labels")) || 0;
  }

  zoomBy(factor) {
    this.zoom = Math.min(600, this.scale * factor);
    this.fit();
  }

  // Draw the channels that have changed.
  draw() {
    const { channel } = this.design.shown;
    const rows = channel.map((one, lane) => {
      const known = this.drawn[lane];
      if (known?.channel === one && known.rows === this.design.rows) return known;
      const blocks = this.design.spans(one).filter(({ entry }) => !isBreak(entry));
      // Most blocks of a lane stay what they are during a drag.
      if (known?.rows === this.design.rows && known.channel.name === one.name && known.channel.own === one.own && blocks.length === known.blocks.length) {
        blocks.forEach((span, k) => this.shape(known.blocks[k], span));
        return Object.assign(known, { channel: one });
      }
      return { channel: one, rows: this.design.rows, ...this.laneOf(one, lane, blocks) };
    });
    const held = document.activeElement?.entry;
    if (rows.length !== this.drawn.length) this.lanes.replaceChildren(...rows.map(({ element }) => element));
    else rows.forEach((row, k) => row === this.drawn[k] || this.drawn[k].element.replaceWith(row.element));
    this.drawn = rows;
    this.fit();
    this.mark();
    if (held && !this.dragging) this.focus(this.design.selected);
  }

  laneOf(channel, lane, spans) {
    const blocks = spans.map((span) => this.shape(this.block(), span));
    const words = { role: "listbox", ariaLabel: `Channel ${channel.name}`, ariaOrientation: "horizontal" };
    const empty = make("p.d-empty", {}, "Click an expression, or drag it here. In a gap the face is neutral.");
    const list = make("div.d-list", blocks.length ? words : {}, ...(blocks.length ? blocks : [empty]));
    const name = make("button.d-name", { type: "button", title: "New blocks go to this channel" }, channel.name);
    name.onclick = () => {
      this.design.lane = lane;
      this.design.select(null);
    };
    return { list, blocks, element: make("div.d-lane", {}, name, make("div.d-track", {}, list)) };
  }

  block() {
    const parts = Object.keys(HANDLES).map((part) => make(`i.d-handle.d-${part}`, { title: HANDLES[part] }));
    for (const [k, part] of Object.keys(HANDLES).entries()) parts[k].dataset.part = part;
    return make("div.d-block", { role: "option", tabIndex: -1 }, make("i.d-shape"), make("span"), ...parts);
  }

  // Make a block show an entry at its times; return it.
  shape(block, span) {
    const { entry, start, reached, left, end } = span;
    const old = block.span;
    block.span = span;
    if (old?.entry === entry && old.start === start && old.reached === reached && old.left === left && old.end === end) return block;
    const amount = entry.intensity ?? 1;
    if (old?.entry !== entry) {
      Object.assign(block, { entry, known: null });
      block.classList.toggle("keys", isKeys(entry));
      block.children[1].textContent = titleOf(entry);
    }
    const across = (time) => `${((100 * (time - start)) / (end - start)).toFixed(2)}%`;
    const tops = isKeys(entry) ? movement(entry, amount) : `${across(reached)} ${100 - 100 * amount}%, ${across(left)} ${100 - 100 * amount}%`;
    block.children[0].style.clipPath = `polygon(0 100%, ${tops}, 100% 100%)`;
    for (const [name, value] of Object.entries({ "--at": ms(start), "--long": ms(end - start), "--amount": amount, "--reached": across(reached), "--left": across(left) })) block.style.setProperty(name, value);
    block.lasts = `${titleOf(entry)}, ${start.toFixed(2)} to ${end.toFixed(2)} s, amount ${Math.round(100 * amount)} %`;
    block.known = null;
    return block;
  }

  // Show what is chosen, what is unusual, and what is missing.
  mark() {
    const { design } = this;
    const all = [...this.lanes.querySelectorAll(".d-block")];
    const stop = all.find(({ entry }) => entry === design.selected) ?? all[0];
    for (const block of all) {
      const { entry } = block;
      const advice = this.marks.get(entry) ?? NONE;
      if ((block.tabIndex === 0) !== (block === stop)) block.tabIndex = block === stop ? 0 : -1;
      if (block.known?.advice === advice && block.known.chosen === (entry === design.selected)) continue;
      block.known = { advice, chosen: entry === design.selected };
      block.ariaSelected = String(entry === design.selected);
      const known = design.row(entry) || isKeys(entry);
      block.dataset.state = !known ? "unknown" : advice.some(({ impossible }) => impossible) ? "impossible" : advice.length ? "unusual" : "";
      const words = [...(known ? [] : ["no such expression"]), ...advice.map(({ text, hint }) => `${text}; ${hint}`), entry.because ?? ""].filter(Boolean).join(". ");
      block.title = words;
      block.ariaLabel = [block.lasts, words].filter(Boolean).join(". ");
    }
    [...this.lanes.querySelectorAll(".d-lane")].forEach((row, k) => row.classList.toggle("here", k === design.lane));
  }

  // Take the service's findings: advice by entry, and companions, which are drawn where there is room.
  judge(marks, companions) {
    this.marks = marks;
    for (const old of this.lanes.querySelectorAll(".d-ghost, .d-lane.company")) old.remove();
    this.companions = companions;
    const extra = [];
    for (const [k, { expression, start, end, says, lane, must }] of companions.entries()) {
      const title = titleOf({ expression });
      const ghost = make(`button.d-ghost${must ? ".must" : ""}`, { type: "button", title: `Add ${title}: ${says}`, ariaLabel: `Add ${title}, ${start.toFixed(2)} to ${end.toFixed(2)} s: ${says}` }, `+ ${title}`);
      ghost.style.setProperty("--at", start);
      ghost.style.setProperty("--long", end - start);
      ghost.onclick = () => this.accept(k);
      const row = this.drawn[lane]?.element.querySelector(".d-track");
      row ? row.append(ghost) : extra.push(ghost);
    }
    if (extra.length) this.lanes.append(make("div.d-lane.company", {}, make("span.d-name", {}, "usual company"), make("div.d-track", {}, ...extra)));
    this.mark();
  }

  accept(k) {
    const { expression, start, end, says, lane, intensity } = this.companions[k];
    const { design } = this;
    if (!design.shown.channel[lane]) design.addLane();
    design.place({ expression, duration: ms(end - start), because: says, ...(intensity === 1 ? {} : { intensity }) }, Math.min(lane, design.shown.channel.length - 1), start);
    this.focus(design.selected);
  }

  focus(entry) {
    [...this.lanes.querySelectorAll(".d-block")].find((block) => block.entry === entry)?.focus({ preventScroll: false });
  }

  // The time and the number of the lane at a place on the screen; null outside.
  at(x, y) {
    const { left, right, top, bottom } = this.panel.getBoundingClientRect();
    const lane = this.laneAt(y);
    const inside = x >= left && x <= right && y >= top && y <= bottom && lane >= 0;
    return inside ? { lane: Math.min(lane, this.design.shown.channel.length - 1), time: Math.max(0, this.timeAt(x)) } : null;
  }

  // The number of the lane at a height; -1: none. During a drag `edges` has where they were at its begin.
  laneAt(y, edges = this.edges()) {
    return edges.findIndex(([top, bottom]) => y >= top && y < bottom);
  }

  edges() {
    return [...this.lanes.children].map((lane) => lane.getBoundingClientRect()).map(({ top, bottom }) => [top, bottom]);
  }

  timeAt(x) {
    return (x - this.lanes.getBoundingClientRect().left - this.labels) / this.scale;
  }

  rule(event) {
    this.ruler.setPointerCapture(event.pointerId);
    const look = ({ clientX }) => this.scrub(Math.max(0, this.timeAt(clientX)));
    this.ruler.onpointermove = look;
    this.ruler.onpointerup = this.ruler.onpointercancel = () => (this.ruler.onpointermove = null);
    look(event);
  }

  // Seconds, words and sound above the lanes.
  drawRuler() {
    const { words, syncs = [], peaks, rate = 100 } = this.design.speech;
    const known = [words, peaks, this.scale, this.reach];
    if (known.every((one, k) => one === this.ruled?.[k])) return;
    this.ruled = known;
    const step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 30, 60].find((s) => s * this.scale >= 56) ?? 300;
    const placed = (what, at, text) => {
      const mark = make(what, { title: text }, text);
      mark.style.setProperty("--at", at);
      return mark;
    };
    const marks = Array.from({ length: Math.floor(this.reach / step) + 1 }, (_, k) => placed("span.d-second", k * step, `${Number((k * step).toFixed(1))} s`));
    const said = words.map(([start, end, text]) => {
      const word = placed("span.d-word", start, text);
      word.style.setProperty("--long", end - start);
      return word;
    });
    said.push(...syncs.map(([time, id]) => placed("span.d-sync", time, id)));
    const wave = make("canvas.d-wave", { hidden: !peaks.length, width: Math.max(1, peaks.length), height: 24 });
    const pen = wave.getContext("2d");
    pen.fillStyle = getComputedStyle(this.panel).getPropertyValue("--curve");
    peaks.forEach((peak, k) => pen.fillRect(k, 12 - 12 * peak, 1, Math.max(1, 24 * peak)));
    wave.style.setProperty("--long", peaks.length / rate);
    this.ruler.classList.toggle("spoken", words.length > 0);
    this.ruler.replaceChildren(wave, ...marks, ...said);
  }

  // Move the playhead.
  now(time) {
    if (time === this.time) return;
    this.time = time;
    this.head.style.setProperty("--at", time);
    for (const [name, value] of Object.entries({ valuemin: 0, valuemax: this.reach, valuenow: time })) this.ruler.setAttribute(`aria-${name}`, value.toFixed(2));
  }
}

// The outline of keyframes: how far their FAPs are from rest, beside the most, at up to 60 keys.
function movement({ keys }, amount) {
  const some = keys.filter((_, k) => k % Math.ceil(keys.length / 60) === 0);
  const sizes = some.map(([, ...values]) => Math.hypot(...values));
  const most = Math.max(...sizes) || 1;
  return some.map(([time], k) => `${((100 * time) / keys.at(-1)[0]).toFixed(1)}% ${(100 - (100 * amount * sizes[k]) / most).toFixed(1)}%`).join(", ");
}
