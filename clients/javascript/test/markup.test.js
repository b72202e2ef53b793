// The same table as the tests of Python: markup-cases.json is what Python gives.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import test from "node:test";

import { isMarkup } from "../src/index.js";

const CASES = JSON.parse(readFileSync(new URL("markup-cases.json", import.meta.url), "utf8"));

test("a text is markup as in Python", () => {
  for (const [text, expected] of CASES) assert.equal(isMarkup(text), expected, text);
});
