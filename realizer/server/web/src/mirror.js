// The mirror: pictures of a camera or a film go to the service, which moves the face as the person in them moves.
import { packPicture } from "bml-realizer-client";
import { at, make } from "./dom.js";
import { download } from "./pose.js";
import { dial, spot } from "./wheel.js";

const FPS = 20; // most pictures a second
const WIDTH = 480; // pixels of a picture
const LEAST = 0.05; // a smaller action unit is not listed
const CURVE_RATE = 25; // frames a second of the FAP stream

export class Mirror {
  // link: the connection; told(text): what could not be done.
  constructor(link, told) {
    Object.assign(this, { link, told, running: false, frame: 0, waits: false, rows: null, faps: [], units: [] });
    this.video = at("mirror-video");
    this.canvas = document.createElement("canvas");
    at("mirror-camera").onclick = () => this.camera();
    at("mirror-film").onclick = () => at("mirror-file").click();
    at("mirror-file").onchange = () => at("mirror-file").files[0] && this.film(at("mirror-file").files[0]);
    at("mirror-stop").onclick = () => this.stop();
    at("mirror-record").onclick = () => (this.rows ? this.save() : this.record());
    this.video.onended = () => this.stop();
  }

  know({ aus, wheel }) {
    this.names = new Map(aus.map(({ au, name }) => [String(au), name]));
    this.emotions = new Map(wheel.map((row) => [row.name, row]));
    const [picture, dot] = dial();
    at("mirror-wheel").replaceChildren(picture);
    this.dot = dot;
  }

  async camera() {
    try {
      this.start(await navigator.mediaDevices.getUserMedia({ video: { width: 640, frameRate: FPS }, audio: false }), null);
    } catch (error) {
      this.told(`The camera cannot be used: ${error.message}`);
    }
  }

  film(file) {
    at("mirror-file").value = "";
    this.start(null, file);
  }

  async start(stream, file) {
    this.stop();
    this.stream = stream;
    this.video.srcObject = stream;
    if (file) this.video.src = URL.createObjectURL(file);
    this.video.classList.toggle("turned", Boolean(stream)); // as in a mirror
    try {
      await this.video.play();
    } catch (error) {
      this.stop();
      return this.told(`The film cannot be shown: ${error.message}`);
    }
    this.running = true;
    this.waits = false;
    this.show();
    this.link.ask({ type: "track", fps: FPS });
    this.look();
  }

  stop() {
    if (this.running) this.link.ask({ type: "track", fps: 0 });
    this.running = false;
    clearTimeout(this.timer);
    for (const track of this.stream?.getTracks() ?? []) track.stop();
    if (this.video.src) URL.revokeObjectURL(this.video.src);
    this.stream = this.video.srcObject = null;
    this.video.removeAttribute("src");
    // The face lets go of what it was made to show.
    if (this.units.length) this.link.ask({ type: "set", aus: Object.fromEntries(this.units.map((name) => [name, null])) });
    this.units = [];
    this.show();
  }

  // Send the picture of now, unless the last one is still looked at.
  look() {
    if (!this.running) return;
    this.timer = setTimeout(() => this.look(), 1000 / FPS);
    const { videoWidth, videoHeight } = this.video;
    if (this.waits || !videoWidth || document.hidden) return;
    this.waits = true;
    const scale = Math.min(1, WIDTH / videoWidth);
    Object.assign(this.canvas, { width: Math.round(videoWidth * scale), height: Math.round(videoHeight * scale) });
    this.canvas.getContext("2d").drawImage(this.video, 0, 0, this.canvas.width, this.canvas.height);
    this.canvas.toBlob((blob) => this.send(blob), "image/jpeg", 0.85);
  }

  async send(blob) {
    const message = packPicture(++this.frame, new Uint8Array(await blob.arrayBuffer()));
    if (this.running) this.link.send(message);
  }

  // A reply of the service.
  reply(message) {
    if (message.type === "error" && message.where === "track") {
      this.stop();
      return this.told(message.message);
    }
    if (message.type !== "tracked" || !this.running) return;
    this.waits = false;
    at("mirror-seen").textContent = message.face ? "" : "no face in the picture";
    if (!message.face) return;
    this.units = Object.keys(message.aus);
    this.rows?.push([message.time, message.aus]);
    const shown = Object.entries(message.aus).filter(([, value]) => value >= LEAST).sort(([, a], [, b]) => b - a);
    at("mirror-units").replaceChildren(...shown.map(([name, value]) => this.bar(name, value)));
    const [pitch, yaw, roll] = message.head ?? [0, 0, 0];
    const sure = message.emotion ? `${message.emotion} ${Math.round(100 * (message.certainty ?? 1))} %, ` : "";
    at("mirror-seen").textContent = `${sure}head ${pitch.toFixed(0)}° down, ${yaw.toFixed(0)}° left, ${roll.toFixed(0)}° tilted`;
    const home = this.emotions?.get(message.emotion);
    if (this.dot) spot(this.dot, home && home.angle !== null ? [home.angle, (home.activation ?? 7) * (message.certainty ?? 1)] : null);
  }

  bar(name, value) {
    const [, number, side = ""] = /^(\d+)([LR]?)$/.exec(name) ?? [null, name];
    const words = `AU ${number} ${this.names?.get(number) ?? ""} ${{ L: "left", R: "right", "": "" }[side]}`;
    return make("li", {}, make("span", {}, words.trim()), make("meter", { min: 0, max: 1, value, ariaLabel: words }));
  }

  // A frame of the stream of FAPs.
  fap(values) {
    if (this.rows && this.running) this.faps.push(Array.from(values));
  }

  record() {
    this.rows = [];
    this.faps = [];
    this.show();
  }

  // Save what was recorded as numbers: action units with their times, and FAPs. No picture is kept.
  save() {
    const [rows, faps] = [this.rows, this.faps];
    this.rows = null;
    this.show();
    if (!rows.length) return this.told("Nothing was recorded: there was no face in the pictures.");
    const names = [...new Set(rows.flatMap(([, aus]) => Object.keys(aus)))].sort((a, b) => parseInt(a) - parseInt(b) || (a < b ? -1 : 1));
    const lines = rows.map(([time, aus]) => [(time - rows[0][0]).toFixed(3), ...names.map((name) => aus[name] ?? 0)].join(","));
    download(new Blob([["time", ...names].join(","), "\n", lines.join("\n"), "\n"], { type: "text/csv" }), "mirror.csv");
    const mask = Array.from({ length: 68 }, (_, k) => (k < 2 ? 0 : 1)).join(" ");
    const frames = faps.map((values, k) => `${mask}\n${[k, ...values.slice(2)].join(" ")}\n`);
    if (faps.length) download(new Blob([`2.1 mirror ${CURVE_RATE} ${faps.length}\n`, ...frames], { type: "text/x-fap" }), "mirror.fap");
  }

  show() {
    at("mirror-stop").disabled = !this.running;
    at("mirror-record").disabled = !this.running && !this.rows; // what was recorded can be saved after the film's end
    at("mirror-video").hidden = !this.running;
    at("mirror-record").textContent = this.rows ? "Save" : "Record";
    at("mirror-record").ariaPressed = String(Boolean(this.rows));
    if (this.running) return;
    at("mirror-units").replaceChildren();
    at("mirror-seen").textContent = "";
    if (this.dot) spot(this.dot, null);
  }
}
