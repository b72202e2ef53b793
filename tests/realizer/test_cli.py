"""The command line as its user sees it: words, exit status, files."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

GOOD = '<bml id="b"><head id="n" lexeme="NOD" start="1"/></bml>'
DROPS = '<bml id="b">\n<head id="n" lexeme="NOD" amount="7"/>\n<head id="m" lexeme="SHAKE"/></bml>'


def run(*args: str, stdin: str = "", cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "realizer", *args]
    return subprocess.run(command, input=stdin, capture_output=True, text=True, cwd=cwd, check=False)


def test_version_and_help() -> None:
    assert run("--version").stdout.startswith("realizer, version ")
    words = run("--help").stdout
    for command in ("serve", "realize", "schedule", "check", "faces", "voices", "outputs", "doctor", "demo"):
        assert command in words


def test_realize_without_an_output_prints_json() -> None:
    done = run("realize", "-", "--voice", "silent", stdin=GOOD)
    assert done.returncode == 0
    assert json.loads(done.stdout)["schedule"][0]["behaviours"]["n"]["start"] == 1.0


@pytest.mark.parametrize("suffix", [".fap", ".json", ".csv", ".vtt", ".wav"])
def test_realize_writes_the_same_bytes_twice(suffix: str, tmp_path: Path) -> None:
    document = tmp_path / "d.bml"
    document.write_text(GOOD)
    for name in ("one", "two"):
        folder = tmp_path / name
        folder.mkdir()
        assert run("realize", str(document), "-o", f"x{suffix}", cwd=folder).returncode == 0
    one, two = ((tmp_path / n / f"x{suffix}").read_bytes() for n in ("one", "two"))
    assert one == two
    assert one


def test_an_unknown_suffix_is_wrong_usage_and_lists_the_known() -> None:
    done = run("realize", "-", "-o", "x.gif", stdin=GOOD)
    assert done.returncode == 2
    assert ".mp4" in done.stderr


def test_schedule_prints_a_table_or_json() -> None:
    table = run("schedule", "-", stdin=GOOD)
    assert table.returncode == 0
    assert "start 1.000" in table.stdout
    out = json.loads(run("schedule", "-", "--json", stdin=GOOD).stdout)
    assert out["block"] == "b"
    assert out["start"] == 0
    assert list(out["behaviours"]["n"]) == [
        "start",
        "ready",
        "strokeStart",
        "stroke",
        "strokeEnd",
        "relax",
        "end",
    ]


def test_check_says_every_fault_with_line_and_path_and_ends_with_1() -> None:
    done = run("check", "-", stdin=DROPS)
    assert done.returncode == 1
    assert len(done.stdout.splitlines()) == 1
    assert "line 2" in done.stdout
    assert "/bml/head[1]" in done.stdout
    assert "amount" in done.stdout


def test_check_of_a_good_document_ends_with_0() -> None:
    done = run("check", "-", stdin=GOOD)
    assert (done.returncode, done.stdout) == (0, "")


def test_a_dropped_behaviour_is_0_unless_strict() -> None:
    assert run("realize", "-", stdin=DROPS).returncode == 0
    assert run("realize", "-", "--strict", stdin=DROPS).returncode == 1


@pytest.mark.parametrize("command", ["realize", "schedule", "check"])
def test_a_refused_document_ends_with_1_and_words(command: str) -> None:
    done = run(command, "-", stdin="<bml><head/></bml>")
    assert done.returncode == 1
    assert "id" in done.stdout + done.stderr
    assert "Traceback" not in done.stderr


def test_a_missing_file_is_wrong_usage() -> None:
    done = run("check", "nowhere.bml")
    assert done.returncode == 2
    assert "nowhere.bml" in done.stderr


def test_a_voice_that_is_not_there_ends_with_3_and_says_what_to_do() -> None:
    done = run("realize", "-", "--voice", "no-such-voice", stdin=GOOD)
    assert done.returncode == 3
    assert "realizer voices" in done.stderr


def test_an_unknown_face_is_said_with_the_known_ones() -> None:
    done = run("realize", "-", "--face", "nobody", "-o", "x.png", stdin=GOOD)
    assert done.returncode == 3
    assert "nobody" in done.stderr


def test_lists_and_doctor_answer() -> None:
    assert "silent" in run("voices").stdout
    assert ".fap" in run("outputs").stdout
    assert run("faces", "list").stdout.split()
    doctor = run("doctor")
    assert doctor.returncode == 0
    for what in ("GL", "FFmpeg", "silent", "face", "page"):
        assert what in doctor.stdout
