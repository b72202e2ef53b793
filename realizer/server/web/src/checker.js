// Checks texts as `realizer check` does: one request at a time, over its own WebSocket.
import { token } from "./service.js";

const AGAIN = 500; // ms until a connection that failed is tried once more

const later = () => new Promise((resolve) => setTimeout(resolve, AGAIN));

export class Checker {
  constructor() {
    this.socket = null;
    this.waiting = []; // {resolve, reject}, in the order of requests
  }

  // Return the faults of a text; reject if the service cannot be reached.
  async ask(text) {
    return (await this.send(text)).faults;
  }

  // Return the answer to a text, or to a request of the designer.
  async send(text) {
    const socket = await this.open().catch(() => later().then(() => this.open()));
    return new Promise((resolve, reject) => {
      this.waiting.push({ resolve, reject });
      socket.send(text);
    });
  }

  async open() {
    if (this.socket?.readyState === WebSocket.OPEN) return this.socket;
    return (this.opening ??= new Promise((resolve, reject) => {
      const url = new URL("check", location.href);
      url.protocol = url.protocol.replace("http", "ws");
      if (token) url.searchParams.set("token", token);
      const socket = new WebSocket(url);
      socket.onopen = () => {
        this.socket = socket;
        this.opening = null;
        resolve(socket);
      };
      socket.onmessage = (event) => this.waiting.shift()?.resolve(JSON.parse(event.data));
      socket.onclose = () => {
        this.opening = null;
        const lost = new Error("the service cannot be asked");
        for (const { reject: refuse } of this.waiting.splice(0)) refuse(lost);
        reject(lost);
      };
    }));
  }
}
