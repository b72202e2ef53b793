// What mouse, touch and keys do to the blocks of the designer's lanes.
import { ms } from "./model.js";

const SNAP = 7; // px
const TALL = 44; // px over which the amount of a block goes from 0 to 1
const LEAST = 0.04; // s of an onset and an offset

export class Gestures {
  // The nearest word, sync point, block or time 0 within a few pixels, or the time itself.
  snapped(time, without) {
    const { design } = this;
    const edges = design.shown.channel.flatMap((one) => design.blocks(one, without)).flatMap(({ start, end }) => [start, end]);
    const near = [0, ...edges, ...design.speech.words.flatMap(([start, end]) => [start, end]), ...(design.speech.syncs ?? []).map(([time]) => time)].filter((edge) => Math.abs(edge - time) * this.scale < SNAP);
    const best = near.toSorted((a, b) => Math.abs(a - time) - Math.abs(b - time))[0];
    this.line.hidden = best === undefined;
    if (best !== undefined) this.line.style.setProperty("--at", best);
    return best ?? time;
  }

  grab(event) {
    const block = event.target.closest(".d-block");
    if (!block || event.button) return;
    const { design } = this;
    const part = event.target.dataset.part ?? "body";
    const began = { edges: this.edges(), x: event.clientX, y: event.clientY, entry: block.entry, span: design.span(block.entry), lane: design.find(block.entry)[0] };
    let { entry } = began;
    let moved = false;
    design.select(entry);
    const move = (now) => {
      moved ||= Math.hypot(now.clientX - began.x, now.clientY - began.y) > 3;
      if (!moved) return;
      this.dragging = true;
      const by = (now.clientX - began.x) / this.scale;
      entry = this.drag(part, began, entry, by, now);
    };
    const end = (commit) => {
      removeEventListener("pointermove", move);
      removeEventListener("keydown", escape, true);
      this.dragging = false;
      this.fit();
      this.line.hidden = true;
      if (moved) commit ? design.end() : design.cancel();
      if (moved && !commit) design.select(began.entry);
      this.focus(design.selected);
    };
    const escape = (key) => key.key === "Escape" && end(false);
    addEventListener("pointermove", move);
    addEventListener("pointerup", () => end(true), { once: true });
    addEventListener("pointercancel", () => end(true), { once: true });
    addEventListener("keydown", escape, true);
    event.preventDefault();
    this.focus(entry);
  }

  // A step of a drag, from the state at its begin; return the entry.
  drag(part, { edges, span, lane, entry: first, y }, entry, by, { clientY, altKey, shiftKey }) {
    const { design } = this;
    const snap = (time) => (shiftKey ? time : this.snapped(time, entry));
    design.preview = null;
    const reset = design.find(first) ? first : entry;
    if (part === "body") {
      const at = this.laneAt(clientY, edges);
      const over = at < 0 ? lane : Math.min(at, design.shown.channel.length - 1);
      const free = [snap(span.start + by), snap(span.end + by) - (span.end - span.start)];
      const start = Math.abs(free[0] - span.start - by) > 1e-9 ? free[0] : free[1];
      return design.place(reset, over, ms(start), false);
    }
    if (part === "amount") return design.change(reset, { intensity: ms(Math.min(1, Math.max(0, (first.intensity ?? 1) + (y - clientY) / TALL))) }, false);
    if (part === "onset") return design.change(reset, { onset: ms(Math.min(span.left - span.start, Math.max(LEAST, snap(span.reached + by) - span.start))) }, false);
    if (part === "offset") return design.change(reset, { offset: ms(Math.min(span.end - span.reached, Math.max(LEAST, span.end - snap(span.left + by)))) }, false);
    const length = part === "end" ? snap(span.end + by) - span.start : span.end - snap(span.start + by);
    return this.resize(reset, length, altKey, part === "start" ? lane : null, false);
  }

  // Change the length of a block; from its start if `lane` is given.
  resize(entry, length, free, lane, commit) {
    const { design } = this;
    const [duration, words] = design.limited(entry, length, free);
    const { end } = design.span(entry);
    const made = design.change(entry, { duration }, lane === null ? commit : false);
    const shown = lane === null ? made : design.place(made, lane, ms(end - duration), commit);
    if (words) this.told(words);
    return shown;
  }

  key(event) {
    const { design } = this;
    const { entry } = event.target;
    if (!entry) return;
    const [lane, k] = design.find(entry);
    const way = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: -1, ArrowDown: 1 }[event.key];
    const across = /Left|Right/.test(event.key);
    const { start, end } = design.span(entry);
    if (way && event.shiftKey && across) design.place(entry, lane, ms(Math.max(0, start + way * design.frame)));
    else if (way && event.shiftKey) {
      const to = lane + way;
      if (to < 0) return;
      if (to >= design.shown.channel.length) design.addLane();
      design.place(entry, to, start);
    } else if (way && (event.ctrlKey || event.metaKey) && across) this.resize(entry, end - start + way * design.frame, event.altKey, null);
    else if (way && across) this.choose(design.blocks(design.shown.channel[lane]).map((one) => one.entry), entry, way);
    else if (way) this.jump(lane, way, (start + end) / 2);
    else if (event.key === "+" || event.key === "=" || event.key === "-") design.change(entry, { intensity: ms(Math.min(1, Math.max(0, (entry.intensity ?? 1) + (event.key === "-" ? -0.05 : 0.05)))) });
    else if (event.key === "Delete" || event.key === "Backspace") design.remove(entry);
    else if (event.key === "d" && !event.ctrlKey) design.duplicate(entry);
    else if (event.key === "a" && !event.ctrlKey) {
      const mine = this.companions.findIndex((one) => one.track === lane && one.entry === k);
      if (mine >= 0) this.accept(mine);
    } else if (event.key === "Enter") return void (event.preventDefault(), this.inspect());
    else return;
    event.preventDefault();
    event.stopPropagation();
    this.focus(design.selected);
  }

  choose(entries, entry, way) {
    const next = entries[entries.indexOf(entry) + way];
    if (next) this.design.select(next);
  }

  // The block of the next lane that is nearest in time.
  jump(lane, way, time) {
    const { channel } = this.design.shown;
    for (let to = lane + way; channel[to]; to += way) {
      const near = this.design.blocks(channel[to]).toSorted((a, b) => Math.abs(a.start + a.end - 2 * time) - Math.abs(b.start + b.end - 2 * time))[0];
      if (near) return this.design.select(near.entry);
    }
  }
}
