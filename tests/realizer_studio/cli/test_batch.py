"""Tests of `realizer batch`."""

from __future__ import annotations

import json
import signal
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from realizer.cli import cli
from tests.interrupts import SIGNALS, check_interrupted

NOD = '<bml id="b"><head id="n" lexeme="NOD"/></bml>'


def batch(*args: str, text: str = "") -> Result:
    arguments = ["batch", *args, "--voice", "silent"]
    return CliRunner().invoke(cli, arguments, input=text, standalone_mode=False, catch_exceptions=False)


@pytest.fixture
def talks(tmp_path: Path) -> Path:
    (tmp_path / "talks").mkdir()
    for name in "ab":
        (tmp_path / "talks" / f"{name}.bml").write_text(NOD)
    return tmp_path / "talks"


def rows(folder: Path) -> dict[str, str]:
    lines = (folder / "manifest.jsonl").read_text().splitlines()
    return {row["document"]: row["status"] for row in map(json.loads, lines)}


def test_batch_writes_a_file_for_each_document_and_format(talks: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = [str(talks), "-o", str(out), "--format", "fap", "--format", ".JSON", "--workers", "1"]
    done = batch(*command)
    assert done.return_value == 0
    assert "2 done; see manifest.jsonl" in done.stderr
    assert {p.name for p in out.glob("*.*")} >= {"a.fap", "a.json", "b.fap", "b.json"}
    assert rows(out) == {"a": "done", "b": "done"}
    assert "2 done (2 of them before)" in batch(*command).stderr


def test_batch_exits_with_1_for_a_refused_document(talks: Path, tmp_path: Path) -> None:
    (talks / "c.bml").write_text("<bml")
    done = batch("-", "-o", str(tmp_path / "out"), "--format", "fap", "--workers", "1", text=f"{talks}\n")
    assert done.return_value == 1
    assert rows(tmp_path / "out") == {"a": "done", "b": "done", "c": "refused"}
    assert "c: refused: line 1" in done.stderr


def test_batch_says_whom_formats_of_one_character_leave_out(talks: Path, tmp_path: Path) -> None:
    both = (NOD.replace('<bml id="b"', f'<bml id="{name}" characterId="{name}"') for name in ("Ada", "Ben"))
    (talks / "a.bml").write_text("".join(both))
    command = [str(talks), "-o", str(tmp_path / "out"), "--workers", "1"]
    assert "a: .fap show Ada, not Ben" in batch(*command, "--format", "fap", "--format", "json").stderr
    assert "show" not in batch(*command, "--format", "json").stderr


def test_batch_exits_with_1_for_a_dropped_behaviour_if_strict(talks: Path, tmp_path: Path) -> None:
    text = '<bml id="b"><faceLexeme id="f" lexeme="NOPE"/><head id="c" lexeme="NOD"/></bml>'
    (talks / "a.bml").write_text(text)
    command = [str(talks), "-o", str(tmp_path / "out"), "--format", "fap", "--workers", "1"]
    assert batch(*command).return_value == 0
    assert batch(*command, "--strict").return_value == 1


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["--format", "avi"], "wanted one of fap"),
        (["--format", "fap", "--workers", "2", "--dask", "tcp://localhost:8786"], "wanted one of them"),
        (["--format", "mp4", "--camera", "from-behind"], "from-behind"),
    ],
)
def test_batch_refuses_wrong_options_before_it_plays(
    args: list[str], words: str, talks: Path, tmp_path: Path
) -> None:
    import click

    with pytest.raises(click.UsageError) as caught:
        batch(str(talks), "-o", str(tmp_path / "out"), *args)
    assert words in caught.value.format_message()
    assert not (tmp_path / "out").exists()


def test_batch_refuses_a_place_without_documents(tmp_path: Path) -> None:
    import click

    with pytest.raises(click.UsageError, match="nowhere: wanted a document"):
        batch("nowhere", "-o", str(tmp_path / "out"), "--format", "fap")


@pytest.mark.parametrize("ending", SIGNALS, ids=lambda row: row[0].name)
def test_interrupted_batch_says_so_and_keeps_what_was_there(
    ending: tuple[signal.Signals, int, str], tmp_path: Path
) -> None:
    words = ("batch", "long.bml", "-o", ".", "--format", "mp4", "--workers", "1")
    check_interrupted(words, ".manifest.lock", ending, tmp_path)
