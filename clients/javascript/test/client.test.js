// The client against a real service, whose address is REALIZER_URL; tests/clients/test_javascript.py starts one.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { BMLA, Realizer, RealizerError, frameOf } from "bml-realizer-client";

const url = process.env.REALIZER_URL ?? "ws://127.0.0.1:8765/ws";
const NOD = (id) => `<bml id="${id}"><head id="n" lexeme="NOD"/></bml>`;
const RATE = 16000;
const tone = (seconds) => Int16Array.from({ length: seconds * RATE }, (_, k) => 9000 * Math.sin(k * 0.06));
let realizer;

before(async () => {
  realizer = new Realizer({ url });
  await realizer.connect();
});
after(() => realizer.close());

test("play resolves with the end of the block", async () => {
  assert.equal((await realizer.play(NOD("a"))).getAttribute("id"), "a:end");
});

test("play rejects a block that is refused", async () => {
  await assert.rejects(realizer.play("<bml id='b'><nonsense"), RealizerError);
});

test("play rejects every document that is refused", async () => {
  const documents = [
    "<bml xmlns='http://www.bml-initiative.org/bml/bml-2.0' id='b'/>",
    "<bml id='a:b'/>",
    "<bml id='bml'/>",
    `<bml id='${"x".repeat(300)}'/>`,
    "<bml id='b'/><bml id='c'",
    "<bml id='b'/><bml id='b'/>",
    `<bml id='b'/><bml id='c'/>${" ".repeat(1 << 20)}`,
    "hello",
    ' {"type":"foo"}',
    "<!-- later -->",
  ];
  for (const document of documents) await assert.rejects(realizer.play(document), { code: "refused" }, document.slice(0, 99));
});

test("play follows the block that the service plays", async () => {
  const documents = {
    "<bml><head type='NOD'/></bml>": /^unnamed\d+:end$/,
    "<act><participant id='x'/><bml><head type='NOD'/></bml></act>": /^unnamed\d+:end$/,
    "<bml id=' b '/>": /^b:end$/,
    "<bml id='&#98;2'/>": /^b2:end$/,
    "<bml id='b3'><bml id='c'/></bml>": /^b3:end$/,
    "<bml id='b4'><speech id='s'><text><![CDATA[<bml id='z'/>]]></text></speech></bml>": /^b4:end$/,
    "```xml\n<bml id='b5'/>\n```": /^b5:end$/,
  };
  for (const [document, id] of Object.entries(documents)) assert.match((await realizer.play(document)).getAttribute("id"), id);
});

test("play of an id in use leaves the older block alone", async () => {
  const [first, second] = await Promise.allSettled([realizer.play(NOD("twice")), realizer.play(NOD("twice"))]);
  assert.equal(first.value.getAttribute("id"), "twice:end");
  assert.match(second.reason.message, /still in use/);
});

test("play of an id in use by another client rejects", async () => {
  const clients = [0, 1].map(() => new Realizer({ url, session: "tabs" }));
  await Promise.all(clients.map((client) => client.connect()));
  const ends = await Promise.allSettled(clients.map((client) => client.play(NOD("twice"))));
  assert.deepEqual(ends.map(({ status }) => status).sort(), ["fulfilled", "rejected"]);
  for (const client of clients) client.close();
});

test("voice with the id of one that is being spoken leaves that alone", async () => {
  const [first, second] = [0, 1].map(() => {
    const voice = realizer.voice({ rate: RATE, id: "turn" });
    voice.write(tone(0.5));
    voice.close();
    return voice.ended();
  });
  await assert.rejects(second, /closed and being spoken/);
  assert.equal((await first).getAttribute("id"), "turn:end");
});

test("ask rejects every message that is refused", async () => {
  const refused = {
    "set.emotion.name": { type: "set", emotion: { name: "nosuch" } },
    "character.face": { type: "character", id: "Zoe", face: "nosuch" },
    "stop.blocks": { type: "stop", blocks: ["zzz"] },
    "speech.clip": { type: "speech", id: "s", clip: "nosuch" },
    type: { type: "nosuch" },
  };
  const good = realizer.ask({ type: "set", aus: { 12: 0.1 } });
  for (const [where, message] of Object.entries(refused)) await assert.rejects(realizer.ask(message), { name: "RealizerError", where });
  assert.equal(await good, null);
  assert.equal(await realizer.ask({ type: "set", aus: { 12: null } }), null);
  assert.equal((await realizer.ask({ type: "ping", id: 7 })).id, 7);
});

