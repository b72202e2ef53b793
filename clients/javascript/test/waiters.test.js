// Which feedback is about which block, without a service.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Waiters, blocksOf } from "../src/waiters.js";

const MADE = [{ ids: [], mayLackId: true }];
const plain = (...ids) => ids.map((id) => ({ ids: [id, id], mayLackId: false }));

test("blocksOf finds the documents of a text", () => {
  const texts = {
    '<bml id="a"/><bml id="b"/>': plain("a", "b"),
    '<bml id="a"/><!-- <bml id="b"/> -->': plain("a"),
    '<?xml version="1.0"?><x:bml id="a" xmlns:x="http://www.bml-initiative.org/bml/bml-1.0"></x:bml>': plain("a"),
    "<bml id='b'><text><![CDATA[<bml id='z'/>]]></text></bml>": plain("b"),
    "<bml id='b'><bml id='c'/></bml> junk": plain("b"),
    "<bml id='a'><oops <bml id='b'/>": plain("a", "b"),
    "<bml id='>'/>": plain(">"),
    "<bml id=' b '/>": [{ ids: ["b", " b "], mayLackId: true }],
    "<bml id='a&amp;b'/>": [{ ids: ["a&b", "a&amp;b"], mayLackId: true }],
    "<bml id='b'/><bml id='c'": [...plain("b"), ...MADE],
    "<bml xmlns='urn:x' id='b'/>": [{ ids: ["b", "b"], mayLackId: true }],
    "<bml><head type='NOD'/></bml>": MADE,
    "[1]": [{ ids: ["<no id>"], mayLackId: true }],
    "<act></act>": [],
    " <!-- later -->": [],
  };
  for (const [text, blocks] of Object.entries(texts)) assert.deepEqual(blocksOf(text), blocks, text);
  assert.equal(blocksOf("<bml id='a'/>".repeat(1001)).at(-1).ids[0], "<no id>");
});

/** Add a waiter for each block, whose outcome is in the array that is returned. */
function outcomes(waiters, ...blocks) {
  const found = blocks.map(() => null);
  blocks.forEach((block, k) =>
    waiters.add({ isSent: true, ...block }).then((end) => (found[k] = `${end}`), (error) => (found[k] = error.code)),
  );
  return found;
}
const settled = () => new Promise(setImmediate);

test("a warning that an id is in use ends the newer block only", async () => {
  for (const isPlanned of [false, true]) {
    const waiters = new Waiters();
    const found = outcomes(waiters, ...plain("b", "b"));
    waiters.acknowledge("b");
    if (isPlanned) waiters.plan("b");
    waiters.refuse("b", "", true);
    await settled();
    assert.deepEqual(found, [null, "refused"]);
    waiters.end("b", "end");
    await settled();
    assert.deepEqual(found, ["end", "refused"]);
  }
});

test("a warning that an id is in use ends the block whose id another client uses", async () => {
  const waiters = new Waiters();
  const found = outcomes(waiters, ...plain("b"));
  waiters.acknowledge("b"); // the other one's
  waiters.plan("b");
  waiters.refuse("b", "", true);
  await settled();
  assert.deepEqual(found, ["refused"]);
});

test("a block that another one replaces has its own end", async () => {
  const waiters = new Waiters();
  const found = outcomes(waiters, ...plain("b", "b"));
  waiters.acknowledge("b");
  waiters.acknowledge("b");
  waiters.end("b", 1);
  waiters.end("b", 2);
  await settled();
  assert.deepEqual(found, ["1", "2"]);
});

test("warnings about what was dropped and about others refuse nothing", async () => {
  const waiters = new Waiters();
  const found = outcomes(waiters, ...plain("b"));
  waiters.refuse("<no id>", "wanted <bml>");
  waiters.acknowledge("b");
  waiters.plan("b");
  waiters.refuse("b", "something was dropped");
  await settled();
  assert.deepEqual(found, [null]);
});

test("a message that is refused as a whole ends all its blocks", async () => {
  const waiters = new Waiters();
  const message = {};
  const found = outcomes(waiters, ...plain("a"), ...plain("a", "b").map((block) => ({ ...block, message })));
  waiters.refuse("b", "too large");
  await settled();
  assert.deepEqual(found, [null, "refused", "refused"]);
});

test("errors of a refused speech do not reach an older one", async () => {
  const waiters = new Waiters();
  const found = outcomes(waiters, ...[1, 2].map(() => ({ ids: ["s"], speech: () => ({ closing: true }) })));
  waiters.acknowledge("s");
  assert.ok(waiters.fail("s", { code: "invalid" }));
  assert.ok(!waiters.fail("s", { code: "invalid" }));
  waiters.end("s", "end");
  await settled();
  assert.deepEqual(found, ["end", "invalid"]);
});

test("a speech continues an open one of its id, and ends with it", async () => {
  for (const closing of [false, true]) {
    const waiters = new Waiters();
    const found = outcomes(waiters, ...[1, 2].map(() => ({ ids: ["s"], speech: () => ({ closing }) })));
    waiters.acknowledge("s");
    waiters.end("s", "end");
    await settled();
    assert.deepEqual(found, ["end", closing ? null : "end"]);
  }
});
