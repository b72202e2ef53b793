// The page: a live face, a document to play on it, and what the realizer says of it.

import { Connection, KIND } from "./connection.js";
import { FaceView } from "./face.js";
import { Clock, Sound } from "./sound.js";

const RATE = 22050;
const $ = (id) => document.getElementById(id);
const session = new URLSearchParams(location.search).get("session");
const url = `${location.origin.replace("http", "ws")}/ws${session ? `?session=${encodeURIComponent(session)}` : ""}`;

const view = new FaceView($("face"));
const clock = new Clock();
const sound = new Sound(clock, RATE);
const queue = []; // mesh frames that wait for their time
let mesh = null; // what `subscribed` said of the mesh stream
let loaded = null;
let count = 0;

const connection = new Connection(url, [
  { stream: "mesh", fps: 25 },
  { stream: "audio", rate: RATE },
]);

connection.addEventListener("status", ({ detail }) => {
  $("status").dataset.state = detail;
  $("status").textContent = { connecting: "connecting", live: "live", lost: "connection lost, trying again" }[detail];
});

connection.addEventListener("subscribed", async ({ detail }) => {
  if (detail.stream !== "mesh") return;
  mesh = detail;
  if (loaded === detail.face) return;
  loaded = detail.face;
  try {
    await view.load(detail.face);
  } catch (error) {
    tell("error", `the face cannot be shown: ${error.message}`);
  }
});

connection.addEventListener("frame", ({ detail: frame }) => {
  if (frame.kind === KIND.mesh) {
    clock.hear(frame.time);
    queue.push(frame);
  } else if (frame.kind === KIND.sound) {
    sound.play(frame);
  }
});

connection.addEventListener("feedback", ({ detail }) => {
  const { name, id, type, text, starts, ends } = detail;
  if (name === "predictionFeedback" && ends === undefined) return; // the acknowledgement says nothing new
  const planned = `${id} from ${Number(starts).toFixed(2)} s to ${Number(ends).toFixed(2)} s`;
  const words = { predictionFeedback: planned, warningFeedback: `${id} ${type}: ${text}` }[name] ?? id;
  tell(name, words, detail.globalTime);
});
connection.addEventListener("error", ({ detail }) => {
  if (detail?.message) tell("error", detail.message);
});

function tell(kind, words, time) {
  const item = document.createElement("li");
  item.className = kind;
  const stamp = document.createElement("time");
  stamp.textContent = time === undefined ? "" : `${time.toFixed(2)} s`;
  const said = document.createElement("span");
  said.textContent = words;
  item.append(stamp, said);
  const log = $("log");
  const atEnd = log.scrollTop + log.clientHeight > log.scrollHeight - 40;
  log.append(item);
  while (log.children.length > 500) log.firstChild.remove();
  if (atEnd) log.scrollTop = log.scrollHeight;
}

function draw() {
  requestAnimationFrame(draw);
  const now = clock.now();
  let due = null;
  while (queue.length && (queue[0].time <= now || queue.length > 25)) due = queue.shift();
  if (due && mesh) view.show(due, mesh);
  view.draw();
}
requestAnimationFrame(draw);

// The same document can be played again and again: its id gets a number while the earlier one may still play.
function fresh(text) {
  count += 1;
  return text.replace(/(<(?:[\w.-]+:)?bml\b[^>]*?\sid\s*=\s*)(["'])(.*?)\2/, `$1$2$3-${count}$2`);
}

function play(composition) {
  let text = fresh($("document").value);
  if (composition) {
    text = text.replace(/(<(?:[\w.-]+:)?bml\b[^>]*?)\scomposition\s*=\s*(["']).*?\2/, "$1");
    text = text.replace(/<((?:[\w.-]+:)?bml)\b/, `<$1 composition="${composition}"`);
  }
  if (!connection.send(text)) tell("error", "not sent: there is no connection");
}

$("play").addEventListener("click", () => play());
$("replace").addEventListener("click", () => play("REPLACE"));
$("stop").addEventListener("click", () => connection.control({ type: "stop" }));
$("document").addEventListener("keydown", (e) => {
  if (e.key === "Enter" && (e.ctrlKey || e.metaKey)) {
    e.preventDefault();
    play();
  }
});
$("sound").addEventListener("click", async () => {
  const on = await sound.toggle();
  $("sound").setAttribute("aria-pressed", on);
  $("sound").textContent = on ? "Turn sound off" : "Turn sound on";
});

async function gallery() {
  const examples = await (await fetch("/examples.json")).json();
  const buttons = examples.map(({ title, bml }) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = title;
    button.addEventListener("click", () => {
      $("document").value = bml;
      for (const other of buttons) other.setAttribute("aria-pressed", other === button);
    });
    return button;
  });
  $("gallery").append(...buttons);
  buttons[0]?.click();
}
gallery();

// For tests: what has been shown.
window.realizerPage = { view, get waiting() { return queue.length; } };