test("ask before the connection is open is sent then", async () => {
  const early = new Realizer({ url });
  const refused = early.ask({ type: "set", emotion: { name: "nosuch" } });
  early.connect();
  await assert.rejects(refused, { where: "set.emotion.name" });
  early.close();
});

test("connect rejects without a service", async () => {
  const lost = new Realizer({ url: "ws://127.0.0.1:1/ws" });
  await assert.rejects(lost.connect(), { code: "connection" });
  lost.close();
});

test("play, say and state reject after close", async () => {
  const closed = new Realizer({ url });
  await closed.connect();
  closed.close();
  const calls = [closed.play(NOD("late")), closed.say(tone(0.1), { rate: RATE }), closed.ask({ type: "state" })];
  for (const call of calls) await assert.rejects(call, { code: "connection" });
});

test("Realizer needs an address outside of pages", () => {
  assert.throws(() => new Realizer(), /wanted the url/);
});

test("faps passes on frames of 68 values one by one", async () => {
  const info = await new Promise((resolve, reject) => {
    const frames = [];
    realizer.faps({ fps: 50 }, (frame) => frames.push(frame) === 10 && resolve(frames)).catch(reject);
  });
  assert.deepEqual(info.map((frame) => frame.values().length), Array(10).fill(68));
  assert.deepEqual(info.map((frame) => frame.frame - info[0].frame), [...Array(10).keys()]);
  realizer.unsubscribe("fap");
});

test("subscribe rejects an unknown stream", async () => {
  await assert.rejects(realizer.subscribe("smell"), { code: "unsupported" });
});

test("say plays a clip with the times of its words", async () => {
  const end = await realizer.say(tone(0.6), { rate: RATE, words: [[0.05, "Hello"], [0.3, "there"]], id: "hello" });
  assert.equal(end.getAttribute("id"), "hello:end");
});

test("say plays a clip of which nothing else is known", async () => {
  assert.match((await realizer.say(tone(0.4), { rate: RATE })).getAttribute("id"), /^say-\d+:end$/);
});

test("say rejects sound that is no file", async () => {
  await assert.rejects(realizer.say(new Uint8Array([1, 2, 3])), { code: "clip" });
});

test("say rejects words whose times go back", async () => {
  const words = [[0.3, "there"], [0.05, "Hello"]];
  await assert.rejects(realizer.say(tone(0.6), { rate: RATE, words }), { where: "speech.words" });
});

test("say rejects what is no sound and no word", async () => {
  await assert.rejects(realizer.say("hello"), TypeError);
  await assert.rejects(realizer.say(Float32Array.from(tone(0.1)), { rate: RATE }), /from -1 to 1, got/);
  await assert.rejects(realizer.say(new Float32Array([0, NaN]), { rate: RATE }), /from -1 to 1, got NaN/);
  await assert.rejects(realizer.say(tone(0.1), { rate: 0.5 }), /rate: wanted samples a second/);
  assert.throws(() => realizer.voice({ rate: 0.5, id: "rate" }), /rate: wanted samples a second/);
  assert.equal((await realizer.play(NOD("rate"))).getAttribute("id"), "rate:end");
  await assert.rejects(realizer.say(tone(0.1), { rate: RATE, words: ["Hello"] }), /words\[0\]: wanted/);
  await assert.rejects(realizer.say(tone(0.1), { rate: RATE, words: [[-0.1, "h"]] }), /wanted seconds from 0 on, got/);
});

const LONG = "One two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen. ";
const statusOf = (end) => end.getAttributeNS(BMLA, "status");

test("speech speaks text as it comes", async () => {
  const speech = realizer.speech("story");
  for (const token of ["Hel", "lo ", '<sync id="m"/>', "there. "]) await speech.append(token);
  const spoken = await speech.until("m"); // before the rest is there
  await speech.append("Good bye.");
  speech.close();
  assert.equal((await speech.ended()).getAttribute("id"), "story:end");
  assert.ok(speech.progress.start <= spoken);
  assert.equal(await speech.until("m"), spoken);
  await assert.rejects(speech.until("nosuch"), /has ended without a sync nosuch/);
});

