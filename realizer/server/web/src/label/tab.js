// The tab Label: the film of a recording, and lanes of labels of what is seen in it.
import { ms, titleOf } from "../design/model.js";
import { at, make } from "../dom.js";
import { StudioService } from "../face/service.js";
import { Film } from "./film.js";
import { Labels } from "./model.js";
import { Rows } from "./rows.js";

const MOST = 24; // names that are shown

export class LabelTab {
  // search(words): expressions of the library.
  constructor(search) {
    Object.assign(this, { search, open: false, begun: null, names: [], name: null, recordings: [], loop: true });
    this.service = new StudioService("label");
    this.model = new Labels();
    this.film = new Film(at("label-film"), at("label-points"));
    this.rows = new Rows(at("label-score"), this.model, { told: (words) => this.tell(words, "amber"), scrub: (time) => this.look(time), inspect: () => at("label-start").focus() });
    this.wire();
  }

  wire() {
    const { model } = this;
    const press = {
      "label-undo": () => model.undo(),
      "label-redo": () => model.redo(),
      "label-save": () => this.save(),
      "label-play": () => this.play(),
      "label-begin": () => this.begin(),
      "label-end": () => this.end(),
      "label-in": () => this.rows.zoomBy(1.5),
      "label-out": () => this.rows.zoomBy(1 / 1.5),
      "label-delete": () => model.selected && model.remove(model.selected),
      "label-loop": () => (at("label-loop").ariaPressed = String((this.loop = !this.loop))),
    };
    for (const [id, act] of Object.entries(press)) at(id).onclick = act;
    at("label-recording").onchange = () => this.read(at("label-recording").value);
    at("label-other").onchange = () => this.show();
    at("label-who").value = localStorage.getItem("annotator") ?? "me";
    at("label-who").onchange = () => this.become(at("label-who").value.trim());
    at("label-find").oninput = () => this.find(at("label-find").value.trim());
    at("label-find").onkeydown = ({ key }) => key === "Enter" && at("label-names").firstElementChild?.click();
    for (const id of ["label-start", "label-stop"]) at(id).onchange = () => this.retime();
    addEventListener("keydown", (event) => this.open && this.key(event));
    addEventListener("beforeunload", (event) => this.unsaved && event.preventDefault());
    model.addEventListener("told", ({ detail }) => this.tell(detail, "amber"));
    model.addEventListener("commit", () => this.compare());
    for (const event of ["commit", "select", "change"]) model.addEventListener(event, () => this.showState());
    this.service.addEventListener("lost", () => this.open && this.tell("The service cannot be reached. Your labels are kept in this browser.", "bad"));
    this.service.addEventListener("open", () => at("label-status").dataset.state === "bad" && this.tell(""));
  }

  // The tab is shown, or not.
  turn(open) {
    this.open = open;
    if (open) at("tab-label").hidden = false;
    at("label-stage").hidden = at("label-time").hidden = !open;
    document.body.classList.toggle("labelling", open);
    if (!open) return this.film.pause();
    this.rows.fit();
    if (!this.recordings.length) this.list();
  }

  // A message of the service: whether it has a corpus.
  reply(message) {
    if (message.type === "welcome" && message.capabilities.corpus) at("tab-label").hidden = false;
  }

  key(event) {
    const { model, film } = this;
    if (event.defaultPrevented || event.target.matches("input:not([type=range]), select, textarea") || event.altKey) return;
    const command = event.ctrlKey || event.metaKey;
    const key = event.key.toLowerCase();
    const step = { arrowleft: -1, arrowright: 1 }[key];
    const picked = /^[1-9]$/.test(key) && at("label-names").children[key - 1];
    if (command && key === "z") event.shiftKey ? model.redo() : model.undo();
    else if (command && key === "y") model.redo();
    else if (command && key === "s") this.save();
    else if (command) return;
    else if (key === "i") this.begin();
    else if (key === "o") this.end();
    else if (step && !event.target.matches("[role=tab], canvas")) this.look(film.time + step * film.frame * (event.shiftKey ? 10 : 1));
    else if (key === " " && !event.target.matches("button")) this.play();
    else if (key === "[" || key === "]") this.trim(key === "[");
    else if (picked) picked.click();
    else return;
    event.preventDefault();
    if (model.selected) this.rows.focus(model.selected); // a change draws it anew
  }

  // Resolve to the service's answer; what it refuses is told.
  async ask(question) {
    try {
      return await this.service.ask(question);
    } catch (error) {
      this.tell(error.message, "bad");
      this.conflict = error.conflict;
      return null;
    }
  }

