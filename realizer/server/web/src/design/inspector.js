// The fields of the chosen block, of its channel, and of the whole timeline.
import { at, make } from "../dom.js";
import { isKeys, ms, titleOf } from "./model.js";

const WHOLE = { joins: ["both", "onset", "offset"], curve: ["linear", "smooth"], mixer: ["additive", "successive"] };

export class Inspector {
  // marks(entry): advice on an entry. edit(row): look at an expression's action units.
  constructor(design, { marks, edit, lanes }) {
    Object.assign(this, { design, marks, edit, lanes, panel: at("design-inspector") });
    for (const event of ["select", "commit"]) design.addEventListener(event, () => this.draw());
    this.draw();
  }

  draw() {
    if (this.lanes.dragging) return; // the fields follow at its end
    const { design, panel } = this;
    const focused = panel.contains(document.activeElement) ? document.activeElement.ariaLabel : null;
    const { selected: entry } = design;
    const channel = design.shown.channel[design.lane] ?? design.shown.channel[0];
    panel.replaceChildren(...(entry && design.find(entry) ? this.block(entry) : [make("p.hint", {}, "Choose a block to see its fields.")]), this.channel(channel), this.whole());
    if (focused) [...panel.querySelectorAll("[aria-label]")].find(({ ariaLabel }) => ariaLabel === focused)?.focus();
  }

  block(entry) {
    const { design } = this;
    const [lane] = design.find(entry);
    const { start, end } = design.span(entry);
    const { onset, offset } = design.times(entry);
    const set = (name) => (value) => design.change(entry, { [name]: value });
    const advice = this.marks(entry);
    const row = design.row(entry);
    return [
      make("h3", {}, titleOf(entry)),
      make("div.d-fields", {},
        number("Start", start, 0, (value) => design.place(entry, lane, value)),
        number("Length", end - start, 0.04, (value) => this.lanes.resize(entry, value, false, null)),
        ...(isKeys(entry) ? [] : [number("Onset", onset, 0.04, set("onset")), number("Offset", offset, 0.04, set("offset"))]),
        number("Amount", entry.intensity ?? 1, 0, set("intensity"), 1),
      ),
      ...advice.map(({ text, hint, impossible }) => make(`p.d-says${impossible ? ".bad" : ""}`, {}, `${text}; ${hint}`)),
      ...(entry.because ? [make("p.hint", {}, `because ${entry.because}`)] : []),
      ...(isKeys(entry) ? [make("p.hint", {}, `${entry.keys.length} keyframes, which override what expressions give these FAPs.`)] : row ? [] : [make("p.d-says.bad", {}, `There is no expression ${entry.expression}; the timeline is not played with it.`)]),
      make("div.d-row", {}, press("Duplicate", () => design.duplicate(entry)), press("Delete", () => design.remove(entry)), ...(row ? [press("Action units", () => this.edit(row))] : [])),
    ];
  }

  channel(channel) {
    const { design } = this;
    const set = (name) => (value) => design.setLane(design.lane, { [name]: value });
    const name = make("input", { type: "search", value: channel.name, ariaLabel: "Name of the channel", size: 8 });
    name.onchange = () => name.value.trim() && set("name")(name.value.trim());
    return make("fieldset.d-fields", {}, make("legend", {}, "Channel"), label("Name", name), pick("Joins", WHOLE.joins, channel.joins, set("joins")), pick("Curve", WHOLE.curve, channel.curve, set("curve")), press("Remove", () => design.removeLane(design.lane)));
  }

  whole() {
    const { design } = this;
    const set = (fields) => design.show({ timeline: { ...design.shown, ...fields } });
    const order = make("input", { type: "search", value: (design.shown.order ?? []).join(" "), placeholder: "4 1 2", ariaLabel: "Order of action units", size: 8 });
    order.onchange = () => set({ order: order.value.split(/[\s,]+/).filter(Boolean).map(Number) });
    return make("fieldset.d-fields", {}, make("legend", {}, "All channels"), pick("Mixer", WHOLE.mixer, design.shown.mixer, (mixer) => set({ mixer })), label("Order", order));
  }
}

export function press(words, act) {
  const button = make("button.small", { type: "button" }, words);
  button.onclick = act;
  return button;
}

function label(words, field) {
  return make("label", {}, make("span", {}, words), field);
}

function number(words, value, min, set, max = 3600) {
  const field = make("input", { type: "number", min, max, step: max === 1 ? 0.05 : 0.04, value: ms(value), ariaLabel: max === 1 ? words : `${words}, seconds` });
  field.onchange = () => Number.isFinite(field.valueAsNumber) && set(Math.min(max, Math.max(min, field.valueAsNumber)));
  return label(words, field);
}

function pick(words, names, value, set) {
  const field = make("select", { ariaLabel: words }, ...names.map((name) => make("option", { value: name, selected: name === value }, name)));
  field.onchange = () => set(field.value);
  return label(words, field);
}
