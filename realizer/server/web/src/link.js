// One WebSocket to the service: text and frames in, taken apart; comes back by itself, with the feedback it missed.

const RETRY = [0.3, 0.6, 1.2, 2.5, 5]; // s
const HEADER = 16; // bytes: u8 kind, u8 version, u16 flags, u32 frame, f64 time

export class Link {
  constructor(session) {
    this.session = session;
    this.seen = null;
    this.tries = 0;
    this.socket = null;
  }

  get open() {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  connect() {
    const url = new URL("ws", location.href);
    url.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    url.search = new URLSearchParams({ session: this.session, ...(this.seen === null ? {} : { seen: this.seen }) });
    const socket = (this.socket = new WebSocket(url));
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.tries = 0;
      this.onopen();
    };
    socket.onmessage = (event) => this.receive(event.data);
    socket.onclose = () => {
      this.onlost();
      setTimeout(() => this.connect(), 1000 * RETRY[Math.min(this.tries++, RETRY.length - 1)]);
    };
  }

  send(text) {
    if (this.open) this.socket.send(text);
  }

  ask(message) {
    this.send(JSON.stringify(message));
  }

  receive(data) {
    if (data instanceof ArrayBuffer) this.onframe(frameOf(data));
    else if (data.startsWith("{")) {
      const message = JSON.parse(data);
      // Another life of the session: its numbers start again.
      if (message.type === "gap") this.seen = null;
      this.onreply(message);
    } else {
      const element = new DOMParser().parseFromString(data, "text/xml").documentElement;
      const seq = Number([...element.attributes].find((a) => a.localName === "seq")?.value);
      if (seq) this.seen = seq;
      this.onfeedback(element, seq);
    }
  }
}

function frameOf(buffer) {
  const view = new DataView(buffer);
  return {
    kind: view.getUint8(0),
    character: view.getUint16(2, true) & 0xff,
    forget: Boolean(view.getUint16(2, true) & 0x100),
    frame: view.getUint32(4, true),
    time: view.getFloat64(8, true),
    values: () => new Int16Array(buffer, HEADER),
  };
}