  async list() {
    const answer = await this.ask({ type: "list" });
    if (!answer) return;
    Object.assign(this, { corpus: answer.corpus, recordings: answer.recordings, editable: answer.editable });
    const sound = answer.recordings.filter(({ error }) => !error);
    at("label-recording").replaceChildren(...sound.map(({ name }) => make("option", { value: name }, name)));
    const wrong = answer.recordings.filter(({ error }) => error).map(({ error }) => error);
    if (!sound.length) return this.tell([...wrong, "There is no recording yet; see `realizer corpus add`."].join("\n"), "bad");
    this.names = [...new Set(sound.flatMap(({ names }) => names))];
    this.find("");
    await this.read(at("label-recording").value);
    // Reading takes its time, in which labels may be saved.
    if (wrong.length) this.tell([at("label-status").textContent, ...wrong].filter(Boolean).join("\n"), "bad");
  }

  // Open a recording.
  async read(name) {
    this.tell("Reading the recording");
    let found = await this.ask({ type: "open", recording: name });
    if (!found || name !== at("label-recording").value) return;
    this.model.sound = null;
    let words = "";
    if (!(await this.film.load(found))) {
      words = "The browser cannot play this film; its points are shown, where there are any. An MP4 with H.264 or a WebM plays.";
      found = await this.ask({ type: "open", recording: name, film: false });
      if (!found) return;
      await this.film.load(found);
    } else if (!found.media && !found.points) words = "The recording has neither a film nor points to look at.";
    this.found = found;
    this.become(at("label-who").value.trim());
    at("label-note").textContent = words;
    if (!found.media) return;
    const sound = await this.film.sound();
    if (sound && this.found === found) this.model.hear(sound);
  }

  // Another annotator works here, or on another recording.
  become(name) {
    if (!name) return this.tell("An annotator needs a name.", "amber");
    const { found } = this;
    localStorage.setItem("annotator", name);
    at("label-who").value = name;
    if (!found) return;
    const others = Object.keys(found.annotators).filter((one) => one !== name);
    const before = at("label-other").value;
    at("label-other").replaceChildren(make("option", { value: "" }, "nobody"), ...others.map((one) => make("option", { value: one }, one)));
    at("label-other").value = others.includes(before) ? before : (others[0] ?? "");
    this.who = name;
    this.labels = null;
    this.show();
    this.look(0);
  }

  // The lanes of both annotators; a draft comes before what is saved.
  show() {
    const { found, model, who } = this;
    const other = at("label-other").value;
    const key = `label:${this.corpus}/${found.recording}/${who}`;
    const saved = found.annotators[who] ?? [];
    const draft = model.draft(key);
    const isNew = draft && JSON.stringify(draft.labels) !== JSON.stringify(saved);
    model.version = isNew ? draft.version : (found.versions[who] ?? found.none);
    model.load(found, key, { name: who, labels: isNew ? draft.labels : saved }, other && { name: other, labels: found.annotators[other] });
    this.unsaved = isNew;
    this.begin(null);
    this.tell(isNew ? "Your labels that were not saved are here again." : this.editable ? "" : "Labels cannot be saved here; they stay in this browser.");
    this.film.pause();
    this.compare();
    this.showState();
  }

  begin(time = this.film.time) {
    this.begun = time;
    this.rows.begin(time);
    at("label-begin").ariaPressed = String(time !== null);
  }

  // Make a label from where it begins to the end of the frame that is shown.
  end() {
    const { model, film } = this;
    if (!this.name) return this.tell("Choose an expression first.", "amber");
    if (this.begun === null) return this.tell("Press I where it begins, and O where it ends.", "amber");
    const start = model.grid(Math.min(this.begun, film.time));
    const stop = model.grid(Math.max(this.begun, film.time) + film.frame, 1);
    this.tell("");
    model.place({ expression: this.name, duration: ms(stop - start) }, 0, start);
    if (model.labels.some(([from, , text]) => from === start && text === this.name)) this.begin(null);
    model.select(null);
  }

  // Move an end of the chosen label to the frame that is shown.
  trim(first) {
    const { model, film } = this;
    const entry = model.selected;
    if (!entry || !model.isOwn(entry)) return this.tell("Choose a label of yours first.", "amber");
    const stop = first ? entry.start + entry.duration : film.time + film.frame;
    this.set(first ? film.time : entry.start, stop);
  }

  retime() {
    const [start, stop] = [at("label-start").valueAsNumber, at("label-stop").valueAsNumber];
    if (this.model.selected && Number.isFinite(start + stop)) this.set(start, stop);
  }

  set(from, to) {
    const { model } = this;
    const start = model.grid(from);
    const stop = model.grid(to, 1);
    if (stop <= start) return this.tell("A label ends after it begins.", "amber");
    model.change(model.selected, { start, duration: ms(stop - start) });
  }

