"""The client in JavaScript: its own tests in Node against a service, its types, and its package."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.browser.test_page import serving
from tests.waiting import LIMIT

FOLDER = Path(__file__).parents[3] / "clients" / "javascript"
NODE = shutil.which("node")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        NODE is None or not (FOLDER / "node_modules").is_dir(),
        reason="needs Node 20 and `npm ci --prefix clients/javascript`",
    ),
]
CALLS = """
import { Realizer, type Timed } from "bml-realizer-client";
import { spokenText } from "bml-realizer-client/text";
const said: string = spokenText("*Hi*", "en", { emoji: false }).behaviours[0]?.[1] ?? "";
said.trim();
await new Realizer().speak("Hi", { plain: true });
const realizer = new Realizer({ url: "ws://127.0.0.1:8765/ws" });
await realizer.connect();
await realizer.faps({ fps: 25 }, (frame) => { const values: Int32Array = frame.values(); values.length; });
const words: Timed[] = [[0, "a"], [0.1, 0.2, "b"]];
const onword = ({ time }: { time: number }) => time.toFixed();
const end: Element = await realizer.say(new Int16Array(2), { rate: 16000, words, onword });
end.getAttribute("id");
const { warnings, shown } = await realizer.play("<bml id='b'/>");
realizer.onwarning = ({ id, text }) => console.log(id, text, warnings.length, shown, realizer.leftOut.arkit);
const speech = realizer.speech("turn", { composition: "REPLACE" });
await speech.append("Hello <sync id='m'/>there.");
(await speech.until("m")).toFixed();
await realizer.stop(speech.id);
// @ts-expect-error: there is no such stream
realizer.subscribe("nosuch");
// @ts-expect-error: a voice needs its rate
realizer.voice({});
"""


def run(*command: str, **environment: str) -> str:
    done = subprocess.run(
        command, cwd=FOLDER, env={**os.environ, **environment}, capture_output=True, text=True, timeout=LIMIT
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with serving([sys.executable, "-m", "realizer", "serve", "--port", "0", "--voice", "silent"]) as address:
        yield address


def test_client_passes_its_own_tests_in_node(address) -> None:
    url = address.replace("http", "ws") + "/ws"
    assert "# fail 0" in run(NODE, "--test", "test/", REALIZER_URL=url)


def test_client_has_types_for_its_calls() -> None:
    # In the folder of the package, whose name TypeScript then resolves to it.
    script = FOLDER / "test" / "calls.ts"
    script.write_text(CALLS, "utf-8")
    try:
        options = ["--noEmit", "--strict", "--module", "nodenext", "--lib", "es2023,dom"]
        run(NODE, "node_modules/typescript/bin/tsc", *options, str(script))
    finally:
        script.unlink()


def test_client_package_holds_sources_types_and_licence() -> None:
    packed = json.loads(run("npm", "pack", "--dry-run", "--json", "--offline"))
    packed = packed[0] if isinstance(packed, list) else next(iter(packed.values()))
    names = {file["path"] for file in packed["files"]}
    assert {"LICENSE", "README.md", "package.json", "src/index.js", "src/index.d.ts"} <= names
    assert not any("test" in name or "node_modules" in name for name in names)
