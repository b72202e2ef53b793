// Refusals that another try does not mend, by a service that only refuses.
import assert from "node:assert/strict";
import { once } from "node:events";
import { after, test } from "node:test";
import { WebSocketServer } from "ws";
import { Realizer } from "bml-realizer-client";

const TOKEN = "token: wanted that of this service (REALIZER_TOKEN), got none";
const servers = [];
after(() => servers.forEach((server) => server.close()));

/** Return a client of a service that treats connections so, and the number of connections there were. */
async function clientOf(refuse, options = {}) {
  const server = new WebSocketServer({ port: 0, host: "127.0.0.1", ...options });
  servers.push(server);
  const tries = { count: 0 };
  server.on("connection", (socket) => refuse(socket, (tries.count += 1)));
  await once(server, "listening");
  return [new Realizer({ url: `ws://127.0.0.1:${server.address().port}/ws`, token: "secret" }), tries];
}

/** Check that nothing is tried again, and that everything is rejected with a code. */
async function isRefused(client, code, text) {
  const lost = new Promise((resolve) => (client.onlost = resolve));
  const played = client.connect() && client.play("<bml id='b'/>");
  await assert.rejects(played, { code, message: text });
  assert.equal((await lost).code, code);
  for (const call of [client.play("<bml id='b'/>"), client.ask({ type: "state" }), client.ended("b")]) await assert.rejects(call, { code });
  assert.equal(client.open, false);
}

test("a missing token rejects everything", async () => {
  const [client, tries] = await clientOf((socket) => {
    socket.on("message", () => {
      socket.send(JSON.stringify({ type: "error", code: "token", where: "hello.token", message: TOKEN }));
      socket.close(1008, TOKEN);
    });
  });
  await isRefused(client, "token", TOKEN);
  assert.equal(tries.count, 1);
});

test("a token that has expired rejects everything", async () => {
  const [client] = await clientOf((socket) => socket.close(1008, "token: it has expired"));
  await isRefused(client, "token", "token: it has expired");
});

test("another version of the service rejects everything", async () => {
  const error = { type: "error", code: "version", where: "hello.version", message: "version: wanted 2" };
  const [client] = await clientOf((socket) => socket.on("message", () => socket.send(JSON.stringify(error))));
  await isRefused(client, "version", "version: wanted 2");
});

test("a refused handshake rejects everything", async () => {
  const verifyClient = (_, answer) => answer(false, 401, `${TOKEN}\n`);
  const [client] = await clientOf(() => {}, { verifyClient });
  await isRefused(client, "token", TOKEN);
});

test("a busy service is tried again, and the token is not shown", async () => {
  const refused = { count: 0 };
  const verifyClient = (_, answer) => (refused.count++ ? answer(true) : answer(false, 503, "memory"));
  const [client] = await clientOf((socket) => socket.send(JSON.stringify({ type: "welcome", connection: 1 })), { verifyClient });
  const opened = new Promise((resolve) => (client.onopen = resolve));
  await assert.rejects(client.connect(), ({ code, message }) => code === "connection" && !message.includes("secret"));
  await opened;
  client.close();
});
