// What browsers have, and Node's modules replace.
export const WebSocket = globalThis.WebSocket;

export const parseXml = (text) => new DOMParser().parseFromString(text, "text/xml").documentElement;
