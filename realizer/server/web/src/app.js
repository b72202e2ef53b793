// The page: wires the face, the sound, the editor, the tools and the feedback log to one connection.
import { Checker } from "./checker.js";
import { DesignTab } from "./design/tab.js";
import { at, choose, make, tabs } from "./dom.js";
import { Editor } from "./editor.js";
import { FaceRoom } from "./face/room.js";
import { LabelTab } from "./label/tab.js";
import { Log } from "./log.js";
import { Mirror } from "./mirror.js";
import { download, Pose } from "./pose.js";
import { Clock, isMarkup, Realizer, Sound } from "bml-realizer-client";
import { Recorder } from "./record.js";
import { ActionUnits, Faps } from "./sliders.js";
import { ask, token } from "./service.js";
import { Stage } from "./stage.js";
import { Timeline } from "./timeline.js";
import { Tracks } from "./tracks.js";
import { Wheel } from "./wheel.js";

const MESH_RATE = 30; // frames a second; the page draws between them
const CURVE_RATE = 25; // frames a second
const LOOK = 100; // ms between looks of the sliders at the face
const AHEAD = 0.2; // s; curves are sent so long before their time
const AGAIN = 3000; // ms until what a busy service did not send is asked for again
const BLOCK = /(<(?:\w+:)?bml\b[^<>]*?\sid\s*=\s*)(["'])(.*?)\2/;
const THEMES = { "": "as the system", light: "light", dark: "dark" };

const stage = new Stage(at("head"));
const clock = new Clock();
const sound = new Sound(clock);
const recorder = new Recorder(stage, sound);
const log = new Log(at("log"), at("filter"), at("log-head").querySelectorAll("[type=checkbox]"));
const query = new URLSearchParams(location.search);
const link = new Realizer({ session: query.get("session") ?? undefined, token });
const pose = new Pose((message) => link.ask(message));
const editor = new Editor(at("editor"), new Checker(), showFaults);
const timeline = new Timeline(at("score"), scrub, () => stage.oldest);
const units = new ActionUnits(at("au-sliders"), at("find-aus"), pose);
const params = new Faps(at("fap-sliders"), at("find-faps"), pose);
const mirror = new Mirror(link, (message) => log.error(message));
const room = new FaceRoom();
const design = new DesignTab(link, stage, { sound, recorder, hear, film });
const label = new LabelTab(async (find) => (await design.ask({ tool: "library", find })).expressions);
const wheel = new Wheel(at("wheel"), pose, (message) => log.error(message));

const alive = new Set(); // ids of blocks that were accepted and have not ended
let plays = 0;
let looked = 0; // ms, when the sliders last looked at the face
let face = null;
let faces = []; // names of the service's faces
let faults = [];

// the connection ------------------------------------------------------------------------------

link.onopen = () => {
  clock.reset();
  sound.reset();
  stage.reset();
  timeline.reset();
  for (const tracks of Object.values(timeline.kinds)) tracks.reset();
  status("live", "Connected");
  link.ask({ type: "state" });
  if (!pose.empty) link.ask(pose.message);
  subscribe();
};
link.onlost = (error) => {
  mirror.stop();
  status("lost", error ? "Refused" : "Reconnecting");
  if (error) at("stage-note").textContent = error.message;
};
link.onfeedback = (element, seq) => {
  log.feedback(element, seq);
  timeline.feedback(element);
  const id = element.getAttribute("id") ?? "";
  if (element.localName === "predictionFeedback") for (const block of element.children) block.localName === "bml" && alive.add(block.id);
  else if (element.localName === "warningFeedback") alive.delete(id);
  else if (element.localName === "blockProgress" && id.endsWith(":end")) alive.delete(id.slice(0, -4));
};
link.onreply = (message) => {
  mirror.reply(message);
  design.reply(message);
  label.reply(message);
  if (message.type === "gap") log.last = 0;
  if (message.type === "welcome") faces = message.capabilities.faces ?? [];
  if (message.type === "state") showVoice(message.characters[0]?.voice ?? message.voice.name);
  if (message.type === "subscribed" && message.stream === "mesh") showFace(message);
  if (message.type === "changed") {
    stage.reset();
    showFace(message);
  }
  if (message.type === "subscribed" && message.stream === "audio") sound.rate = message.rate;
  if (message.type === "subscribed" && message.stream in timeline.kinds) timeline.kinds[message.stream].begin(message.names);
  if (message.type === "error") {
    log.error(message.message);
    if (message.where?.startsWith("subscribe") || message.code === "face") at("stage-note").textContent = message.message;
  }
};
link.onframe = (frame) => {
  if (frame.stream === "mesh") {
    clock.heard(frame.time, performance.now() / 1000);
    stage.add(frame.time, frame.values(), frame.streamInfo?.face);
  } else if (frame.stream === "audio") {
    if (timeline.scrub !== null) return;
    sound.packet(frame.time, frame.values(), frame.forget);
    if (recorder.on) recorder.packet(frame.time, frame.values());
  } else if (frame.stream === "schedule") timeline.plan(frame);
  else {
    if (frame.stream === "fap") mirror.fap(frame.values());
    timeline.kinds[frame.stream]?.add(frame.time, frame.values());
  }
};

function subscribe() {
  if (document.hidden) return;
  link.subscribe("mesh", { fps: MESH_RATE });
  link.subscribe("audio", { rate: sound.rate });
  link.subscribe("schedule");
  for (const stream of Object.keys(timeline.kinds)) link.subscribe(stream, { fps: CURVE_RATE, ahead: AHEAD });
}

function status(state, text) {
  at("status").dataset.state = state;
  at("status-text").textContent = text;
  for (const id of ["play", "replace", "stop"]) at(id).disabled = state !== "live";
}

document.addEventListener("visibilitychange", () => {
  if (!link.open) return;
  if (document.hidden) link.unsubscribe("mesh");
  else {
    stage.reset();
    link.subscribe("mesh", { fps: MESH_RATE });
  }
});

// the face ------------------------------------------------------------------------------------

async function showFace(message) {
  showFaces(message);
  if (room.open) room.turn(true, faces, message.face);
  const key = `${message.face}/${message.vertices}`;
  if (face?.key === key) return;
  face = { key, name: message.face };
  try {
    await stage.load(message.face, message.scale, message.offset);
    at("stage-note").textContent = "";
    showLights();
    design.begin();
  } catch (error) {
    face = null;
    const again = !/: 4\d\d$/.test(error.message); // there is such a face, but the service is busy
    at("stage-note").textContent = `The face could not be shown: ${error.message}${again ? "; trying again" : ""}`;
    if (again) setTimeout(() => face === null && link.open && showFace(message), AGAIN);
  }
}

// A button for each face: it sets the character's face for all viewers.
function showFaces({ face }) {
  choose(at("faces"), faces, face, (name) => link.ask({ type: "character", face: name }));
}

// A button for each light; the colours of the pressed one come from its table.
function showLights() {
  const { lights, light } = stage.look;
  choose(at("lights"), Object.keys(lights), stage.light ?? light, (name) => stage.shine(name));
}

function scrub(time) {
  at("live").hidden = time === null;
  at("stage").classList.toggle("past", time !== null);
  if (time !== null) sound.forget(-Infinity);
}
at("live").onclick = () => timeline.look(null);

function draw() {
  const now = sound.playhead() ?? clock.playhead(performance.now() / 1000);
  const designed = design.frames();
  if (room.open) room.draw(performance.now());
  else stage.draw(designed?.time ?? timeline.scrub ?? now, recorder.on, designed?.frames);
  if (now !== null && performance.now() - looked > LOOK) {
    looked = performance.now();
    for (const [sliders, tracks] of [[units, timeline.kinds.au], [params, timeline.kinds.fap]]) sliders.see(tracks?.at(timeline.scrub ?? now) ?? {});
  }
  if (recorder.on) {
    recorder.draw();
    at("record").lastElementChild.textContent = `Stop ${recorder.seconds.toFixed(0)} s`;
  }
  label.draw();
  timeline.draw(now);
  requestAnimationFrame(draw);
}

// the script ----------------------------------------------------------------------------------

function play(replace) {
  if (at("play").disabled) return;
  hear();
  timeline.look(null);
  const text = editor.text;
  if (text.trim() && !isMarkup(text)) {
    // One text follows another. The log has what becomes of it, and why it is refused.
    link.speak(text, { composition: replace ? "REPLACE" : "APPEND" }).catch(() => {});
    return;
  }
  const id = text.match(BLOCK)?.[3];
  // An id is free again when its block has ended; until then the same document plays under a new one.
  const own = alive.has(id) ? text.replace(BLOCK, `$1$2$3-${++plays}$2`) : text;
  link.send(replace ? replacing(own) : own);
}

// The same document with composition="REPLACE" on its first <bml>.
function replacing(text) {
  return text.replace(/<((?:\w+:)?bml)\b([^>]*)>/, (_, tag, attributes) => {
    const others = attributes.replace(/\scomposition\s*=\s*("[^"]*"|'[^']*')/, "");
    return `<${tag} composition="REPLACE"${others}>`;
  });
}

function showFaults(found) {
  faults = found ?? [];
  const count = (some, one) => (some.length ? `${some.length} ${one}${some.length > 1 && one === "fault" ? "s" : ""}` : "");
  const bad = faults.filter(({ type }) => type !== "ADVICE");
  const advice = faults.filter(({ type }) => type === "ADVICE");
  const line = faults[0]?.spots[0]?.line;
  const first = faults[0] ? `${line ? `line ${line}: ` : ""}${faults[0].text}` : "";
  const empty = !editor.text.trim();
  mark();
  at("problems").dataset.state = found === null || empty ? "none" : bad.length ? "bad" : advice.length ? "advice" : "good";
  at("problems").title = first;
  at("problems-text").textContent = found === null ? "Not checked" : empty ? "Nothing to play yet" : faults.length ? `${[count(bad, "fault"), count(advice, "advice")].filter(Boolean).join(", ")}: ${first}` : "No faults";
}

at("problems").onclick = () => {
  if (faults[0]) editor.show(faults[0]);
};
at("play").onclick = () => play(false);
at("replace").onclick = () => play(true);
at("stop").onclick = () => link.ask({ type: "stop" });
at("clear").onclick = () => log.clear();

// In front of the editor, which has keys of its own.
addEventListener("keydown", (event) => {
  if (!(event.ctrlKey || event.metaKey)) return;
  if (event.key === "Enter") play(event.shiftKey);
  else if (event.key === ".") link.ask({ type: "stop" });
  else return;
  event.preventDefault();
  event.stopPropagation();
}, true);

// Load the example into the editor unchanged.
function mark() {
  for (const card of at("gallery").children) card.ariaPressed = String(card.value === editor.text);
}

async function examples() {
  const rows = await (await ask("examples.json")).json();
  const cards = rows.map((row) => {
    const about = row.bml.match(/<!--\s*([\s\S]*?)\s*-->/)?.[1].replace(/\s+/g, " ") ?? "";
    const card = make("button.card", { type: "button", value: row.bml, title: about }, make("b", {}, row.title), make("span", {}, about));
    card.onclick = () => {
      editor.text = row.bml;
      mark();
    };
    return card;
  });
  at("gallery").append(...cards);
  if (!editor.text) cards[0]?.click();
}

// voice, sound, film --------------------------------------------------------------------------

function showVoices(voices) {
  at("voice").replaceChildren(...voices.filter(({ available }) => available).map(({ name }) => make("option", { value: name }, name)));
  at("voice-pick").hidden = at("voice").length < 2;
}

function showVoice(name) {
  const known = [...at("voice").options].find(({ value }) => value === name) ?? [...at("voice").options].find(({ value }) => name?.startsWith(value));
  if (known) at("voice").value = known.value;
}
at("voice").onchange = () => link.ask({ type: "character", voice: at("voice").value });

function showSound() {
  at("sound").ariaPressed = String(sound.on);
  at("sound").lastElementChild.textContent = sound.on ? "Sound on" : "Sound off";
}
function hear() {
  sound.start();
  showSound();
}
at("sound").onclick = () => {
  sound.on ? sound.mute() : hear();
  showSound();
};

// Begin a film, or end it and save it.
async function film(on) {
  if (on === recorder.on) return;
  if (on) {
    hear();
    recorder.start();
  } else {
    const { blob, suffix } = await recorder.stop();
    download(blob, `face.${suffix}`);
    at("record").lastElementChild.textContent = "Record";
  }
  at("record").ariaPressed = String(recorder.on);
}
at("record").hidden = typeof MediaRecorder === "undefined";
at("record").onclick = () => film(!recorder.on);

// the pose ------------------------------------------------------------------------------------

tabs(at("tabs"), (tab) => {
  at("pose").hidden = ["tab-script", "tab-mirror", "tab-face", "tab-design", "tab-label"].includes(tab);
  at("face-stage").hidden = tab !== "tab-face";
  room.turn(tab === "tab-face", faces, face?.name);
  design.show(tab === "tab-design");
  label.turn(tab === "tab-label");
});
pose.addEventListener("change", () => {
  const parts = [pose.emotion && "an emotion", pose.aus.size && `${pose.aus.size} AU${pose.aus.size > 1 ? "s" : ""}`, pose.faps.size && `${pose.faps.size} FAP${pose.faps.size > 1 ? "s" : ""}`];
  at("held").textContent = pose.empty ? "" : `held: ${parts.filter(Boolean).join(", ")}`;
});
at("neutral").onclick = () => pose.clear();
at("save").onclick = async () => {
  try {
    download(await pose.file(face?.name), "pose.fap");
  } catch (error) {
    log.error(error.message);
  }
};

// the page ------------------------------------------------------------------------------------

function dress(theme) {
  document.documentElement.dataset.theme = theme;
  at("theme").ariaLabel = at("theme").title = `Theme: ${THEMES[theme]}`;
}
at("theme").onclick = () => {
  const all = Object.keys(THEMES);
  const next = all[(all.indexOf(document.documentElement.dataset.theme) + 1) % all.length];
  localStorage.setItem("theme", next);
  dress(next);
};
dress(localStorage.getItem("theme") in THEMES ? localStorage.getItem("theme") : "");
at("help").onclick = () => at("keys").showModal();

async function vocabulary() {
  const known = await (await ask("vocabulary.json")).json();
  editor.know(known);
  units.know(known);
  params.know(known);
  wheel.know(known);
  mirror.know(known);
  design.know(known);
  showVoices(known.voices);
  const unit = new Map(known.aus.map(({ au, name }) => [String(au), name]));
  const param = new Map(known.faps.map((row) => [row.name, row]));
  // A track is full at half a unit of a FAP; for eyes and head at half of their range.
  const reach = (name) => (param.get(name)?.unit === "angle_unit" ? 50_000 : 512);
  timeline.kinds = {
    au: new Tracks(() => 1, (number) => `${number} ${unit.get(number) ?? ""}`, (name) => name.replace(/[LR]$/, "")),
    fap: new Tracks(reach, (name) => `${param.get(name)?.fap} ${name.replaceAll("_", " ")}`, (name) => name),
  };
  choose(at("curves"), ["au", "fap"], "au", (kind) => timeline.show(kind), (kind) => kind.toUpperCase() + "s");
  timeline.show("au");
  if (link.open) {
    for (const stream of Object.keys(timeline.kinds)) link.subscribe(stream, { fps: CURVE_RATE, ahead: AHEAD });
    link.ask({ type: "state" });
  }
}

// Load what the page needs, again and again if the service does not answer; the first time that is reported.
async function insist(what, load, told = false) {
  try {
    await load();
  } catch (error) {
    if (!told) log.error(`${what}: ${error.message}; trying again`);
    setTimeout(() => insist(what, load, true), AGAIN);
  }
}

status("connecting", "Connecting");
for (const [what, load] of Object.entries({ examples, vocabulary })) insist(what, load);
link.connect();
requestAnimationFrame(draw);

// For tests of the page: what has been shown.
globalThis.realizerPage = { stage, sound, link, clock, editor, timeline, pose, recorder, room, mirror, design, label };