  look(time) {
    this.film.seek(time);
    this.rows.now(this.film.time);
  }

  play() {
    this.film.playing ? this.film.pause() : this.film.play();
  }

  async find(words) {
    const asked = (this.asked = words);
    const own = this.names.filter((name) => name.toLowerCase().includes(words.toLowerCase()));
    let rows = [];
    try {
      rows = await this.search(words);
    } catch (error) {
      if (!own.length) this.tell(error.message, "amber");
    }
    if (asked !== this.asked) return;
    // Without a search the templates come first, as in the strip of the designer.
    if (!words) rows.sort((a, b) => b.name.startsWith("template:") - a.name.startsWith("template:"));
    const titles = [...new Set([...own, ...rows.map(({ name }) => titleOf({ expression: name }))])];
    if (words && !titles.includes(words)) titles.splice(MOST - 1, Infinity, words); // a name of one's own
    this.name ??= titles[0];
    const buttons = titles.slice(0, MOST).map((title, k) => {
      const button = make("button.small", { type: "button", value: title, ariaPressed: String(title === this.name) }, title, ...(k < 9 ? [make("kbd", { ariaHidden: "true" }, String(k + 1))] : []));
      button.onclick = () => this.call(title);
      return button;
    });
    at("label-names").replaceChildren(...buttons);
  }

  // The next label, or the chosen one, gets this name.
  call(name) {
    const { model } = this;
    this.name = name;
    for (const button of at("label-names").children) button.ariaPressed = String(button.value === name);
    if (model.selected && model.isOwn(model.selected)) model.change(model.selected, { expression: name });
  }

  // Ask how far both annotators agree.
  async compare() {
    const { found, model, who } = this;
    const other = at("label-other").value;
    if (!found || !other) return at("label-agreement").replaceChildren();
    const { labels } = model;
    const asked = (this.compared = labels);
    const answer = await this.ask({ type: "compare", recording: found.recording, annotator: who, other, labels });
    if (!answer || asked !== this.compared) return;
    const rows = answer.agreement.map(([name, alpha]) => make("tr", {}, make("th", { scope: "row" }, name), make("td", {}, alpha === null ? "–" : alpha.toFixed(2))));
    at("label-agreement").replaceChildren(...(rows.length ? [make("caption", {}, `${who} and ${other}: Krippendorff’s alpha`), make("tbody", {}, ...rows)] : []));
  }

  async save() {
    const { found, model, who } = this;
    if (!found) return;
    const { labels } = model;
    this.conflict = undefined;
    const answer = await this.ask({ type: "save", recording: found.recording, annotator: who, labels, version: model.version });
    if (!answer) {
      if (this.conflict) model.version = this.conflict; // the next save replaces what is there
      return;
    }
    found.annotators[who] = answer.labels;
    found.versions[who] = model.version = answer.version;
    localStorage.removeItem(model.key);
    this.unsaved = JSON.stringify(model.labels) !== JSON.stringify(labels);
    this.tell(`Saved ${labels.length} labels of ${who}.`, "good");
    this.showState();
  }

  showState() {
    const { model } = this;
    const { selected: entry } = model;
    const own = entry && model.find(entry) && model.isOwn(entry);
    if (this.found) this.unsaved = JSON.stringify(model.labels) !== JSON.stringify(this.found.annotators[this.who] ?? []);
    at("label-undo").disabled = !model.past.length;
    at("label-redo").disabled = !model.future.length;
    at("label-save").disabled = !this.unsaved || !this.editable;
    at("label-save").textContent = this.unsaved ? "Save labels" : "Saved";
    at("label-chosen").disabled = !own;
    at("label-start").value = own ? entry.start.toFixed(3) : "";
    at("label-stop").value = own ? (entry.start + entry.duration).toFixed(3) : "";
  }

  // A picture of the page is drawn.
  draw() {
    if (!this.open || !this.found) return;
    const { selected: entry } = this.model;
    const chosen = entry && this.model.find(entry);
    const [first, last] = chosen ? [entry.start, entry.start + entry.duration] : [0, this.film.duration];
    this.rows.now(this.film.now(first, last, this.loop));
    this.film.draw();
    at("label-now").textContent = `${this.film.time.toFixed(2)} s, frame ${Math.floor(this.film.time / this.film.frame + 1e-6)}`;
    at("label-play").ariaPressed = String(this.film.playing);
    at("label-play").lastChild.textContent = this.film.playing ? "Pause" : "Play";
  }

  tell(words, state = "") {
    at("label-status").textContent = words;
    at("label-status").dataset.state = words ? state : "";
  }
}
