// The library of the designer: expressions with pictures, found by word, meaning or action units.
import { at, make } from "../dom.js";
import { keyOf, titleOf } from "./model.js";

const COLUMNS = 8; // of the sheet of pictures
const AGAIN = 1000; // ms; pictures that are being drawn are asked for again

export class Strip {
  // ask(request): the service's answer. add(expression, event): use it; the event is where it was dropped.
  constructor(ask, design, add) {
    Object.assign(this, { ask, design, add, order: new Map(), pictures: new Map() });
    this.panel = at("design-cards");
    at("design-find").oninput = () => this.find(at("design-find").value.trim());
  }

  // Read the library, and its pictures of a face when they are drawn.
  async load(face) {
    const { expressions, moods } = await this.ask({ tool: "library" });
    if (at("design-mood").length === 1) at("design-mood").append(...moods.map((mood) => make("option", { value: mood }, mood)));
    this.order = new Map(expressions.map(({ name }, k) => [name, k]));
    this.design.rows = new Map(expressions.map((row) => [keyOf(row.name), row]));
    this.design.dispatchEvent(new Event("change"));
    await this.find(at("design-find").value.trim(), expressions);
    this.draw(face).catch(() => {});
  }

  // Show the pictures of the library; the service may draw them for a while.
  async draw(face) {
    this.face = face;
    const { picture, drawing } = await this.ask({ tool: "pictures", face });
    if (face !== this.face) return;
    if (drawing) return setTimeout(() => face === this.face && this.draw(face).catch(() => {}), AGAIN);
    this.panel.style.setProperty("--sheet", `url("data:image/webp;base64,${picture}")`);
    this.panel.style.setProperty("--rows", Math.ceil(this.order.size / COLUMNS));
    this.pictures = this.order;
    this.panel.classList.add("drawn");
    for (const card of this.panel.querySelectorAll(".d-card")) this.picture(card);
  }

  async find(words, all) {
    const asked = (this.asked = words);
    let found = all;
    try {
      found ??= (await this.ask({ tool: "library", find: words })).expressions;
    } catch (error) {
      return this.none(error.message);
    }
    if (asked !== this.asked) return;
    if (!found.length) return this.none("Nothing has this name. Make it under Expression, and save it to the library.");
    // Without a search those first about whose lengths and company something is known.
    const known = words ? found : found.toSorted((a, b) => b.name.startsWith("template:") - a.name.startsWith("template:"));
    this.panel.replaceChildren(...known.map((row) => this.card(row)));
  }

  none(words) {
    this.panel.replaceChildren(make("p.hint", {}, words));
  }

  card(row) {
    const { name, features, means, units } = row;
    const face = make("i.thumb", { ariaHidden: "true" });
    const title = `${name}: ${features || means.join(", ")} (${units})`;
    const card = make("button.d-card", { type: "button", title, ariaLabel: `Add ${titleOf({ expression: name })}: ${features || means.join(", ")}` }, face, make("b", {}, titleOf({ expression: name })), make("span", {}, units));
    card.expression = name;
    this.picture(card);
    card.onclick = () => this.dropped || this.add(row);
    card.onpointerdown = (event) => this.drag(event, row, card);
    return card;
  }

  // Show the place of its expression on the sheet of pictures; a new one is not on it yet.
  picture(card) {
    const k = this.pictures.get(card.expression);
    card.classList.toggle("blank", k === undefined);
    card.style.setProperty("--x", (k ?? 0) % COLUMNS);
    card.style.setProperty("--y", Math.floor((k ?? 0) / COLUMNS));
  }

  // Drag a card to a lane. A finger that moves up or down scrolls instead.
  drag(began, row, card) {
    this.dropped = false;
    const move = ({ clientX, clientY }) => {
      if (!this.dropped && Math.hypot(clientX - began.clientX, clientY - began.clientY) < 8) return;
      this.dropped = true;
      this.shade ??= document.body.appendChild(Object.assign(card.cloneNode(true), { className: "d-card d-shade drawn", ariaHidden: "true" }));
      this.shade.style.translate = `${clientX - 40}px ${clientY - 30}px`;
      this.shade.style.cssText += `;--sheet:${this.panel.style.getPropertyValue("--sheet")};--rows:${this.panel.style.getPropertyValue("--rows")}`;
    };
    const end = (event) => {
      removeEventListener("pointermove", move);
      removeEventListener("pointerup", end);
      removeEventListener("pointercancel", end);
      this.shade?.remove();
      this.shade = null;
      if (this.dropped && event.type === "pointerup") this.add(row, event);
      setTimeout(() => (this.dropped = false)); // after the click that may follow
    };
    addEventListener("pointermove", move);
    addEventListener("pointerup", end);
    addEventListener("pointercancel", end);
  }
}
