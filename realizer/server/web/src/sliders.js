// Sliders for every action unit and side, and for every FAP; they show what the pose holds, else what the face does.
import { make } from "./dom.js";

const NEAR = 1024; // FAPU: range of a slider; the number beside it accepts the whole range of the table
const ANGLES = 100_000; // 1e-5 rad: range of eyes and head

// Rows under headings, and a search field.
class Sliders {
  constructor(panel, search, pose) {
    Object.assign(this, { panel, pose, rows: [], seen: {} });
    search.oninput = () => this.find(search.value.trim().toLowerCase());
    pose.addEventListener("change", () => this.refresh());
  }

  fill(groups, rowOf) {
    this.rows = [];
    this.panel.replaceChildren(
      ...groups.map(({ name, members }) => {
        const rows = members.map(rowOf).filter(Boolean);
        this.rows.push(...rows);
        return make("fieldset.group", {}, this.heading(name, rows), ...rows.map((row) => row.element));
      }),
    );
    this.refresh();
  }

  heading(name) {
    return make("legend", {}, name);
  }

  find(words) {
    for (const row of this.rows) row.element.hidden = !row.words.includes(words);
    for (const group of this.panel.children) group.hidden = [...group.querySelectorAll(".row")].every((row) => row.hidden);
    this.panel.classList.toggle("none", this.rows.every((row) => row.element.hidden));
  }

  // Show what the face does: name -> value of a frame.
  see(values) {
    this.seen = values;
    if (this.panel.offsetParent) this.refresh();
  }

  refresh() {
    for (const row of this.rows) row.refresh();
  }
}

export function slider(label, low, high, step, changed) {
  const input = make("input", { type: "range", min: low, max: high, step, value: 0, ariaLabel: label });
  input.oninput = () => changed(Number(input.value));
  return input;
}

// A slider that shows its distance from neutral.
export function show(input, value) {
  if (Number(input.value) !== value) input.value = value;
  const [low, high] = [Number(input.min), Number(input.max)];
  const place = (x) => (100 * (Math.min(high, Math.max(low, x)) - low)) / (high - low);
  const ends = [place(0), place(value)];
  input.style.setProperty("--from", `${Math.min(...ends)}%`);
  input.style.setProperty("--to", `${Math.max(...ends)}%`);
}

export class ActionUnits extends Sliders {
  know({ aus, groups }) {
    const known = new Map(aus.map((row) => [row.au, row]));
    this.fill(groups.aus, (number) => known.has(number) && this.row(known.get(number)));
  }

  heading(name, rows) {
    if (rows.every(({ element }) => element.classList.contains("middle"))) return super.heading(name);
    return make("legend.sides", {}, make("span", {}, name), make("span.side", {}, "right"), make("span.side", {}, "left"));
  }

  // Both sides move together until the user separates them.
  row({ au, name, sides }) {
    const { pose } = this;
    const names = sides ? [`${au}R`, `${au}L`] : [String(au)];
    let together = true;
    const set = (name, value) => {
      const touched = together ? names : [name];
      pose.set({ aus: Object.fromEntries(touched.map((one) => [one, value || null])) });
    };
    const inputs = names.map((one) => slider(`AU ${au} ${name}${sides ? (one.endsWith("R") ? ", right" : ", left") : ""}`, 0, 1, 0.01, (value) => set(one, value)));
    const link = make("button.link", { type: "button", title: "Both sides together", ariaLabel: `AU ${au}: both sides together`, ariaPressed: "true" });
    link.onclick = () => {
      together = !together;
      link.ariaPressed = String(together);
    };
    const value = make("output");
    const element = make("div.row.au", {}, make("b", {}, String(au)), make("span", { title: name }, name), ...(sides ? [inputs[0], link, inputs[1]] : inputs), value);
    if (!sides) element.classList.add("middle");
    const refresh = () => {
      const words = names.map((one) => Math.round(100 * (pose.aus.get(one) ?? this.seen[one] ?? 0)));
      inputs.forEach((input, k) => show(input, words[k] / 100));
      element.classList.toggle("held", names.some((one) => pose.aus.has(one)));
      value.textContent = words.some(Boolean) ? [...new Set(words)].join(" | ") : "";
    };
    return { element, refresh, words: `au${au} ${au} ${name}`.toLowerCase() };
  }
}

export class Faps extends Sliders {
  know({ faps, groups }) {
    const known = new Map(faps.map((row) => [row.fap, row]));
    this.fill(groups.faps, (number) => this.row(known.get(number)));
  }

  row({ fap, name, unit, least, most }) {
    const { pose } = this;
    const reach = unit === "angle_unit" ? ANGLES : NEAR;
    const set = (value) => pose.set({ faps: { [name]: value || null } });
    const words = name.replaceAll("_", " ");
    const input = slider(`FAP ${fap} ${words}`, Math.max(least, -reach), Math.min(most, reach), unit === "angle_unit" ? 500 : 5, set);
    const number = make("input", { type: "number", min: least, max: most, step: "any", ariaLabel: `FAP ${fap} ${words}, value` });
    number.onchange = () => set(Math.min(most, Math.max(least, Number(number.value) || 0)));
    const element = make("div.row.fap", {}, make("b", {}, String(fap)), make("span", { title: `${name}, in ${unit}` }, words), input, number);
    const refresh = () => {
      const value = Math.round(pose.faps.get(name) ?? this.seen[name] ?? 0);
      show(input, value);
      if (document.activeElement !== number) number.value = value;
      element.classList.toggle("held", pose.faps.has(name));
    };
    return { element, refresh, words: `f${fap} ${fap} ${words}` };
  }
}
