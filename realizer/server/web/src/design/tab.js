// The tab Design: lanes of expressions, edited, checked and shown on the page's face.
import { at, choose } from "../dom.js";
import { StudioService } from "../face/service.js";
import { download } from "../pose.js";
import { Expression } from "./expression.js";
import { Inspector } from "./inspector.js";
import { Lanes } from "./lanes.js";
import { Design, ms, titleOf } from "./model.js";
import { Preview } from "./preview.js";
import { Strip } from "./strip.js";
import { Voice } from "./voice.js";

const FORMS = { toml: "text/plain", bml: "text/xml", fap: "text/x-fap", csv: "text/csv" };
const LOST = "The service cannot be reached. Your changes are kept in this browser.";

export class DesignTab {
  // link: the connection; stage: the face; sound, recorder: the page's. hear(): switch sound on. film(on): begin or end one.
  constructor(link, stage, { sound, recorder, hear, film }) {
    Object.assign(this, { link, stage, hear, record: film, open: false, marks: new Map() });
    this.tool = new StudioService("design");
    this.model = new Design();
    this.voice = new Voice((request) => this.ask(request), sound, recorder);
    this.preview = new Preview((request) => this.ask(request), stage, this.model, this.voice, () => this.showPlaying());
    this.lanes = new Lanes(at("design-score"), this.model, { told: (words) => this.stop(words), scrub: (time) => this.look(time, true), inspect: () => at("design-inspector").querySelector("input")?.focus() });
    this.strip = new Strip((request) => this.ask(request), this.model, (row, event) => this.add(row, event));
    this.inspector = new Inspector(this.model, { marks: (entry) => this.marks.get(entry) ?? [], edit: (row) => this.edit(row), lanes: this.lanes });
    this.expression = new Expression({ preview: this.preview, save: (message) => link.ask(message), told: (words) => this.tell(words), saved: () => this.strip.load(stage.name) });
    this.model.addEventListener("commit", () => this.check());
    this.model.addEventListener("change", () => this.speak());
    this.view("Library");
    this.wire();
  }

  wire() {
    const { model, preview } = this;
    at("design-undo").onclick = () => model.undo();
    at("design-redo").onclick = () => model.redo();
    at("design-new").onclick = () => model.clear();
    at("design-open").onclick = () => at("design-file").click();
    at("design-file").onchange = () => at("design-file").files[0] && this.read(at("design-file").files[0]);
    at("design-form").onchange = () => this.save();
    at("design-say").onsubmit = (event) => {
      event.preventDefault();
      this.enrich();
    };
    at("design-lane").onclick = () => model.addLane();
    at("design-in").onclick = () => this.lanes.zoomBy(1.5);
    at("design-out").onclick = () => this.lanes.zoomBy(1 / 1.5);
    at("design-play").onclick = () => this.play();
    at("design-loop").onclick = () => {
      preview.loop = !preview.loop;
      at("design-loop").ariaPressed = String(preview.loop);
    };
    addEventListener("keydown", (event) => this.open && this.key(event));
    for (const event of ["change", "commit"]) model.addEventListener(event, () => this.showState());
  }

  key(event) {
    const field = event.target.matches("input, select, textarea");
    const undo = (event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z";
    if (undo && !field) event.shiftKey ? this.model.redo() : this.model.undo();
    else if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "y" && !field) this.model.redo();
    else if (event.key === " " && event.target.matches(".d-block, .d-ruler")) this.play();
    else return;
    event.preventDefault();
    if (!field) this.lanes.focus(this.model.selected);
  }

  // The service's answer; what it refuses, and that it cannot be reached, is an error with a sentence.
  async ask(request) {
    try {
      return await this.tool.ask(request);
    } catch (error) {
      throw error.lost ? Object.assign(new Error(LOST), { lost: true }) : error;
    }
  }

  // The tab is shown, or not.
  show(open) {
    this.open = open;
    at("time").hidden = at("report").hidden = open;
    at("design-time").hidden = !open;
    if (!open) {
      this.preview.pause();
      return this.showPlaying();
    }
    this.lanes.fit();
    this.begin();
  }

