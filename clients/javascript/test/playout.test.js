// When frames are passed on.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Clock, DELAY, Playout } from "../src/playout.js";

const FPS = 25;
const rows = (first, count) => ({ frame: first, time: first / FPS, names: ["a"], values: () => Array(count).fill([0]), streamInfo: { names: ["a"], fps: FPS } });

test("a playout leaves out frames long past, and counts them", async (t) => {
  let now = 0;
  t.mock.method(performance, "now", () => now);
  const taken = [];
  let left = 0;
  const playout = new Playout(0.2, ({ frame }) => taken.push(frame), (count) => (left += count));
  playout.add(rows(0, 1));
  assert.deepEqual(taken, []);
  now = 10_000; // the page stood still, and everything comes at once
  for (let frame = 1; frame <= 255; frame++) playout.add(rows(frame, 1));
  await new Promise((resolve) => setTimeout(resolve, 50));
  playout.reset();
  assert.ok(taken.length < 10, `${taken.length}`);
  assert.ok(left > 240, `${left}`);
  assert.ok(taken.at(-1) >= 249, `${taken}`);
});

test("a clock keeps what it knows while nothing comes", () => {
  const clock = new Clock();
  clock.heard(1, 11);
  clock.heard(2, 30); // late, after the page stood still
  assert.equal(clock.playhead(30), 30 - 10 - DELAY);
});
