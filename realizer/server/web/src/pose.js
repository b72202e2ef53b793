// The values that the tools hold on the face: an emotion, action units, FAPs. Changes are sent once per drawn frame.
import { ask } from "./service.js";

export class Pose extends EventTarget {
  constructor(send) {
    super();
    this.send = send;
    this.emotion = null; // {angle, activation}
    this.aus = new Map(); // "12L" -> 0..1
    this.faps = new Map(); // name -> FAPU
    this.changes = null;
  }

  get empty() {
    return !this.emotion && !this.aus.size && !this.faps.size;
  }

  // Hold values, or release them with null: {emotion, aus: {name: value}, faps: {name: value}}.
  set({ emotion, aus = {}, faps = {} }) {
    for (const [kept, given] of [[this.aus, aus], [this.faps, faps]]) {
      for (const [name, value] of Object.entries(given)) value === null ? kept.delete(name) : kept.set(name, value);
    }
    if (emotion !== undefined) this.emotion = emotion;
    if (!this.changes) requestAnimationFrame(() => this.flush());
    const { aus: before, faps: also, ...rest } = this.changes ?? {};
    this.changes = { ...rest, ...(emotion === undefined ? {} : { emotion }), aus: { ...before, ...aus }, faps: { ...also, ...faps } };
    this.dispatchEvent(new Event("change"));
  }

  flush() {
    if (this.changes) this.send({ type: "set", ...this.changes });
    this.changes = null;
  }

  clear() {
    const none = (kept) => Object.fromEntries([...kept.keys()].map((name) => [name, null]));
    this.set({ emotion: null, aus: none(this.aus), faps: none(this.faps) });
  }

  // All values as one message, for a new session.
  get message() {
    return { type: "set", emotion: this.emotion, aus: Object.fromEntries(this.aus), faps: Object.fromEntries(this.faps) };
  }

  // All values as a FAP file, made by the service; reject with its error text.
  async file(face) {
    const query = new URLSearchParams({ set: JSON.stringify(this.message), ...(face ? { face } : {}) });
    const answer = await ask(`pose.fap?${query}`);
    if (!answer.ok) throw new Error((await answer.text()).trim());
    return answer.blob();
  }
}

export function download(blob, name) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
