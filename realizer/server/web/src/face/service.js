// The questions of a tab to the service, over a WebSocket of their own: those of the Face tab at studio.
import { token } from "../service.js";

const AGAIN = 1500; // ms
const TYPES = { f4: Float32Array, f8: Float64Array, u4: Uint32Array, u1: Uint8Array };

export class StudioService extends EventTarget {
  constructor(path = "studio") {
    super();
    this.path = path;
    this.waiting = new Map();
    this.number = 0;
    this.head = null; // what is opened again on a new connection: [question, bytes]
  }

  connect() {
    if (this.socket) return;
    const address = new URL(this.path, location.href.replace(/^http/, "ws"));
    address.search = token ? `?token=${encodeURIComponent(token)}` : "";
    address.hash = "";
    this.socket = Object.assign(new WebSocket(address), { binaryType: "arraybuffer" });
    this.opened = new Promise((resolve) => {
      this.socket.onopen = () => {
        resolve(true);
        this.dispatchEvent(new Event("open"));
      };
      this.socket.onclose = () => {
        this.socket = null;
        resolve(false);
        for (const { reject } of this.waiting.values()) reject(lost("The connection was lost. Nothing that you edited is lost; try again when the page is connected."));
        this.waiting.clear();
        this.dispatchEvent(new Event("lost"));
        setTimeout(() => this.reconnect(), AGAIN);
      };
    });
    this.socket.onmessage = ({ data }) => this.answer(typeof data === "string" ? JSON.parse(data) : unpacked(data));
  }

  // A new connection knows no head: it gets the one that is edited.
  async reconnect() {
    this.connect();
    if ((await this.opened) && this.head) this.send(...this.head).catch(() => {});
  }

  answer(message) {
    const { resolve, reject } = this.waiting.get(message.id) ?? {};
    this.waiting.delete(message.id);
    if (message.error) reject?.(Object.assign(new Error(message.error), { conflict: message.conflict }));
    else resolve?.(message);
  }

  // Resolve to the answer; reject with a sentence.
  async ask(question, bytes) {
    this.connect();
    if (!(await this.opened)) throw lost("The service cannot be reached: nothing that you edited is lost.");
    const answer = await this.send(question, bytes);
    if (answer.type === "head") this.head = [question, bytes];
    return answer;
  }

  send(question, bytes) {
    const id = ++this.number;
    const text = JSON.stringify({ ...question, id });
    this.socket.send(bytes ? joined(text, bytes) : text);
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }
}

const lost = (words) => Object.assign(new Error(words), { lost: true });

function joined(text, bytes) {
  const json = new TextEncoder().encode(text);
  const out = new Uint8Array(4 + json.length + bytes.byteLength);
  new DataView(out.buffer).setUint32(0, json.length, true);
  out.set(json, 4);
  out.set(new Uint8Array(bytes), 4 + json.length);
  return out;
}

function unpacked(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const message = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const arrays = Object.entries(message.arrays).map(([name, [type, count, start]]) => [name, new TYPES[type](buffer, start, count)]);
  return { ...message, arrays: Object.fromEntries(arrays) };
}
