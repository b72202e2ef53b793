"""Tests of `realizer replay`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from realizer.core.settings import Settings
from realizer.server.journal.recordings import RecordingFolder, recording_head
from realizer.server.session.session import Session
from tests.commands import run

SETTINGS = Settings(voice="silent", seed=3)
NOD = '<bml id="a"><head id="n" lexeme="NOD" start="0.2" end="0.6"/></bml>'


@pytest.fixture
def record(tmp_path: Path) -> Path:
    """The recording of a session of one second."""
    session = Session("s", SETTINGS, 0.0, named=True, epoch=1e9)
    session.journal.open(recorder=RecordingFolder(tmp_path, recording_head(SETTINGS, None)))
    session.journal.begin(1e9)
    session.connect(1, 0.0)
    session.receive(1, NOD, 0.1)
    for step in range(3, 26):
        session.tick(0.04 * step)
    session.disconnect(1, 1.0)
    session.journal.end()
    (path,) = tmp_path.glob("*.jsonl")
    return path


def test_replay_prints_the_feedback(record: Path) -> None:
    done = run("replay", str(record))
    assert done.returncode == 0
    assert 'id="a:end"' in done.stdout
    assert run("replay", str(record.parent)).stdout == done.stdout


def test_replay_writes_a_file_with_another_rate_and_face(record: Path, tmp_path: Path) -> None:
    out = tmp_path / "x.json"
    done = run("replay", str(record), "-o", str(out), "--fps", "10", "--face", "ben")
    assert done.returncode == 0
    assert "frames at 10 fps" in done.stderr
    played = json.loads(out.read_text())
    assert (played["fps"], played["face"]) == (10, "ben")
    assert run("replay", str(record), "-o", str(out), "-q").stderr == ""


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["-o", "x.gif"], "wanted a suffix of"),
        (["-o", "x.png", "--camera", "top"], "wanted one of front"),
        (["-o", "no/x.json"], "No such file"),
    ],
)
def test_replay_refuses_wrong_options(options: list[str], message: str, record: Path) -> None:
    done = run("replay", str(record), *options)
    assert done.returncode == 2
    assert message in " ".join(done.stderr.split())


def test_replay_of_a_file_that_is_no_recording_exits_with_1(tmp_path: Path) -> None:
    (tmp_path / "x.jsonl").write_text("hello\n")
    done = run("replay", str(tmp_path / "x.jsonl"))
    assert done.returncode == 1
    assert "x.jsonl" in done.stderr
