// The page: wires the face, the sound, the editor and the feedback log to one WebSocket.
import { Log } from "./log.js";
import { Clock, Realizer, Sound } from "./realizer.js";
import { Score } from "./score.js";
import { Stage } from "./stage.js";

const MESH_RATE = 30; // frames a second; the page draws between them
const BLOCK = /(<(?:\w+:)?bml\b[^<>]*?\sid\s*=\s*)(["'])(.*?)\2/;
const at = (id) => document.getElementById(id);

const stage = new Stage(at("face"));
const clock = new Clock();
const sound = new Sound(clock);
const log = new Log(at("log"));
const score = new Score(at("score"));
const name = new URLSearchParams(location.search).get("session") ?? `page-${crypto.getRandomValues(new Uint32Array(2)).join("-")}`;
const link = new Realizer({ session: name });

const alive = new Set(); // ids of blocks that were accepted and have not ended
let plays = 0;
let face = null;
let faces = []; // names of those that the service has

link.onopen = () => {
  clock.reset();
  sound.reset();
  stage.reset();
  status("live", "Connected");
  link.ask({ type: "hello" });
  subscribe();
};
link.onlost = () => status("lost", "Reconnecting");
link.onfeedback = (element, seq) => {
  log.feedback(element, seq);
  score.feedback(element);
  const id = element.getAttribute("id") ?? "";
  if (element.localName === "predictionFeedback") for (const block of element.children) block.localName === "bml" && alive.add(block.id);
  else if (element.localName === "warningFeedback") alive.delete(id);
  else if (element.localName === "blockProgress" && id.endsWith(":end")) alive.delete(id.slice(0, -4));
};
link.onreply = (message) => {
  if (message.type === "welcome") faces = message.capabilities.faces ?? [];
  if (message.type === "subscribed" && message.stream === "mesh") showFace(message);
  if (message.type === "subscribed" && message.stream === "audio") sound.rate = message.rate;
  if (message.type === "error") {
    log.error(message);
    if (message.where?.startsWith("subscribe") || message.code === "face") at("stage-note").textContent = message.message;
  }
};
link.onframe = (frame) => {
  if (frame.kind === 5) {
    clock.heard(frame.time, performance.now() / 1000);
    stage.add(frame.time, frame.values());
  } else if (frame.kind === 4) {
    sound.packet(frame.time, frame.values(), frame.forget);
  }
};

function subscribe() {
  if (document.hidden) return;
  link.ask({ type: "subscribe", stream: "mesh", fps: MESH_RATE });
  link.ask({ type: "subscribe", stream: "audio", rate: sound.rate });
}

async function showFace(message) {
  showFaces(message);
  const key = `${message.face}/${message.vertices}`;
  if (face === key) return;
  face = key;
  try {
    await stage.load(message.face, message.scale, message.offset);
    at("stage-note").textContent = "";
    showLights();
  } catch (error) {
    face = null;
    at("stage-note").textContent = `The face could not be shown: ${error.message}`;
  }
}

// A button for each face there is: the character gets it, and the mesh begins anew.
function showFaces({ face }) {
  choose("faces", faces, face, (name) => {
    link.ask({ type: "character", face: name });
    link.ask({ type: "unsubscribe", stream: "mesh" });
    stage.reset();
    link.ask({ type: "subscribe", stream: "mesh", fps: MESH_RATE });
  });
}

// A button for each light there is; the one that is pressed is told by its table.
function showLights() {
  const { lights, light } = stage.look;
  const own = Object.keys(lights).find((name) => JSON.stringify(lights[name]) === JSON.stringify(light));
  choose("lights", Object.keys(lights), stage.light ?? own, (name) => stage.shine(name));
}

// Buttons of which one is pressed.
function choose(place, names, pressed, take) {
  const buttons = names.map((name) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = name[0].toUpperCase() + name.slice(1);
    button.setAttribute("aria-pressed", String(name === pressed));
    button.onclick = () => {
      take(name);
      for (const other of buttons) other.setAttribute("aria-pressed", String(other === button));
    };
    return button;
  });
  at(place).replaceChildren(...buttons);
  at(place).hidden = buttons.length < 2;
}

function status(state, text) {
  at("status").dataset.state = state;
  at("status-text").textContent = text;
  for (const id of ["play", "replace", "stop"]) at(id).disabled = state !== "live";
}

function play(replace) {
  sound.start();
  showSound();
  const text = at("document").value;
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

function showSound() {
  at("sound").setAttribute("aria-pressed", String(sound.on));
  at("sound").textContent = sound.on ? "Sound on" : "Sound off";
}

at("play").onclick = () => play(false);
at("replace").onclick = () => play(true);
at("stop").onclick = () => link.ask({ type: "stop" });
at("clear").onclick = () => log.clear();
at("points").onchange = (event) => at("log").classList.toggle("no-points", !event.target.checked);
at("sound").onclick = () => {
  sound.on ? sound.mute() : sound.start();
  showSound();
};
addEventListener("keydown", (event) => {
  if (event.key === "Enter" && (event.ctrlKey || event.metaKey)) {
    event.preventDefault();
    if (!at("play").disabled) play(event.shiftKey);
  }
});
document.addEventListener("visibilitychange", () => {
  if (!link.open) return;
  if (document.hidden) link.ask({ type: "unsubscribe", stream: "mesh" });
  else {
    stage.reset();
    link.ask({ type: "subscribe", stream: "mesh", fps: MESH_RATE });
  }
});

function draw() {
  const playhead = sound.playhead() ?? clock.playhead(performance.now() / 1000);
  stage.draw(playhead);
  score.draw(playhead);
  requestAnimationFrame(draw);
}

async function examples() {
  const rows = await (await fetch("examples.json")).json();
  const buttons = rows.map((row) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = row.title;
    button.onclick = () => {
      at("document").value = row.bml;
      at("document").scrollTop = 0;
      for (const other of buttons) other.setAttribute("aria-pressed", String(other === button));
    };
    return button;
  });
  at("gallery").append(...buttons);
  if (!at("document").value) buttons[0]?.click();
}

status("connecting", "Connecting");
examples().catch((error) => log.error({ message: `examples: ${error.message}` }));
link.connect();
requestAnimationFrame(draw);

// For whoever tests the page: what has been shown.
globalThis.realizerPage = { stage, sound, link, clock };
