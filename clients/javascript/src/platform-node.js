import { DOMParser } from "@xmldom/xmldom";
import { WebSocket as Socket } from "ws";
import { RealizerError } from "./frames.js";

const CODES = { 400: "invalid", 401: "token", 403: "token" }; // of refusals that another try does not mend

/** A WebSocket whose `refusal` is the error of a handshake that was refused for good; browsers do not say why. */
export class WebSocket extends Socket {
  constructor(url) {
    super(url);
    this.on("unexpected-response", async (_, response) => {
      const parts = await response.toArray().catch(() => []);
      const code = CODES[response.statusCode];
      if (code) this.refusal = new RealizerError(Buffer.concat(parts).toString().trim(), code);
      this.close();
    });
  }
}

export const parseXml = (text) => new DOMParser().parseFromString(text, "text/xml").documentElement;
