// The Face tab: opens heads, wires points, zones, masks and action units to the picture, keeps drafts and saves.
import { at, choose, make } from "../dom.js";
import { download } from "../pose.js";
import { Difference } from "./difference.js";
import { Draft } from "./draft.js";
import { FapPanel } from "./faps.js";
import { gestures } from "./gestures.js";
import { MaskStrokes } from "./masks.js";
import { HeadMesh } from "./mesh.js";
import { Motion, UNIT } from "./motion.js";
import { Points } from "./points.js";
import { StudioService } from "./service.js";
import { UnitPanel } from "./units.js";
import { View } from "./view.js";

const BUDGET = 2.5; // ms of a frame for fields
const ACCESSORIES = { eyes: ["left_eye", "right_eye", "tears"], teeth: ["upper_teeth", "lower_teeth", "tongue"], hair: ["hair", "brows", "lashes", "beard"], clothes: ["shirt", "glasses", "other"] };

export class FaceRoom {
  constructor() {
    Object.assign(this, { open: false, step: "points", service: new StudioService(), draft: new Draft(), marks: true });
    const [canvas, layer] = [at("face-head"), at("face-marks")];
    this.view = new View(canvas);
    this.motion = new Motion(this.draft, (question) => this.service.ask(question), (text) => this.say(text));
    const panel = at("face");
    const button = (text, click, more = {}) => Object.assign(make("button", { type: "button", ...more }, text), { onclick: click });
    this.faces = make("select", { ariaLabel: "Face to edit" });
    this.faces.onchange = () => this.load({ type: "open", face: this.faces.value });
    this.file = make("input", { type: "file", accept: ".glb,.gltf,.obj,.ply,.xml,.toml", ariaLabel: "Mesh or parameters", hidden: true });
    this.file.onchange = () => this.file.files[0] && this.read(this.file.files[0]);
    this.undo = button("Undo", () => this.draft.undo());
    this.redo = button("Redo", () => this.draft.redo());
    const parts = make("div.segments", { role: "group", ariaLabel: "Shown" });
    this.shown = [...Object.keys(ACCESSORIES), "marks"].map((name) => button(name, ({ target }) => this.toggle(target, name), { ariaPressed: "true" }));
    parts.append(...this.shown);
    const steps = make("div.segments", { role: "group", ariaLabel: "What is edited" });
    this.sections = { points: make("div.face-part"), zones: make("div.face-part"), units: make("div.face-part"), score: make("div.face-part") };
    this.points = new Points(this.sections.points, layer, this.draft, this.view, (text) => this.say(text));
    this.faps = new FapPanel(this.sections.zones, this.draft, { test: (fap, value) => this.motion.test(fap, value) });
    this.units = new UnitPanel(this.sections.units, layer, this.draft, this.view, {
      ask: (question) => this.service.ask({ ...question, setup: this.draft.table() }),
      show: (unit, value) => this.step === "units" && this.motion.show(unit, value),
      attempt: (doing, work) => this.attempt(doing, work), said: (text) => this.say(text),
    });
    this.difference = new Difference(at("face-difference"), this.view);
    const views = make("div.finder", {}, button("Score this FAP", () => this.score([this.faps.fap])), ...[["the face’s own shapes", (on) => Object.assign(this.motion, { own: on, lids: null, pending: true })], ["difference", (on) => this.difference.turn(on)]].map(([text, changed]) => {
      const input = make("input", { type: "checkbox" });
      input.onchange = () => changed(input.checked);
      return make("label.check", {}, input, ` ${text}`);
    }));
    this.sections.zones.append(views);
    this.mean = make("p", { role: "status" });
    this.worst = make("ol.face-worst", { ariaLabel: "FAPs under 3" });
    this.sections.score.append(make("div.finder", {}, button("Score all 127 movements", () => this.score([])), button("All by zones", () => this.draft.moveBy(this.draft.state.zones.keys())), this.mean), this.worst);
    this.note = make("p.hint", { role: "status" });
    this.name = make("input", { type: "search", ariaLabel: "Name of the face", size: 10, placeholder: "name" });
    this.saveButton = button("Save", () => this.save(), { className: "main" });
    const saving = make("div.finder.face-save", {}, this.name, this.saveButton, button("XML", () => this.xml()), button("GLB", () => this.glb()));
    panel.append(make("div.finder", {}, this.faces, button("Open a file", () => this.file.click()), this.file, this.undo, this.redo), make("div.finder", {}, steps, parts), ...Object.values(this.sections), this.note, saving);
    choose(steps, Object.keys(this.sections), this.step, (name) => this.show(name));
    this.steps = steps;
    this.show(this.step);
    this.strokes = new MaskStrokes(this.view, this.draft, this.faps, at("face-lasso"));
    gestures(canvas, this.view, {
      click: (x, y) => this.draft.mesh && { points: this.points, units: this.units }[this.step]?.click(x, y),
      stroke: (...all) => this.step === "zones" && this.stroke(...all),
      double: () => this.view.home(),
    });
    this.draft.addEventListener("change", () => this.changed());
    this.draft.addEventListener("fault", ({ text }) => this.say(text));
    this.service.addEventListener("lost", () => this.open && this.say("The connection to the service is lost. You can go on: the draft is kept in this browser."));
    this.service.addEventListener("open", () => this.draft.mesh && this.say("Connected again."));
    addEventListener("pagehide", () => this.draft.past?.length && this.draft.keep());
    addEventListener("keydown", (event) => this.key(event));
  }