  know(vocabulary) {
    this.expression.know(vocabulary);
  }

  // A message of the service: whether it saves.
  reply(message) {
    if (message.type !== "welcome") return;
    at("design-save-expression").disabled = !message.capabilities.edit;
    at("design-no-edit").hidden = message.capabilities.edit === true;
    if (this.begun) this.check();
  }

  // The face has been loaded.
  begin() {
    if (!this.open || !this.stage.name) return;
    if (this.begun !== this.stage.name) {
      const first = !this.begun;
      this.begun = this.stage.name;
      this.strip.load(this.begun).catch((error) => this.tell(error.message, "bad"));
      if (first && this.model.restore()) this.tell("Your last design is here again.");
    }
    this.model.dispatchEvent(new Event("change"));
    this.check();
  }

  add(row, event) {
    const { model, lanes } = this;
    const spot = event ? lanes.at(event.clientX, event.clientY) : { lane: Math.min(model.lane, model.shown.channel.length - 1), time: this.free(row) };
    if (!spot) return;
    model.place({ expression: row.name }, spot.lane, ms(event ? lanes.snapped(spot.time) : spot.time));
    lanes.line.hidden = true;
    this.look(model.span(model.selected).reached);
    if (event) lanes.focus(model.selected);
  }

  // The playhead if the channel is free there, or else its end.
  free(row) {
    const { model } = this;
    const lane = Math.min(model.lane, model.shown.channel.length - 1);
    const { length } = model.times({ expression: row.name });
    const time = this.preview.time;
    return model.isFree(lane, time, time + length) ? time : (model.spans(model.shown.channel[lane]).at(-1)?.end ?? time);
  }

  // Get the sound of what is said.
  async speak() {
    try {
      await this.voice.load(this.model.speech.says);
    } catch (error) {
      this.tell(error.message, "bad");
    }
  }

  look(time, heard = false) {
    this.preview.look(time);
    if (heard) this.voice.scrub(time);
    this.lanes.now(this.preview.time); // at once: the next key may come before the next picture
    this.showPlaying();
  }

  play() {
    if (this.voice.buffer) this.hear();
    this.preview.playing ? this.preview.pause() : this.preview.play();
    this.showPlaying();
  }

  // Film the timeline from its begin to its end.
  async film() {
    const { preview } = this;
    const { loop } = preview;
    preview.loop = false;
    this.look(0);
    await preview.want(0);
    await this.record(true);
    preview.play();
    this.showPlaying();
    this.tell("Filming; Pause ends the film.");
    await new Promise((done) => (this.paused = done));
    preview.loop = loop;
    await this.record(false);
    this.tell("");
  }

  showPlaying() {
    if (!this.preview.playing) this.paused?.();
    at("design-play").ariaPressed = String(this.preview.playing);
    at("design-play").lastChild.textContent = this.preview.playing ? "Pause" : "Play";
  }

  showState() {
    at("design-undo").disabled = !this.model.past.length;
    at("design-redo").disabled = !this.model.future.length;
    at("design-form").disabled = at("design-play").disabled = !this.model.file;
  }

  // What to draw now; null: the face of the session.
  frames() {
    if (!this.open) return null;
    const shown = this.preview.now();
    this.lanes.now(this.preview.time);
    at("design-now").textContent = `${this.preview.time.toFixed(2)} s`;
    return shown;
  }

  // Ask for what is unusual and what is missing; the newest state wins.
  async check() {
    const { model } = this;
    this.showState();
    const timeline = model.file;
    if (!timeline) return this.judge([], []);
    if (this.checking) return void (this.again = true);
    this.checking = true;
    try {
      const { advice, companions, remarks } = await this.ask({ tool: "check", timeline, mood: at("design-mood").value, role: at("design-role").value });
      if (model.file && JSON.stringify(model.file) === JSON.stringify(timeline)) this.judge(advice, companions);
      const whole = [...remarks, ...advice.filter(({ place }) => !place).map(({ text, hint }) => `${text}; ${hint}`)];
      if (["", "check"].includes(at("design-status").dataset.from ?? "")) this.tell(whole[0] ?? "", "amber", "check");
      const first = model.selected && this.marks.get(model.selected)?.[0];
      if (first && model.selected !== this.stopped) this.tell(`${first.text}; ${first.hint}`, "amber", "check");
    } catch (error) {
      this.tell(error.message, "bad", "check");
    } finally {
      this.checking = false;
    }
    if (!this.again) return;
    this.again = false;
    this.check();
  }