test("speech sends what follows soon in one message", async () => {
  const sent = [];
  const send = realizer.send;
  realizer.send = (message) => sent.push(message) && send.call(realizer, message);
  const speech = realizer.speech("tokens");
  for (let k = 0; k < 50; k++) await speech.append("a ");
  speech.close();
  await speech.ended();
  delete realizer.send;
  assert.deepEqual(sent.map((message) => JSON.parse(message).append?.length), [2, 98, undefined]);
});

test("speech that is stopped makes its id free, and ignores what follows", async () => {
  for (const stop of [(speech) => speech.stop(), ({ id }) => realizer.stop(id), () => realizer.stop()]) {
    const speech = realizer.speech("turns");
    await speech.append(`Now <sync id="m"/>${LONG}`);
    await speech.until("m");
    stop(speech);
    const end = await speech.ended();
    assert.equal(statusOf(end), "INTERRUPTED");
    await speech.append(LONG);
    speech.close();
  }
  const next = realizer.speech("turns");
  await next.append("Yes.");
  next.close();
  assert.notEqual(statusOf(await next.ended()), "INTERRUPTED");
  await assert.rejects(next.until("m"), /without a sync/);
});

test("speech that is closed or refused rejects what follows", async () => {
  const closed = realizer.speech();
  await closed.append("Yes.");
  closed.close();
  await assert.rejects(closed.append("No."), { code: "refused" });
  await closed.ended();
  const refused = realizer.speech("no speech");
  await refused.append("Yes.");
  await assert.rejects(refused.ended(), { where: "speech.id" });
  await assert.rejects(refused.append("No."), { where: "speech.id" });
});

test("stop rejects an unknown block", async () => {
  await assert.rejects(realizer.stop("zzz"), { where: "stop.blocks" });
});

test("voice speaks while its sound comes", async () => {
  const voice = realizer.voice({ rate: RATE, id: "v" });
  voice.write(tone(0.3));
  const started = new Promise((resolve) => (realizer.onfeedback = (e) => e.getAttribute("id") === "v:start" && resolve()));
  await started; // before the rest is there
  voice.write(tone(0.3));
  voice.close();
  assert.equal((await voice.ended()).getAttribute("id"), "v:end");
  assert.throws(() => voice.write(tone(0.1)), /closed/);
});

test("voice sends words with the sound that they begin in", async () => {
  const starts = [];
  realizer.onfeedback = (e) => starts.push(e.getAttribute("id"));
  const voice = realizer.voice({ rate: RATE, id: "w" });
  voice.words([[0.05, "one"], [0.35, "two"], [0.65, "three"]]);
  for (let k = 0; k < 5; k++) voice.write(tone(0.2));
  voice.close();
  await voice.ended();
  // Cut where "two" and "three" begin.
  assert.deepEqual(starts.filter((id) => /^w\.\d+:start$/.test(id)), ["w.1:start", "w.2:start", "w.3:start"]);
});

test("voice is silent after stop", async () => {
  const voice = realizer.voice({ rate: RATE, id: "x" });
  voice.write(tone(5));
  await new Promise((resolve) => (realizer.onfeedback = (e) => e.getAttribute("id") === "x:start" && resolve()));
  voice.stop();
  assert.ok((await voice.ended()).toString().includes("INTERRUPTED"));
});

test("voice ends when it is stopped before anything was sent", async () => {
  const voice = realizer.voice({ rate: RATE });
  voice.stop();
  assert.match((await voice.ended()).toString(), /INTERRUPTED|REVOKED/); // it may not have started
});

test("frameOf refuses an unknown kind", () => {
  assert.throws(() => frameOf(new Uint8Array(16).fill(99).buffer), /wanted a frame of kind/);
});