  // Open or leave the tab. faces: names; face: the one to begin with.
  turn(open, faces, face) {
    this.open = open;
    document.body.classList.toggle("editing", open);
    if (!open || this.draft.mesh || this.loading || !face) return;
    this.known(faces);
    this.load({ type: "open", face });
  }

  known(faces) {
    this.faces.replaceChildren(...faces.map((name) => make("option", { value: name }, name)));
  }

  say(text) {
    this.note.textContent = text;
  }

  // Do something that may fail with a sentence; say what is going on.
  async attempt(doing, work) {
    this.say(doing);
    try {
      this.say((await work()) ?? "");
      return true;
    } catch (error) {
      this.conflict = error.conflict;
      this.say(error.message);
      return false;
    }
  }

  async load(question, bytes) {
    this.loading = true;
    await this.attempt("Opening the head …", async () => {
      const head = await this.service.ask(question, bytes);
      const mesh = new HeadMesh(head, head.arrays);
      this.view.load(mesh);
      this.motion.begin();
      this.expected = head.version;
      this.units.begin(head);
      this.draft.begin(head, mesh);
      this.points.begin(head);
      this.faps.begin(head);
      this.name.value = head.name;
      this.worst.replaceChildren();
      this.mean.textContent = "";
      for (const [k, name] of Object.keys(ACCESSORIES).entries()) this.shown[k].hidden = !ACCESSORIES[name].some((part) => part in mesh.parts);
      if ([...this.faces.options].some(({ value }) => value === question.face)) this.faces.value = question.face;
      this.saveButton.title = head.editable ? "" : "Nothing can be saved here: start the service with --edit DIR";
      const kept = Boolean(this.draft.kept);
      this.draft.resume();
      return [kept ? "The draft that this browser has kept goes on; Undo takes you back to the face." : "", ...head.notes].filter(Boolean).join(" ");
    });
    this.loading = false;
    this.show(this.step);
  }

  async read(file) {
    const bytes = await file.arrayBuffer();
    this.file.value = "";
    if (!/\.(xml|toml)$/i.test(file.name)) return this.load({ type: "import", name: file.name }, bytes);
    await this.attempt(`Reading ${file.name} …`, async () => {
      const { setup } = await this.service.ask({ type: "read", name: file.name }, bytes);
      const before = this.draft.table(true);
      const zones = new Map([...before.zone, ...setup.zone].map((zone) => [zone.fap, zone]));
      const whole = { ...before, ...setup, points: { ...before.points, ...setup.points }, zone: [...zones.values()], by: setup.zone.map(({ fap }) => fap) };
      this.draft.change("Read", () => this.draft.stateOf(whole));
      return `${setup.zone.length} zones of ${file.name}`;
    });
  }

  get table() {
    return { setup: this.draft.table(), keep: this.draft.head.keep || this.draft.state.by.size < this.draft.state.zones.size };
  }

  async score(faps) {
    const before = this.draft.state;
    await this.attempt("Scoring by rules …", async () => {
      const { scores, mean } = await this.service.ask({ type: "score", faps, ...this.table });
      if (this.draft.state !== before) return "The face was changed meanwhile: score it again.";
      this.faps.know(scores);
      if (!faps.length) this.list(scores, mean);
    });
  }

  list(scores, mean) {
    this.mean.textContent = `${mean.toFixed(2)} of 3 by rules, ${scores.filter(({ score }) => score === 3).length} of ${scores.length} at 3`;
    const low = scores.filter(({ score }) => score < 3).sort((a, b) => a.score - b.score || b.weight - a.weight);
    this.worst.replaceChildren(...low.map(({ fap, sign, score, why }) => {
      const words = make("button.low", { type: "button" }, make("b", {}, `${score}`), ` ${fap} ${sign > 0 ? "+" : "−"} ${this.draft.rows.get(fap).name.replaceAll("_", " ")}`, make("span", {}, why.join("; ")));
      words.onclick = () => {
        [...this.steps.children].find((one) => /zones/i.test(one.textContent)).click();
        this.faps.choose(fap);
        this.faps.try(sign * Math.abs(this.draft.rows.get(fap).usual[sign > 0 ? 1 : 0]));
      };
      return make("li", {}, words);
    }));
  }

