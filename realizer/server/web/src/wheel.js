// The wheel of emotions: a click chooses an angle and an activation, and the face shows that emotion.
import { at, make } from "./dom.js";
import { ask } from "./service.js";

const RINGS = [1, 3, 5, 7]; // activations
const MOST = 7;
const RADIUS = 100; // of activation 7, in the picture's units
const SVG = "http://www.w3.org/2000/svg";
const KEYS = { ArrowLeft: ["angle", 5], ArrowRight: ["angle", -5], ArrowUp: ["activation", 0.5], ArrowDown: ["activation", -0.5] };

function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

const place = (angle, activation) => {
  const turn = (angle * Math.PI) / 180;
  const away = (RADIUS * activation) / MOST;
  return [away * Math.cos(turn), -away * Math.sin(turn)];
};

const rings = () => RINGS.map((ring) => svg("circle", { r: (RADIUS * ring) / MOST, class: "ring" }));

// A small wheel without names, and its dot.
export function dial() {
  const dot = svg("circle", { r: 8, class: "dot" });
  const picture = svg("svg", { viewBox: "-108 -108 216 216", role: "img", "aria-label": "Place on the wheel of emotions" }, ...rings(), dot);
  spot(dot, null);
  return [picture, dot];
}

// Move a dot to [angle, activation], or hide it.
export function spot(dot, where) {
  dot.style.display = where ? "" : "none";
  const [x, y] = place(...(where ?? [0, 0]));
  for (const [name, value] of Object.entries({ cx: x, cy: y })) dot.setAttribute(name, value);
}

export class Wheel {
  // told(message): a place that cannot be shown.
  constructor(panel, pose, told) {
    Object.assign(this, { panel, pose, told, place: null, asked: 0, mine: new Set() });
    at("profiles").onchange = () => this.profilesChanged();
    at("profile").onchange = () => this.show();
    at("feeling").onchange = () => this.word(at("feeling").value.trim());
    pose.addEventListener("change", () => this.follow());
  }

  know({ wheel, profiles, values }) {
    this.emotions = wheel;
    this.profiles = profiles;
    at("feelings").replaceChildren(...values["emotion name"].map((value) => make("option", { value })));
    this.draw();
    this.profilesChanged();
  }

  draw() {
    const root = svg("svg", { viewBox: "-168 -124 336 248", role: "slider", tabindex: "0", id: "wheel-face", "aria-label": "Place on the wheel of emotions; arrow keys turn it and change how strong it is" });
    const basic = this.emotions.filter((e) => e.kind === "basic");
    basic.forEach((emotion, k) => {
      const [from, to] = [emotion.angle - 22.5, emotion.angle + 22.5];
      const [x1, y1] = place(from, MOST);
      const [x2, y2] = place(to, MOST);
      root.append(svg("path", { d: `M0 0L${x1} ${y1}A${RADIUS} ${RADIUS} 0 0 0 ${x2} ${y2}Z`, class: `wedge wedge-${k}` }));
    });
    root.append(...rings());
    for (const { name, kind, angle } of this.emotions.filter((e) => e.kind !== "rest")) {
      const basic = kind === "basic";
      const [x, y] = place(angle, basic ? MOST * 1.1 : MOST * 0.87);
      const aside = Math.abs(x) < 8 || !basic ? "middle" : x > 0 ? "start" : "end";
      root.append(svg("text", { x, y: y + (Math.abs(x) < 8 && basic ? (y < 0 ? -1 : 7) : 3), class: kind, "text-anchor": aside }, name));
    }
    for (const { angle, activation, kind } of this.emotions) {
      if (activation === null || kind !== "basic") continue;
      const [cx, cy] = place(angle, activation);
      root.append(svg("circle", { cx, cy, r: 2, class: "anchor" }));
    }
    this.line = root.appendChild(svg("line", { class: "hand" }));
    this.dot = root.appendChild(svg("circle", { r: 6, class: "dot" }));
    root.onpointerdown = (event) => {
      root.setPointerCapture(event.pointerId);
      this.touch(event);
    };
    root.onpointermove = (event) => event.buttons && this.touch(event);
    root.onkeydown = (event) => this.key(event);
    this.root = root;
    this.panel.replaceChildren(root);
    this.mark();
  }

