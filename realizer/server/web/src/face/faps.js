// One FAP: its zone of influence, its mask, and the slider that tests it.
import { choose, make } from "../dom.js";
import { show, slider } from "../sliders.js";
import { FALLOFFS, influence } from "./zones.js";

const SWEEP = 700; // ms for each FAP
// Sliders of a zone: name, words, factor of what is shown, least, most, step; for which falloff.
const VALUES = [
  ["size", "size, mm", 1000, 1, 150, 0.1], ["x", "scale x", 1, 0.1, 4, 0.01], ["y", "scale y", 1, 0.1, 4, 0.01], ["z", "scale z", 1, 0.1, 4, 0.01],
  ["ease", "ease", 1, -100, 100, 1, "ease"], ["smooth_centre", "smooth centre", 100, 0, 100, 1, "smooth"], ["smooth_side", "smooth side", 100, 0, 100, 1, "smooth"],
  ["slide", "slide forwards", 1, -2, 2, 0.01], ["radial", "radial", 1, 0, 1, 0.01],
];
const AXES = ["x", "y", "z"];

export class FapPanel {
  // hands: { test(fap, value), score(faps), said(text) }
  constructor(panel, draft, hands) {
    Object.assign(this, { panel, draft, hands, fap: 4, value: 0, scores: new Map(), tool: null });
    const button = (text, click, more = {}) => Object.assign(make("button", { type: "button", ...more }, text), { onclick: click });
    const tick = (text, changed) => {
      const input = make("input", { type: "checkbox" });
      input.onchange = () => changed(input.checked);
      return [input, make("label.check", {}, input, ` ${text}`)];
    };
    this.list = make("select", { ariaLabel: "FAP" });
    this.list.onchange = () => this.choose(Number(this.list.value));
    this.test = slider("Test", -1024, 1024, 1, (value) => this.try(value));
    this.output = make("output");
    this.range = "usual";
    const ranges = make("div.segments", { role: "group", ariaLabel: "Range of the test" });
    choose(ranges, ["usual", "whole"], "usual", (name) => {
      this.range = name;
      this.refresh();
    });
    this.sweepButton = button("Sweep all", () => this.sweep(), { ariaPressed: "false" });
    this.why = make("ul.face-why", { ariaLabel: "Score" });
    let label;
    [this.sync, this.syncLabel] = tick("keep both sides alike", (on) => draft.sync(this.fap, on));
    this.copyButton = button("Copy from the other side", () => draft.copy(this.fap));
    this.falloff = make("select", { ariaLabel: "Falloff" }, ...FALLOFFS.map((name) => make("option", {}, name)));
    this.falloff.onchange = () => draft.set(this.fap, { falloff: this.falloff.value });
    this.curve = make("div.face-curve");
    this.values = VALUES.map((row) => this.row(row));
    [this.useMask, label] = tick("use the mask", (on) => draft.set(this.fap, on ? { use_mask: true } : { use_mask: false, invert_mask: false }));
    const useLabel = label;
    [this.invert, label] = tick("invert", (on) => draft.set(this.fap, { use_mask: true, invert_mask: on }));
    this.tools = make("div.segments", { role: "group", ariaLabel: "Mask tools" });
    this.grain = slider("Size of the brush, mm", 1, 30, 1, () => {});
    show(this.grain, 6);
    this.grain.oninput = () => show(this.grain, this.grain.valueAsNumber);
    const [erase, eraseLabel] = tick("take away", () => {});
    this.erase = erase;
    this.maskButtons = [["Grow", true], ["Shrink", false]].map(([text, more]) => button(text, () => draft.mask(this.fap, draft.mesh.grownMask(this.mask, more))));
    this.maskButtons.push(button("All", () => draft.mask(this.fap, this.mask.map((_, i) => Number(i >= draft.mesh.skin[0] && i < draft.mesh.skin[1])))), button("None", () => draft.mask(this.fap, new Uint8Array(draft.mesh.count))));
    this.body = make("div.face-zone", {}, make("div.finder", {}, this.falloff, this.curve), ...this.values.map(({ element }) => element), make("div.finder", {}, useLabel, label, this.tools, eraseLabel), make("div.finder", {}, ...this.maskButtons), make("div.row.zone", {}, make("span", {}, "brush, mm"), this.grain));
    panel.append(
      make("div.finder", {}, button("‹", () => this.step(-1), { ariaLabel: "Previous FAP" }), this.list, button("›", () => this.step(1), { ariaLabel: "Next FAP" }), this.sweepButton),
      make("div.row.zone.test", {}, make("span", {}, "test"), this.test, this.output), make("div.finder", {}, ranges, this.syncLabel, this.copyButton), this.why, this.body,
    );
  }