test("a connection that is lost is restored with its streams", async () => {
  const frames = [];
  await realizer.aus({}, (frame) => frames.push(frame));
  const opened = new Promise((resolve) => (realizer.onopen = resolve));
  realizer.socket.close();
  await opened;
  frames.length = 0;
  await new Promise((resolve) => {
    const timer = setInterval(() => frames.length && (clearInterval(timer), resolve()), 20);
  });
  assert.equal((await realizer.play(NOD("again"))).getAttribute("id"), "again:end");
});

test("play rejects a block whose session has ended meanwhile", async () => {
  const end = realizer.play('<bml id="cut"><wait id="w" duration="30"/></bml>');
  await new Promise((resolve) => (realizer.onfeedback = (element) => element.getAttribute("id") === "cut:w:start" && resolve()));
  realizer.seen = 1e6; // more than a new session has sent
  realizer.socket.close();
  await assert.rejects(end, { code: "gap" });
  await realizer.play('<bml id="go" composition="REPLACE"><head id="n" lexeme="NOD"/></bml>');
});

test("connect twice, or after close, leaves one connection", async () => {
  const client = new Realizer({ url, session: "again" });
  const first = client.connect();
  assert.equal(client.connect(), first);
  client.close();
  await assert.rejects(first, /was closed/);
  await client.connect();
  await client.connect();
  let sockets = 0;
  client.onframe = () => {};
  ({ connections: sockets } = await client.ask({ type: "state" }));
  assert.equal(sockets, 1);
  client.close();
  let lost = 0;
  client.onlost = () => (lost += 1);
  await client.connect();
  await client.play(NOD("again"));
  assert.equal(lost, 0);
  client.close();
});

test("play and say return warnings, and tell once that nothing was heard or moved", async () => {
  const client = new Realizer({ url });
  const logged = [];
  client.onwarning = (warning) => logged.push(warning);
  await client.connect();
  const end = await client.play("<bml id='b'><head id='n' lexeme='NODD'/></bml>");
  assert.deepEqual([end.shown, end.warnings.map(({ id }) => id)], [false, ["b:n"]]);
  assert.match(end.warnings[0].text, /did you mean NOD/);
  assert.deepEqual(logged.map(({ id }) => id), ["b:n", "b"]);
  const nod = await client.play(NOD("c"));
  assert.deepEqual([nod.shown, nod.warnings], [true, []]);
  const said = await client.say(new Int16Array(RATE / 4), { rate: RATE });
  assert.equal(said.shown, false);
  const late = await client.say(tone(0.5), { rate: RATE, words: [[100, "mama"], [300, "papa"]] });
  assert.match(late.warnings[0].text, /taken as milliseconds/);
  client.close();
});

test("warnings are written to the console by default", async (t) => {
  const warn = t.mock.method(console, "warn", () => {});
  const client = new Realizer({ url });
  await client.connect();
  await client.play("<bml id='b'><head id='n' lexeme='NODD'/><head id='m' lexeme='NOD'/></bml>");
  assert.equal(warn.mock.callCount(), 1);
  assert.match(warn.mock.calls[0].arguments[0], /^realizer: b:n: /);
  client.close();
});

test("say and voice report each word when it is spoken", async () => {
  const words = [{ start: 0.1, text: "mama" }, { start: 0.5, end: 0.8, text: "papa" }];
  const spoken = [];
  await realizer.say(tone(1), { rate: RATE, words, onword: (word) => spoken.push(word) });
  assert.deepEqual(spoken.map(({ text }) => text), ["mama", "papa"]);
  assert.ok(Math.abs(spoken[1].time - spoken[0].time - 0.4) < 1e-3);
  const voice = realizer.voice({ rate: RATE, onword: (word) => spoken.push(word) });
  voice.words(words);
  for (let k = 0; k < 5; k++) voice.write(tone(0.2));
  voice.close();
  await voice.ended();
  assert.deepEqual(spoken.slice(2).map(({ text }) => text), ["mama", "papa"]);
});

test("errors reach the request that caused them", async () => {
  const asked = [{ type: "stopp" }, { type: "ping", x: 1 }, { type: "ping" }, { type: "stop", blocks: ["nobody"] }, { type: "state" }];
  const answers = await Promise.allSettled(asked.map((message) => realizer.ask(message)));
  assert.deepEqual(answers.map(({ status }) => status), ["rejected", "rejected", "fulfilled", "rejected", "fulfilled"]);
});
