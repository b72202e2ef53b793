// One action unit: what it moves and where to, its markers, and the service's fit to them (Wojdel 2005, 4.2).
import { make } from "../dom.js";
import { show, slider } from "../sliders.js";
import { Marks } from "./marks.js";

const [FEWEST, MOST] = [8, 200]; // markers
const REACH = 0.02; // m around a marker in which the skin follows it, as unit_fits.py
const SKIN = ["skin", "brows", "lashes", "tears", "beard", "hair"];
const SPARSE = 0.007; // m between two arrows
const SEEN = 0.04; // of the longest way; shorter ones have no arrow
const LEAST = 0.2; // intensity at which a marker can be dragged

export class UnitPanel {
  // hands: { ask(question), show(unit, value), attempt(doing, work), said(text) }
  constructor(panel, layer, draft, view, hands) {
    Object.assign(this, { draft, view, hands, au: 12, value: 1, chosen: "1L", looks: new WeakMap() });
    const button = (text, click, more = {}) => Object.assign(make("button", { type: "button", ...more }, text), { onclick: click });
    this.list = make("select", { ariaLabel: "Action unit" });
    this.list.onchange = () => this.take(Number(this.list.value));
    this.test = slider("Intensity", 0, 1, 0.01, (value) => this.try(value));
    this.output = make("output");
    this.words = make("p", { role: "status" });
    this.markers = make("select", { ariaLabel: "Marker", size: 7 });
    this.markers.onchange = () => this.choose(`${this.markers.selectedIndex + 1}L`);
    this.fitButton = button("Refit", () => this.fit(), { className: "main" });
    this.resetButton = button("As it was", () => this.change(`Reset AU${this.au}`, null));
    this.removeButton = button("Remove the marker", () => this.remove());
    panel.append(
      make("div.finder", {}, button("‹", () => this.step(-1), { ariaLabel: "Previous action unit" }), this.list, button("›", () => this.step(1), { ariaLabel: "Next action unit" })),
      make("div.row.zone.test", {}, make("span", {}, "intensity"), this.test, this.output), this.words, this.markers,
      make("div.finder", {}, this.fitButton, this.resetButton, this.removeButton),
      make("p.hint", {}, "Colours show how far the skin goes, arrows where to. Drag a marker, move it by its handles or by keys, or click on the head for a new one; then refit the functions to the markers. Both sides move alike."),
    );
    this.marks = new Marks(layer, view, this);
  }

  begin(head) {
    Object.assign(this, { base: new Map(), fits: new Map(), value: 1, unit: null, names: null });
    this.list.replaceChildren(...head.units.map(([au, name]) => make("option", { value: au }, `AU${au} ${name}`)));
    this.list.value = this.au;
  }

  get rows() {
    return this.draft.state.units[this.au] ?? this.base.get(this.au)?.markers ?? [];
  }

  // Open the tab's part, or choose another unit.
  async take(au = this.au) {
    this.au = au;
    this.list.value = au;
    this.chosen = "1L";
    this.refresh();
    if (this.base.has(au)) return;
    const { base } = this;
    await this.hands.attempt(`Looking up AU${au} …`, async () => this.keep(await this.hands.ask({ type: "unit", au }), base));
  }

  keep(answer, base) {
    if (base !== this.base) return ""; // of another head
    const fit = { ...answer, field: Float64Array.from(answer.arrays.field) };
    if (!base.has(fit.au)) base.set(fit.au, fit);
    this.fits.set(key(fit), fit);
    this.refresh();
    return "";
  }

  step(by) {
    const all = this.draft.head.units.map(([au]) => au);
    this.take(all[(all.indexOf(this.au) + by + all.length) % all.length]);
  }

  try(value) {
    this.value = value;
    show(this.test, value);
    this.output.textContent = `${Math.round(100 * value)} %`;
    this.hands.show(this.unit, value);
  }

  // Fit the unit to its markers by the service.
  async fit() {
    const { au, rows, base } = this;
    this.fitButton.disabled = true;
    await this.hands.attempt(`Fitting AU${au} to ${rows.length} markers …`, async () => this.keep({ ...(await this.hands.ask({ type: "unit", au, markers: rows })), markers: rows }, base));
    this.refresh();
  }

  // Replace the markers; null: those that the face has.
  change(word, rows) {
    this.draft.change(word, (state) => {
      const units = { ...state.units, [this.au]: rows };
      if (!rows) delete units[this.au];
      return { ...state, units };
    });
  }

  remove() {
    const gone = parseInt(this.chosen) - 1;
    const left = this.rows.filter((_, k) => k !== gone);
    this.chosen = `${Math.max(1, Math.min(left.length, gone))}L`;
    this.change(`Remove ${this.au}`, left);
  }

  refresh() {
    if (!this.base) return;
    const { rows, draft } = this;
    const known = this.base.get(this.au);
    const fit = known && this.fits.get(key({ au: this.au, markers: rows }));
    if (fit) this.last = fit;
    else if (this.last?.au !== this.au) this.last = known;
    this.unit = fit ?? (known ? this.following(this.last, rows) : null);
    const names = rows.flatMap((row, k) => (row[0] ? ["L", "R"] : ["L"]).map((side) => `${k + 1}${side}`));
    if (this.names !== names.join()) this.marks.begin(names.map((name) => [name, `Marker ${parseInt(name)} on the ${name.endsWith("R") ? "right" : "left"}`]));
    this.names = names.join();
    const lines = rows.map((row, k) => `${k + 1}  goes ${(1000 * Math.hypot(row[3], row[4], row[5])).toFixed(1)} mm`);
    if (this.markers.length !== lines.length) this.markers.replaceChildren(...lines.map((text) => make("option", {}, text)));
    else lines.forEach((text, k) => this.markers[k].text !== text && (this.markers[k].text = text));
    this.markers.selectedIndex = parseInt(this.chosen) - 1;
    this.words.textContent = !known ? "" : fit ? errors(fit.errors) : "Markers were moved: what you see is an estimate until you refit. Saving refits, too.";
    this.fitButton.disabled = Boolean(fit) || !known;
    this.resetButton.disabled = !(this.au in draft.state.units);
    this.removeButton.disabled = rows.length <= FEWEST;
    this.try(this.value);
    this.view.stale = true;
  }

