// The 84 feature points: markers on the head, the list, and the point that is asked for next.
import { make } from "../dom.js";
import { Marks } from "./marks.js";

const INSIDE = new Set(["7.1", "11.5"]); // points that lie on no skin
// Lines of the small drawing, from point to point of the template.
const LINES = ["11.4 11.2 10.10 10.2 10.6 2.14 2.12 2.1 2.11 2.13 10.5 10.1 10.9 11.3 11.4", "4.6 4.4 4.2", "4.5 4.3 4.1", "3.12 3.2 3.8 3.4 3.12", "3.7 3.1 3.11 3.3 3.7", "8.4 8.6 8.10 8.1 8.9 8.5 8.3 8.7 8.2 8.8 8.4", "2.5 2.7 2.2 2.6 2.4 2.8 2.3 2.9 2.5", "9.1 9.15 9.2", "9.6 9.13", "9.7 9.14"];
const PROFILE = ["11.4 11.1 9.12 9.3 9.15 8.1 2.2", "2.3 8.2 2.10 2.1 2.13 10.7 10.5", "4.5 4.3 4.1", "3.1 3.7 3.3", "10.1 10.3 10.5 10.9 10.1"];

export class Points {
  // layer: the element over the canvas; panel: the one of the tab; said(text): a note.
  constructor(panel, layer, draft, view, said) {
    Object.assign(this, { panel, draft, view, said, chosen: "2.1", marks: new Marks(layer, view, this) });
    const button = (text, click) => Object.assign(make("button", { type: "button" }, text), { onclick: click });
    this.front = make("div.face-drawing");
    this.question = make("p", { role: "status" });
    this.keepButton = button("It is right", () => this.draft.ask(this.draft.state.asked.slice(1)));
    this.copyButton = button("Copy from the other side", () => this.draft.copyPoint(this.chosen));
    const both = make("input", { type: "checkbox", checked: true });
    both.onchange = () => (draft.together = both.checked);
    this.list = make("select", { ariaLabel: "Feature point", size: 7 });
    this.list.onchange = () => this.choose(this.list.value);
    this.again = button("Place all by hand", () => draft.ask(this.names));
    panel.append(
      make("div.face-asked", {}, this.front, make("div", {}, this.question, make("div.finder", {}, this.keepButton, this.again))),
      this.list,
      make("div.finder", {}, make("label.check", {}, both, " both sides together"), this.copyButton),
      make("p.hint", {}, "Click on the head to place the point, or drag its mark; the handles move it along one axis. Arrow keys move it by half a millimetre, Page Up and Down forwards and back, Shift further."),
    );
  }

  begin({ says, template }) {
    Object.assign(this, { says, template, names: Object.keys(says) });
    this.marks.begin(this.names.map((name) => [name, `Feature point ${name}: ${says[name]}`]));
    this.list.replaceChildren(...this.names.map((name) => make("option", { value: name }, `${name}  ${says[name]}`)));
    this.refresh();
  }

  get asked() {
    return this.draft.state?.asked[0];
  }

  // focused: by the keyboard, which leaves a point that is asked for.
  choose(name, focused = false) {
    if (focused && this.asked) return;
    this.chosen = name;
    this.refresh();
  }

  refresh() {
    const { asked } = this.draft.state;
    if (asked.length) this.chosen = asked.includes(this.chosen) && this.asked !== this.chosen ? this.asked : asked[0];
    const name = this.chosen;
    this.list.value = name;
    this.question.replaceChildren(make("b", {}, asked.length ? `Click on ${name}` : name), ` ${this.says[name]}`, ...(asked.length ? [make("span.hint", {}, ` ${asked.length} to look at`)] : []));
    this.keepButton.hidden = !asked.length;
    this.copyButton.disabled = !this.draft.other.get(name) || this.draft.other.get(name) === name;
    this.front.replaceChildren(this.drawing(name, LINES, 0, 1), this.drawing(name, PROFILE, 2, -1));
    this.view.stale = true;
  }

  // A face from in front (x across) or from its left (z across), with the point on it.
  drawing(name, lines, axis, way) {
    const at = (point) => [way * this.template[point][axis] * 20 + (axis ? -6 : 0), -20 * this.template[point][1]];
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    svg.setAttribute("viewBox", "-36 -38 72 84");
    svg.ariaHidden = "true";
    const [x, y] = at(name);
    const paths = lines.map((line) => `<path d="${curved(line.split(" ").map(at))}"/>`);
    svg.innerHTML = `${paths.join("")}<circle cx="${x.toFixed(1)}" cy="${y.toFixed(1)}" r="3.2"/>`;
    return svg;
  }

  // Put the chosen point where the pixel meets the head.
  click(x, y) {
    const hit = this.view.hit(x, y);
    if (!hit) return this.said("There is no head under the pointer: click on the head.");
    this.draft.place(this.chosen, hit.place);
    this.said(`${this.chosen} ${this.says[this.chosen]}`);
  }

  // A click on a mark is one on the head where a point is asked for, and chooses it otherwise.
  pressed(name, x, y) {
    this.asked ? this.click(x, y) : this.choose(name);
  }

  // What the marks need: places of points, and how they move.
  place(name) {
    return this.draft.state.points[name];
  }

  move(name, to, word) {
    this.draft.place(name, to, word);
  }

  rest() {
    this.draft.rest();
  }

  snaps(name) {
    return !INSIDE.has(name);
  }

  lay() {
    this.marks.lay((name) => !this.view.faces(this.draft.mesh.nearest(this.place(name))));
    for (const [name, mark] of this.marks.marks) mark.classList.toggle("asked", this.draft.state.asked.includes(name));
  }
}

// A smooth line through the middles of an outline's sides; its ends stay, or meet if they are one.
function curved(places) {
  const words = ([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`;
  const middle = (k) => [0, 1].map((axis) => (places[k][axis] + places[k + 1][axis]) / 2);
  const last = places.length - 1;
  const closed = words(places[0]) === words(places[last]);
  const parts = places.slice(1, last).map((place, k) => `Q${words(place)} ${words(k + 2 === last ? places[last] : middle(k + 1))}`);
  return closed ? `M${words(middle(0))}${places.slice(1, last).map((place, k) => `Q${words(place)} ${words(middle(k + 1))}`).join("")}Q${words(places[0])} ${words(middle(0))}` : `M${words(places[0])}${parts.join("")}${last === 1 ? `L${words(places[1])}` : ""}`;
}
