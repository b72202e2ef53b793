import { DOMParser } from "@xmldom/xmldom";

export { WebSocket } from "ws";

export const parseXml = (text) => new DOMParser().parseFromString(text, "text/xml").documentElement;
