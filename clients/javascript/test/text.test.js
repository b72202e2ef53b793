// The same table as the tests of Python: text-cases.json is what Python gives.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import test from "node:test";

import { spokenText } from "../src/text.js";

const CASES = JSON.parse(readFileSync(new URL("text-cases.json", import.meta.url), "utf8"));
const MANY = 2 ** 16; // characters

test("a text is spoken as in Python", () => {
  for (const [text, language, ...expected] of CASES) {
    const said = spokenText(text, language);
    assert.deepEqual([said.text, said.markup, said.behaviours, said.warnings], expected, text);
  }
});

test("options and types are those of Python", () => {
  assert.equal(spokenText("```\nx\n```", "en", { code: "say" }).text, "code.");
  assert.deepEqual(spokenText("Hi 😀", "en", { emoji: false }).behaviours, []);
  assert.throws(() => spokenText(5), /wanted a text, got number/);
});

test("endless markup is read in linear time", () => {
  for (const unit of ["*", "[", "[a", "![", "```\n", "(", "**a ", "<a ", "| a ", "- ", "> ", "`", "[]("]) {
    const begin = performance.now();
    spokenText(unit.repeat(MANY / unit.length));
    assert.ok(performance.now() - begin < 20_000, unit);
  }
});
