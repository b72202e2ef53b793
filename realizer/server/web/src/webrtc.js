// A page that plays a session by WebRTC, and sends texts to it. Its address has the options: session, token, size, ...
import { watch } from "bml-realizer-client";

const $ = (id) => document.getElementById(id);
const options = { session: "webrtc", ...Object.fromEntries(new URLSearchParams(location.search)) };
const url = new URL(".", location.href);

const show = (state, text) => {
  $("status").dataset.state = state;
  $("status-text").textContent = text;
};

async function start() {
  const { stream, connection } = await watch({ ...options, url });
  const changed = () => {
    const state = connection.connectionState;
    if (state === "connected") show("live", `Session ${options.session}`);
    else if (state === "failed" || state === "disconnected") show("lost", "The connection is lost: reload the page");
  };
  connection.onconnectionstatechange = changed;
  changed();
  $("view").srcObject = stream;
  addEventListener("pagehide", () => connection.close());
}

$("sound").onclick = () => {
  const { muted } = $("view");
  $("view").muted = !muted;
  $("sound").setAttribute("aria-pressed", muted);
  $("sound").textContent = muted ? "Sound on" : "Sound off";
};

$("say").onsubmit = async (event) => {
  event.preventDefault();
  const target = new URL(`sessions/${encodeURIComponent(options.session)}/bml`, url);
  if (options.token) target.searchParams.set("token", options.token);
  const answer = await fetch(target, { method: "POST", headers: { "Content-Type": "text/plain" }, body: $("text").value });
  $("fault").textContent = answer.ok ? "" : (await answer.json()).error;
};

start().catch((error) => {
  show("lost", "Not connected");
  $("fault").textContent = error.message;
});