  // The unit of the last fit as moved markers change it: by distance, all of it at the marker itself.
  following(fit, rows) {
    const before = new Map(fit.markers.map((row) => [row.slice(0, 3).join(), row]));
    const changes = rows.map((row) => {
      const old = before.get(row.slice(0, 3).join());
      return old ? [3, 4, 5].map((k) => row[k] - old[k]) : [0, 0, 0];
    });
    const moved = rows.filter((_, k) => changes[k].some(Boolean));
    const [field, v] = [fit.field.slice(), this.draft.mesh.vertices];
    for (const part of SKIN)
      for (let [i, last] = this.draft.mesh.parts[part] ?? [0, 0]; i < last; i++) {
        const [x, y, z] = [Math.abs(v[3 * i]), v[3 * i + 1], v[3 * i + 2]];
        const far = (row) => Math.sqrt((row[0] - x) ** 2 + (row[1] - y) ** 2 + (row[2] - z) ** 2);
        if (!moved.some((row) => far(row) < REACH)) continue;
        const [sum, side] = [[0, 0, 0], Math.sign(v[3 * i]) || 1];
        let whole = 1 / REACH ** 2;
        rows.forEach((row, n) => {
          const away = far(row);
          if (away >= REACH) return;
          const weight = ((REACH - away) / (REACH * Math.max(away, 1e-6))) ** 2;
          whole += weight;
          for (let k = 0; k < 3; k++) sum[k] += weight * changes[n][k];
        });
        for (let k = 0; k < 3; k++) field[3 * i + k] += ((k ? 1 : side) * sum[k]) / whole;
      }
    return { ...fit, field };
  }

  // How far vertices go, of the longest way, for their colours; and the vertices that get arrows.
  get look() {
    const { field } = this.unit ?? {};
    if (!field) return null;
    if (!this.looks.has(field)) {
      const long = (i) => Math.sqrt(field[3 * i] ** 2 + field[3 * i + 1] ** 2 + field[3 * i + 2] ** 2);
      const { vertices, skin } = this.draft.mesh;
      let most = 1e-9;
      for (let i = skin[0]; i < skin[1]; i++) most = Math.max(most, long(i));
      const cells = new Map();
      for (let i = skin[0]; i < skin[1]; i++) if (long(i) > SEEN * most) cells.set([0, 1, 2].map((k) => Math.round(vertices[3 * i + k] / SPARSE)).join(), i);
      this.looks.set(field, { heat: field.map((x) => x / most), vertices: [...cells.values()] });
    }
    return this.looks.get(field);
  }

  // What the marks need: places of markers at the intensity that is shown, and how they move.
  place(name) {
    const side = name.endsWith("R") ? -1 : 1;
    const [x, y, z, dx, dy, dz] = this.rows[parseInt(name) - 1];
    return [side * (x + this.value * dx), y + this.value * dy, z + this.value * dz];
  }

  move(name, to, word) {
    if (this.value < LEAST) {
      this.try(1);
      return this.hands.said("The unit is now shown in full, as markers say where it goes then.");
    }
    const rows = this.rows.map((row) => [...row]);
    const row = rows[parseInt(name) - 1];
    const side = name.endsWith("R") ? -1 : 1;
    for (let k = 0; k < 3; k++) row[3 + k] = Math.round((1e6 * ((k ? 1 : side) * to[k] - row[k])) / this.value) / 1e6;
    if (!row[0]) row[3] = 0;
    this.change(`${word.replace(/:$/, "")} AU${this.au}:`, rows);
  }

  choose(name) {
    this.chosen = name;
    this.refresh();
  }

  pressed(name) {
    this.choose(name);
  }

  rest() {
    this.draft.rest();
  }

  snaps() {
    return false;
  }

  // A click on the head: a new marker, which goes where its place goes.
  click(x, y) {
    const hit = this.unit && this.view.hit(x, y);
    if (!hit || this.rows.length >= MOST) return this.hands.said(hit ? `There are ${MOST} markers already.` : "There is no head under the pointer: click on the head.");
    const side = hit.place[0] < 0 ? -1 : 1;
    const move = [0, 1, 2].map((k) => this.unit.field[3 * hit.vertex + k]);
    const row = [side * hit.place[0], hit.place[1], hit.place[2], side * move[0], move[1], move[2]].map((n) => Math.round(1e6 * n) / 1e6);
    this.chosen = `${this.rows.length + 1}${side < 0 ? "R" : "L"}`;
    this.change(`Marker ${this.au}`, [...this.rows, row]);
  }

  lay() {
    const { mesh } = this.draft;
    this.marks.lay((name) => {
      const [x, y, z] = this.rows[parseInt(name) - 1];
      return !this.view.faces(mesh.nearest([name.endsWith("R") ? -x : x, y, z]));
    });
  }
}

const key = ({ au, markers }) => `${au} ${JSON.stringify(markers)}`;

function errors({ n, d_max: most, e, e_max: worst }) {
  const mm = (metres) => `${(1000 * metres).toFixed(1)} mm`;
  return `The fit misses ${n} measured places by ${mm(e)} on average, by ${mm(worst)} at most; the longest way is ${mm(most)} (e/d_max ${(e / most).toFixed(3)}).`;
}
