// A session over a WebSocket: documents and control messages out; feedback, frames and sound in.

export const KIND = { fap: 1, au: 2, picture: 3, sound: 4, mesh: 5 };
const HEADER = 16; // u8 kind, u8 version, u16 flags, u32 frame, f64 time
const FORGET = 0x100;

// A binary message taken apart; `payload` starts 16 bytes in, so that typed arrays may lie over it.
export function unpack(buffer) {
  const view = new DataView(buffer);
  const flags = view.getUint16(2, true);
  return {
    kind: view.getUint8(0),
    character: flags & 0xff,
    forget: (flags & FORGET) !== 0,
    frame: view.getUint32(4, true),
    time: view.getFloat64(8, true),
    buffer,
    offset: HEADER,
  };
}

// Feedback XML as {name, id, time, globalTime, seq, text}.
export function readFeedback(text) {
  const root = new DOMParser().parseFromString(text, "application/xml").documentElement;
  const inner = root.querySelector("*");
  const number = (name) => (root.hasAttribute(name) ? Number(root.getAttribute(name)) : undefined);
  return {
    name: root.localName,
    id: root.getAttribute("id") ?? inner?.getAttribute("id") ?? "",
    type: root.getAttribute("type") ?? "",
    globalTime: number("globalTime"),
    starts: inner?.getAttribute("globalStart") ?? undefined,
    ends: inner?.getAttribute("globalEnd") ?? undefined,
    text: root.textContent.trim(),
  };
}

export class Connection extends EventTarget {
  constructor(url, subscriptions) {
    super();
    this.url = url;
    this.subscriptions = subscriptions;
    this.closed = false;
    this.wait = 250;
    this.open();
  }

  open() {
    this.say("status", "connecting");
    const socket = new WebSocket(this.url);
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.wait = 250;
      this.say("status", "live");
      for (const subscription of this.subscriptions) this.control({ type: "subscribe", ...subscription });
    };
    socket.onmessage = ({ data }) => this.receive(data);
    socket.onclose = () => {
      if (this.closed) return;
      this.say("status", "lost");
      // A server that restarts is found again; the pause grows so that one that is gone is left in peace.
      setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(8000, this.wait * 2);
    };
  }

  receive(data) {
    if (typeof data !== "string") return this.say("frame", unpack(data));
    if (data.startsWith("<")) return this.say("feedback", readFeedback(data));
    const message = JSON.parse(data);
    this.say(message.type, message);
  }

  say(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  send(text) {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(text);
    return true;
  }

  control(message) {
    return this.send(JSON.stringify(message));
  }

  close() {
    this.closed = true;
    this.socket.close();
  }
}
