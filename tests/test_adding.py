"""The additions of docs/adding.md, made in a copy of the project and tried there."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import realizer
from realizer.face.load import folder_of

ROOT = Path(realizer.__path__[0]).parent
PAGE = Path(__file__).parents[1] / "docs" / "adding.md"
DIFFS = re.findall(r"```diff\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL) if PAGE.is_file() else []
TRY = """
import json
from realizer.core.settings import Settings
from realizer.server.session.session import Session
from realizer.speech.silent import SilentVoice

session = Session("s", Settings(voice="silent", max_id=20), 0.0)
session.connect(1, 0.0)

def answers(message, now):
    session.receive(1, message, now)
    for step in range(200):
        for effect in session.take_effects():
            if type(effect).__name__ == "Speak":
                session.on_speech(effect.id, SilentVoice().say(effect.request), now)
            yield getattr(effect, "data", "")
        session.tick(now + step / 100)

session.receive(1, '{"type": "greet", "id": "g1", "name": "A & B"}', 0.0)
greeting = "".join(answers('{"type": "greet", "id": "g&2", "name": "Ada"}', 0.0))
assert "g1:s" in greeting and "g&amp;2" in greeting and "warning" not in greeting, greeting
assert any("wanted" in answer for answer in answers('{"type": "greet"}', 3.0))
assert any("MAX_ID" in answer for answer in answers("<bml id='" + "x" * 21 + "'/>", 6.0))
subscribe = '{"type": "subscribe", "stream": "lids", "encoding": "json"}'
frames = [json.loads(answer) for answer in answers(subscribe, 9.0) if answer.startswith("{")]
assert frames[0]["names"] == ["left", "right"], frames[0]
assert len([frame for frame in frames if frame["type"] == "lids"][0]["values"]) == 2
"""


def apply(diff: str, root: Path) -> None:
    """Apply a diff without line numbers: the old lines of each part are in one place of its file."""
    for text in re.split(r"^--- ", diff, flags=re.MULTILINE)[1:]:
        name, _, parts = text.partition("\n")
        file = root / name
        for part in re.split(r"^@@\n", parts, flags=re.MULTILINE)[1:]:
            lines = part.splitlines(keepends=True)
            old = "".join(line[1:] for line in lines if line[0] in " -")
            new = "".join(line[1:] for line in lines if line[0] in " +")
            content = file.read_text("utf-8")
            assert content.count(old) == 1, f"{name} has not once: {old}"
            file.write_text(content.replace(old, new), "utf-8")


@pytest.mark.skipif(not PAGE.is_file(), reason="docs/adding.md is not beside the tests")
def test_message_stream_and_limit_of_the_page_work_in_a_copy(tmp_path: Path) -> None:
    for package in ("bml_schema", "realizer"):
        left_out = shutil.ignore_patterns("static", "docs", "web", "_faces", "__pycache__")
        shutil.copytree(ROOT / package, tmp_path / package, ignore=left_out)
    assert len(DIFFS) == 3
    for diff in DIFFS:
        apply(diff, tmp_path)
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n{TRY}"
    command, faces = [sys.executable, "-c", code], str(folder_of("ada").parent)
    environment = {**os.environ, "REALIZER_FACES": faces}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