  touch(event) {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.root.getScreenCTM().inverse());
    const angle = ((Math.atan2(-point.y, point.x) * 180) / Math.PI + 360) % 360;
    at("profile").value = "";
    this.go(angle, Math.min(MOST, (MOST * Math.hypot(point.x, point.y)) / RADIUS));
  }

  key(event) {
    const step = KEYS[event.key];
    if (!step && event.key !== "Home") return;
    event.preventDefault();
    const now = this.place ?? { angle: 90, activation: 0 };
    const next = { ...now, activation: event.key === "Home" ? 0 : now.activation };
    if (step) next[step[0]] += step[1];
    at("profile").value = "";
    this.go((next.angle + 360) % 360, Math.min(MOST, Math.max(0, next.activation)));
  }

  go(angle, activation) {
    this.place = { angle: Math.round(angle * 10) / 10, activation: Math.round(activation * 100) / 100 };
    this.show();
  }

  // The profiles to choose from; ours are mixed by place only.
  profilesChanged() {
    const own = at("profiles").value === "own";
    const names = own ? [] : this.profiles[at("profiles").value];
    at("profile").replaceChildren(make("option", { value: "" }, "by its place"), ...names.map((name) => make("option", { value: name }, name)));
    at("profile").disabled = own;
    this.show();
  }

  word(name) {
    if (!name) return;
    at("profile").value = "";
    this.place = null;
    this.shows({ name });
  }

  show() {
    const one = at("profile").value;
    if (one) {
      const home = this.emotions.find((e) => e.name === one.split(" ")[0]);
      this.place = home && { angle: home.angle, activation: home.activation ?? MOST };
      this.shows({ name: one });
    } else if (this.place) this.shows(this.place);
    this.mark();
  }

  // Request the values of a place, then hold them; only the newest request counts.
  async shows(asked) {
    const profile = at("profiles").value;
    const number = ++this.asked;
    const query = new URLSearchParams({ of: JSON.stringify({ ...asked, profile }) });
    const answer = await ask(`feeling.json?${query}`);
    if (number !== this.asked) return;
    if (!answer.ok) return this.told((await answer.text()).trim());
    const { values, shares } = await answer.json();
    const parts = Object.entries(shares).sort(([, a], [, b]) => b - a).map(([name, share]) => `${name} ${Math.round(100 * share)} %`);
    const told = parts.length ? parts.join(", ") : asked.name ?? "neutral";
    at("feels").textContent = `${told}${asked.activation === undefined ? "" : `, activation ${asked.activation.toFixed(1)}`}`;
    at("moves").replaceChildren(...Object.entries(merged(values)).map(([name, value]) => make("li", {}, make("b", {}, name), String(value))));
    // Values set by hand stay; those of the last profile are released.
    const gone = Object.fromEntries([...this.mine].map((name) => [name, null]));
    this.mine = new Set(profile === "own" ? [] : Object.keys(values));
    this.setting = true;
    this.pose.set(profile === "own" ? { emotion: asked, faps: gone } : { emotion: null, faps: { ...gone, ...values } });
    this.setting = false;
    this.mark();
  }

  // Another client's pose: remove the hand.
  follow() {
    if (this.setting || !this.pose.empty) return;
    this.asked++;
    this.mine.clear();
    this.place = null;
    at("profile").value = at("feeling").value = "";
    at("feels").textContent = "neutral";
    at("moves").replaceChildren();
    this.mark();
  }

  mark() {
    if (!this.root) return;
    const { angle, activation } = this.place ?? { angle: 0, activation: 0 };
    const [x, y] = place(angle, activation);
    spot(this.dot, this.place && [angle, activation]);
    for (const [name, value] of Object.entries({ x2: x, y2: y })) this.line.setAttribute(name, value);
    this.line.style.display = this.place ? "" : "none";
    for (const [name, value] of Object.entries({ valuemin: 0, valuemax: 360, valuenow: Math.round(angle) })) this.root.setAttribute(`aria-${name}`, value);
    this.root.setAttribute("aria-valuetext", at("feels").textContent);
  }
}

// "12L" and "12R" of one value become "AU 12"; FAPs have names.
function merged(values) {
  const found = {};
  for (const [name, value] of Object.entries(values)) {
    const [, number, side] = /^(\d+)([LR]?)$/.exec(name) ?? [];
    if (!number) found[name.replaceAll("_", " ")] = Math.round(value);
    else if (side && values[`${number}L`] === values[`${number}R`]) found[`AU ${number}`] = value.toFixed(2);
    else found[`AU ${name}`] = value.toFixed(2);
  }
  const order = (name) => Number(/^AU (\d+)/.exec(name)?.[1] ?? Infinity);
  return Object.fromEntries(Object.entries(found).sort(([a], [b]) => (order(a) < order(b) ? -1 : Number(order(a) > order(b)))));
}