  judge(advice, companions) {
    const { model } = this;
    // The file has no empty channels: its numbers are those of the others.
    const lanes = model.shown.channel.map((one, lane) => ({ one, lane })).filter(({ one }) => one.entries.length);
    this.marks = new Map();
    for (const { place, ...found } of advice) {
      const entry = place && lanes[place[0]].one.entries[place[1]];
      if (entry) this.marks.set(entry, [...(this.marks.get(entry) ?? []), found]);
    }
    const placed = companions.map((one) => {
      const own = lanes[one.track].lane;
      const free = model.shown.channel.findIndex((_, lane) => lane !== own && model.isFree(lane, one.start, one.end));
      const entry = model.shown.channel[own].entries[one.entry];
      return { ...one, track: own, lane: free < 0 ? model.shown.channel.length : free, intensity: entry.intensity ?? 1 };
    });
    this.lanes.judge(this.marks, placed);
    this.inspector.draw();
  }

  // A rule has stopped the chosen block; the sentence stays until another change.
  stop(words) {
    this.tell(words, "amber");
    this.stopped = this.model.selected;
  }

  // Show a sentence below the lanes; "check": another check may replace it.
  tell(words, state = "", from = "user") {
    const place = at("design-status");
    place.textContent = words;
    Object.assign(place.dataset, { state: words ? state : "", from: words ? from : "" });
  }

  async enrich() {
    const text = at("design-text").value.trim();
    if (!text) return this.tell("Type what is said, and the face shows what people show with it.");
    await this.take({ tool: "enrich", text, mood: at("design-mood").value, role: at("design-role").value });
  }

  async read(file) {
    at("design-file").value = "";
    await this.take({ tool: "open", text: await file.text() });
  }

  // Show what the service makes of a text or a file; what it leaves out is said.
  async take(request) {
    try {
      const { timeline, left_out: left, says, words, syncs, peaks } = await this.ask(request);
      const channel = timeline.channel.length ? timeline.channel : [{ name: "1", entries: [] }];
      this.model.show({ timeline: { ...timeline, channel }, speech: { says, words, syncs, peaks } });
      this.model.select(null);
      this.look(0);
      if (says.length) at("design-text").value = says.map(([, text]) => text).join(" ");
      if (left.length) this.tell(`Left out: ${left.join("; ")}`, "amber");
    } catch (error) {
      this.tell(error.message, "bad");
    }
  }

  async save() {
    const form = at("design-form").value;
    at("design-form").value = "";
    try {
      if (form === "film") return await this.film();
      const { text } = await this.ask({ tool: "export", form, timeline: this.model.file, says: this.model.speech.says });
      download(new Blob([text], { type: FORMS[form] }), `timeline.${form}`);
      this.tell(form === "toml" ? "realizer timeline timeline.toml -o timeline.mp4 makes a film of it." : form === "bml" ? "BML has no joins, curves and mixer: channels blend by the strongest, and keyframes begin and end softly." : "");
    } catch (error) {
      this.tell(error.message, "bad");
    }
  }

  view(name) {
    choose(at("design-views"), ["Library", "Expression"], name, (shown) => this.turn(shown));
    this.turn(name);
  }

  turn(name) {
    at("design-library").hidden = name !== "Library";
    at("design-expression").hidden = name !== "Expression";
    if (name === "Expression") this.expression.show();
    else this.preview.look(this.preview.time);
  }

  edit(row) {
    this.view("Expression");
    this.expression.open(row);
    this.tell(`${titleOf({ expression: row.name })}: move its action units; saving needs a name of its own.`);
  }
}
