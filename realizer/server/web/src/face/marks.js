// Marks over the picture of the head: dragged, moved by keys, and by three handles along the axes of the chosen one.
import { make } from "../dom.js";

const STEP = 0.0005; // m that an arrow key moves a mark; with Shift ten times as far
const WAYS = { ArrowLeft: [-1, 0, 0], ArrowRight: [1, 0, 0], ArrowUp: [0, 1, 0], ArrowDown: [0, -1, 0], PageUp: [0, 0, 1], PageDown: [0, 0, -1] };
const AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
const ARM = 46; // pixels from the mark to a handle whose axis lies in the picture
const SHORT = 14; // pixels; a handle nearer to its mark cannot be told from it

export class Marks {
  // layer: the element over the canvas, with an SVG before it for lines; owner: {
  //   names of marks -> place(name), move(name, to, word), choose(name), rest(); chosen: a name;
  //   snaps(name): whether a drag follows the skin; pressed(name, x, y): takes a click on a mark }
  constructor(layer, view, owner) {
    Object.assign(this, { layer, view, owner, marks: new Map() });
    this.group = make("div");
    this.handles = Object.entries(AXES).map(([name, way]) => {
      const handle = make(`button.fp.axis.${name}`, { type: "button", title: `Move along ${name}`, ariaLabel: `Move along ${name}` });
      const line = document.createElementNS("http://www.w3.org/2000/svg", "line");
      line.classList.add("axis", name);
      this.drag(handle, () => owner.chosen, ([dx, dy], place) => {
        const [ux, uy] = this.arm(place, way);
        const far = ((dx * ux + dy * uy) / (ux * ux + uy * uy)) * this.reach(place);
        return place.map((x, k) => x + far * way[k]);
      });
      handle.onkeydown = (event) => {
        const sign = { ArrowRight: 1, ArrowUp: 1, PageUp: 1, ArrowLeft: -1, ArrowDown: -1, PageDown: -1 }[event.key];
        if (sign) this.step(event, owner.chosen, way.map((x) => sign * x));
      };
      return { handle, line, way, name };
    });
    layer.append(this.group);
    layer.parentNode.querySelector("svg").append(...this.handles.map(({ line }) => line));
  }

  // Show other marks: rows of [name, words].
  begin(rows) {
    this.marks.clear();
    for (const [name, words] of rows) {
      const mark = make("button.fp", { type: "button", title: words, ariaLabel: words, tabIndex: -1 });
      this.marks.set(name, mark);
      this.drag(mark, () => name, ([dx, dy], place, spot) => {
        const hit = this.owner.snaps(name) && this.view.hit(...spot);
        const [right, up] = this.view.axes;
        const pixel = this.view.pixel(place);
        return hit ? hit.place : place.map((x, k) => x + pixel * (dx * right[k] - dy * up[k]));
      });
      mark.onkeydown = (event) => WAYS[event.key] && this.step(event, name, WAYS[event.key]);
      mark.onfocus = () => !mark.held && this.owner.choose(name, true);
    }
    this.group.replaceChildren(...this.marks.values(), ...this.handles.map(({ handle }) => handle));
  }

  drag(element, named, moved) {
    let last = null;
    const spot = (event) => {
      const box = this.layer.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    const mark = () => element === this.marks.get(named());
    element.onpointerdown = (event) => {
      Object.assign(element, { held: true, moved: false });
      last = spot(event);
      element.setPointerCapture(event.pointerId);
    };
    element.onpointermove = (event) => {
      if (!last) return;
      const [x, y] = spot(event);
      const by = [x - last[0], y - last[1]];
      if (!by[0] && !by[1]) return;
      last = [x, y];
      if (!element.moved && mark()) this.owner.choose(named(), true);
      element.moved = true;
      this.owner.move(named(), moved(by, this.owner.place(named()), [x, y]), `Drag ${named()}:`);
    };
    element.onpointerup = element.onpointercancel = (event) => {
      if (last && !element.moved && mark()) this.owner.pressed(named(), ...spot(event));
      last = null;
      element.held = false;
      this.owner.rest();
    };
  }

  // Move a mark by a key.
  step(event, name, way) {
    const far = STEP * (event.shiftKey ? 10 : 1);
    this.owner.move(name, this.owner.place(name).map((x, k) => x + far * way[k]), `Key ${name}:`);
    event.preventDefault();
  }

  // Show the marks or hide them, with the handles' lines.
  show(on) {
    this.group.hidden = !on;
    if (!on) for (const { line } of this.handles) line.style.display = "none";
  }

  // Lay the marks over the picture; behind(name): whether the head hides one.
  lay(behind) {
    for (const [name, mark] of this.marks) {
      put(mark, this.view.onScreen(this.owner.place(name)));
      mark.classList.toggle("behind", behind(name));
      mark.classList.toggle("chosen", name === this.owner.chosen);
      mark.tabIndex = name === this.owner.chosen ? 0 : -1;
    }
    const shown = this.marks.has(this.owner.chosen);
    const place = shown && this.owner.place(this.owner.chosen);
    for (const { handle, line, way, name } of this.handles) {
      const [x, y] = shown ? this.view.onScreen(place) : [0, 0];
      const [dx, dy] = shown ? this.arm(place, way) : [0, 0];
      const hidden = Math.hypot(dx, dy) < SHORT;
      if (!handle.held) handle.hidden = hidden;
      line.style.display = hidden ? "none" : "";
      if (hidden) continue;
      handle.ariaLabel = `Move ${this.owner.chosen} along ${name}`;
      put(handle, [x + dx, y + dy]);
      for (const [key, value] of Object.entries({ x1: x, y1: y, x2: x + dx, y2: y + dy })) line.setAttribute(key, value.toFixed(1));
    }
  }

  // Metres that are as long as an arm at a place, and the arm along a way in pixels.
  reach(place) {
    return ARM * this.view.pixel(place);
  }

  arm(place, way) {
    const far = this.reach(place);
    const [from, to] = [place, place.map((x, k) => x + far * way[k])].map((at) => this.view.onScreen(at));
    return [to[0] - from[0], to[1] - from[1]];
  }
}

function put(mark, [x, y]) {
  mark.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
}