  async save() {
    const { state } = this.draft;
    const done = await this.attempt("Saving …", async () => {
      const name = this.name.value.trim();
      const { saved, version } = await this.service.ask({ type: "save", name, expected: this.conflict ?? this.expected, units: state.units, ...this.table });
      Object.assign(this, { expected: version, conflict: undefined });
      if (this.draft.state === state) this.draft.forget();
      return `Saved as ${saved}`;
    });
    if (!done) this.draft.keep();
  }

  async xml() {
    await this.attempt("Writing XML …", async () => {
      const { text, lost } = await this.service.ask({ type: "xml", setup: this.draft.table() });
      download(new Blob([text], { type: "application/xml" }), `${this.name.value || "face"}.xml`);
      return lost.length ? `FaceEditor's form cannot hold all: ${lost[0]}${lost.length > 1 ? `, and ${lost.length - 1} more` : ""}` : "";
    });
  }

  async glb() {
    await this.attempt("Making the GLB …", async () => {
      const { arrays } = await this.service.ask({ type: "glb", ...this.table });
      download(new Blob([arrays.glb], { type: "model/gltf-binary" }), `${this.name.value || "face"}.glb`);
    });
  }

  show(step) {
    this.step = step;
    for (const [name, section] of Object.entries(this.sections)) section.hidden = name !== step;
    for (const [name, { marks }] of [["points", this.points], ["units", this.units]]) marks.show(step === name && this.marks);
    at("face-marks").hidden = !["points", "units"].includes(step) || !this.marks;
    if (step === "units" && this.draft.mesh && !this.loading) this.units.take();
    else if (this.motion.fap === UNIT) this.motion.test(this.faps.fap, this.faps.value);
    if (this.points.says) this.refresh();
    this.repaint = true;
    this.view.stale = true;
  }

  refresh() {
    if (this.step === "points") this.points.refresh();
    if (this.step === "zones") this.faps.refresh();
    if (this.step === "units") this.units.refresh();
  }

  toggle(button, name) {
    const on = button.ariaPressed !== "true";
    button.ariaPressed = String(on);
    if (name === "marks") {
      this.marks = on;
      return this.show(this.step);
    }
    const hidden = new Set(this.view.hidden);
    for (const part of ACCESSORIES[name]) on ? hidden.delete(part) : hidden.add(part);
    if (this.draft.mesh) this.view.show(hidden);
  }

  stroke(...all) {
    const used = this.strokes.stroke(...all);
    this.repaint ||= used;
    return used;
  }

  changed() {
    const { past, future, state } = this.draft;
    Object.assign(this.undo, { disabled: !past.length });
    Object.assign(this.redo, { disabled: !future.length });
    this.motion.forget();
    for (const score of this.faps.scores.values()) score.stale = true;
    if (this.points.says && state) this.refresh();
    this.repaint = true;
  }

  key(event) {
    if (!this.open || !(event.ctrlKey || event.metaKey) || /^(text|search|number)$/.test(event.target.type ?? "")) return;
    if (event.key.toLowerCase() === "z") event.shiftKey ? this.draft.redo() : this.draft.undo();
    else if (event.key.toLowerCase() === "y") this.draft.redo();
    else return;
    event.preventDefault();
  }

  // Draw the next picture.
  draw(now) {
    if (!this.draft.mesh || !this.points.says) return;
    const begin = performance.now();
    this.faps.tick(now);
    const moved = this.motion.step(BUDGET);
    const posed = moved ?? this.motion.arrived;
    if (posed) this.view.pose(posed, moved && this.last === moved ? this.motion.changed : null);
    this.last = posed ?? this.last;
    if (posed || this.repaint) this.paint();
    if (posed && this.look) this.view.arrows(this.look.vertices, this.look.heat);
    this.spent = performance.now() - begin; // ms of script before the picture is drawn
    if (!this.view.draw()) return;
    if (!at("face-marks").hidden) (this.step === "units" ? this.units : this.points).lay();
    this.difference.draw();
  }

  // The look of the action unit that is shown, or none.
  get look() {
    return this.step === "units" && this.marks ? this.units.look : null;
  }

  // Heat and wire of the FAP, and its mask where that is edited; or heat and arrows of the action unit.
  paint() {
    const { fap } = this.faps;
    const zone = this.step === "zones" && this.draft.state.zones.get(fap);
    const field = zone && this.motion.has(fap) && this.marks ? this.motion.field(fap) : (this.look?.heat ?? null);
    const key = [field, zone, this.strokes.mask, this.faps.tool, this.faps.mask, this.marks];
    if (this.painted?.every((one, k) => one === key[k]) && !this.strokes.mask) return;
    [this.painted, this.repaint] = [key, false];
    this.view.arrows(this.look?.vertices ?? null, field);
    this.view.paint(field, zone && this.faps.tool ? (this.strokes.mask ?? this.faps.mask) : null);
    if (zone && this.marks) this.view.wire(this.draft.state.points[this.draft.rows.get(fap).point], zone.scale.map((scale) => scale * zone.size * (1 + zone.smooth_side)));
    else this.view.wire(null);
  }
}
