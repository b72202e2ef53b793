// Picture and sound that WebRTC brings, without a browser.
import assert from "node:assert/strict";
import { test } from "node:test";
import { setImmediate } from "node:timers/promises";
import { synchronize } from "../src/watch.js";

/** By how many ms the pictures are held back in the end, if they come that early before the sound. */
async function held(mock, early) {
  const video = { track: { kind: "video" } }, audio = { track: { kind: "audio" } };
  const connection = {
    getReceivers: () => [video, audio],
    getStats: async () => new Map([video, audio].map((receiver) => [receiver, {
      type: "inbound-rtp", kind: receiver.track.kind,
      estimatedPlayoutTimestamp: (receiver === video ? early : 0) - (receiver.jitterBufferTarget ?? 0),
    }])),
  };
  synchronize(connection, 0);
  for (let second = 0; second < 8; second++) {
    mock.timers.tick(1000);
    await setImmediate();
  }
  return video.jitterBufferTarget - audio.jitterBufferTarget;
}

test("synchronize holds back what is played early, pictures or sound", async ({ mock }) => {
  mock.timers.enable({ apis: ["setInterval"] });
  assert.ok(Math.abs(await held(mock, 140) - 140) < 10);
  assert.ok(Math.abs(await held(mock, -60) + 60) < 10);
});