  row([name, words, factor, least, most, step, only]) {
    const value = (zone) => (AXES.includes(name) ? zone.scale[AXES.indexOf(name)] : zone[name]) * factor;
    const set = (shown) => {
      const zone = this.draft.state.zones.get(this.fap);
      const next = AXES.includes(name) ? { scale: zone.scale.map((x, k) => (AXES[k] === name ? shown / factor : x)) } : { [name]: shown / factor };
      this.draft.set(this.fap, next, `Zone ${this.fap} ${name}:`);
    };
    const input = slider(words, least, most, step, set);
    input.onchange = () => this.draft.rest();
    const number = make("input", { type: "number", min: least, max: most, step: "any", ariaLabel: `${words}, value` });
    number.onchange = () => set(Math.min(most, Math.max(least, Number(number.value) || least)));
    const refresh = (zone) => {
      element.hidden = Boolean(only) && zone.falloff !== only;
      show(input, value(zone));
      if (document.activeElement !== number) number.value = Number(value(zone).toPrecision(4));
    };
    const element = make("div.row.zone", {}, make("span", {}, words), input, number);
    return { element, refresh };
  }

  begin(head) {
    this.scores.clear();
    this.value = 0;
    this.list.replaceChildren(...head.faps.map(({ fap, name }) => make("option", { value: fap }, `${fap} ${name.replaceAll("_", " ")}`)));
    choose(this.tools, ["look", "brush", "lasso"], "look", (name) => (this.tool = name === "look" ? null : name));
    this.tool = null;
    this.refresh();
  }

  get mask() {
    return this.draft.state.masks.get(this.fap) ?? new Uint8Array(this.draft.mesh.count);
  }

  choose(fap) {
    this.fap = fap;
    this.try(0);
    this.refresh();
  }

  step(by) {
    const all = this.draft.head.faps.map(({ fap }) => fap);
    this.choose(all[(all.indexOf(this.fap) + by + all.length) % all.length]);
  }

  try(value) {
    this.value = value;
    show(this.test, value);
    this.output.textContent = Math.round(value);
    this.hands.test(this.fap, value);
  }

  // Move every FAP once there and back; a second call stops.
  sweep() {
    if (this.sweeping) return this.stop();
    this.sweepButton.ariaPressed = "true";
    this.sweepButton.textContent = "Stop";
    this.sweeping = { begin: performance.now(), first: this.draft.head.faps.findIndex(({ fap }) => fap === this.fap) };
  }

  stop() {
    this.sweeping = null;
    this.sweepButton.ariaPressed = "false";
    this.sweepButton.textContent = "Sweep all";
    this.try(0);
  }

  // The next picture of a sweep.
  tick(now) {
    if (!this.sweeping) return;
    const { faps } = this.draft.head;
    const at = (now - this.sweeping.begin) / SWEEP;
    if (at >= faps.length) return this.stop();
    const row = faps[(this.sweeping.first + Math.floor(at)) % faps.length];
    if (row.fap !== this.fap) this.choose(row.fap);
    const [least, most] = row.usual;
    const turn = Math.sin(2 * Math.PI * (at % 1));
    this.try(turn > 0 ? turn * most : -turn * least);
  }

  refresh() {
    const { state, rows } = this.draft;
    const row = rows.get(this.fap);
    const zone = state.zones.get(this.fap);
    const [least, most] = this.range === "usual" ? row.usual : [row.least, row.most];
    Object.assign(this.test, { min: least, max: most, step: most > 5000 ? 50 : 1 });
    show(this.test, this.value);
    this.list.value = this.fap;
    for (const option of this.list.options) {
      const score = this.scores.get(Number(option.value))?.score;
      option.textContent = `${option.value} ${rows.get(Number(option.value)).name.replaceAll("_", " ")}${score === undefined ? "" : `  (${score} of 3)`}`;
    }
    this.sync.checked = state.synced.has(this.fap);
    this.syncLabel.hidden = this.copyButton.hidden = row.mirror === this.fap || !zone;
    this.body.hidden = !zone;
    this.showScore();
    if (!zone) return;
    this.falloff.value = zone.falloff;
    for (const { refresh } of this.values) refresh(zone);
    Object.assign(this.useMask, { checked: zone.use_mask });
    Object.assign(this.invert, { checked: zone.invert_mask });
    const line = Array.from({ length: 41 }, (_, k) => `${k * 2.5},${(32 - 30 * influence(zone, (k / 40) * (1 + zone.smooth_side))).toFixed(2)}`);
    this.curve.innerHTML = `<svg viewBox="0 0 100 34" role="img" aria-label="Influence from the centre to the edge"><polyline points="${line.join(" ")}"/></svg>`;
  }

  showScore() {
    const score = this.scores.get(this.fap);
    const moved = this.draft.state.zones.has(this.fap) ? (this.draft.state.by.has(this.fap) ? "" : "moved by the face's own shape until you change its zone") : "moved as a rigid part: it has no zone";
    this.why.classList.toggle("low", Boolean(score && score.score < 3));
    const lines = score ? [`${score.score} of 3 by rules${score.stale ? ", before the last change" : ""}`, ...score.why] : [];
    this.why.replaceChildren(...[...lines, moved].filter(Boolean).map((text) => make("li", {}, text)));
  }

  // Keep the scores of the service: the lower direction counts.
  know(rows) {
    for (const fap of new Set(rows.map((row) => row.fap))) {
      const both = rows.filter((row) => row.fap === fap).sort((a, b) => a.score - b.score);
      this.scores.set(fap, { score: both[0].score, why: [...new Set(both.flatMap(({ sign, why }) => why.map((text) => `${sign > 0 ? "+" : "−"} ${text}`)))] });
    }
    this.refresh();
  }
}
