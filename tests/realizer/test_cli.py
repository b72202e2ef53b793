"""The command line as its user sees it: words, exit status, files."""

from __future__ import annotations

import json
import socket
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


SUFFIXES = [
    ".fap",
    *(pytest.param(suffix, marks=pytest.mark.slow) for suffix in (".json", ".csv", ".vtt", ".wav")),
]


@pytest.mark.parametrize("suffix", SUFFIXES)
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


def test_lists_answer() -> None:
    assert "silent" in run("voices").stdout
    assert ".fap" in run("outputs").stdout
    assert run("faces", "list").stdout.split()


def test_doctor_says_what_is_there() -> None:
    doctor = run("doctor")
    assert doctor.returncode == 0
    for what in ("GL", "FFmpeg", "silent", "face", "page"):
        assert what in doctor.stdout


@pytest.mark.parametrize("flags", [["--fps", "nan"], ["--at", "nan", "-o", "x.png"], ["--size", "0x9"]])
def test_numbers_that_are_none_are_wrong_usage(flags: list[str]) -> None:
    done = run("realize", "-", *flags, stdin=GOOD)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


def test_settings_come_from_the_environment_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("REALIZER_FPS", "10")
    assert json.loads(run("realize", "-", stdin=GOOD).stdout)["fps"] == 10
    assert json.loads(run("realize", "-", "--fps", "50", stdin=GOOD).stdout)["fps"] == 50


def test_a_text_too_long_for_a_voice_is_dropped_and_the_rest_plays() -> None:
    long = f'<bml id="b"><speech id="s"><text>{"la " * 8000}</text></speech><head id="n" lexeme="NOD"/></bml>'
    done = run("realize", "-", "--voice", "silent", stdin=long)
    assert done.returncode == 0
    played = json.loads(done.stdout)
    assert [w["id"] for w in played["warnings"]] == ["b:s"]
    assert list(played["schedule"][0]["behaviours"]) == ["n"]


def test_a_document_of_a_day_says_what_is_too_much() -> None:
    done = run("realize", "-", stdin='<bml id="b"><wait id="w" duration="86400"/></bml>')
    assert done.returncode == 3
    assert "at most" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_files_that_documents_name_are_found_in_the_media_folder(tmp_path: Path) -> None:
    mask = " ".join("1" if fap == 31 else "0" for fap in range(1, 69))
    frames = "\n".join(f"{mask}\n{k} {value}" for k, value in enumerate((0, 80, 0)))
    (tmp_path / "brow.fap").write_text(f"2.1 brow 25 3\n{frames}\n")
    document = '<bml id="b" xmlns:o="urn:bml-realizer:1"><o:fapFile id="f" fileName="brow.fap"/></bml>'
    for command in (["schedule"], ["realize", "--no-idle"], ["check"]):
        without = run(*command, "-", stdin=document)
        assert "--media DIR" in without.stdout + without.stderr
        there = run(*command, "-", "--media", str(tmp_path), stdin=document)
        assert there.returncode == 0
        assert "--media" not in there.stdout + there.stderr
        if command[0] == "realize":
            assert [row[30] for row in json.loads(there.stdout)["fap"]["values"]] == [0, 80, 0]
    assert run("realize", "-", "--media", str(tmp_path / "none"), stdin=document).returncode == 2


def test_a_port_in_use_is_said_in_a_sentence() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        done = run("serve", "--port", str(taken.getsockname()[1]))
    assert done.returncode == 3
    assert "in use" in done.stderr
    assert "Traceback" not in done.stderr


def test_serve_refuses_a_face_that_is_not_there() -> None:
    done = run("serve", "--port", "0", "--face", "nobody")
    assert done.returncode == 3
    assert "nobody" in done.stderr


def test_a_target_that_is_not_there_is_no_dropped_behaviour(tmp_path: Path) -> None:
    scene = tmp_path / "scene"
    scene.write_text("cup 0.2 0 0.5\n")
    gaze = '<bml id="b"><gaze id="g" target="cap"/></bml>'
    done = run("schedule", "-", "--strict", "--scene", str(scene), stdin=gaze)
    assert done.returncode == 0
    assert "NO_SUCH_TARGET" in done.stderr


@pytest.mark.slow
def test_prosody_can_be_switched_off() -> None:
    talk = '<bml id="b"><speech id="s"><text>Remember the tower</text></speech></bml>'
    lively, still, wrong = (
        run("realize", "-", "--voice", "silent", "--prosody", word, stdin=talk)
        for word in ("on", "off", "some")
    )
    assert json.loads(lively.stdout)["au"] != json.loads(still.stdout)["au"]
    assert wrong.returncode == 2


def test_a_file_of_rules_that_cannot_be_read_is_wrong_usage(tmp_path: Path) -> None:
    (tmp_path / "rules.toml").write_text("[domination]\nrules = ['5<99']\n")
    done = run("realize", "-", "--cooccurrence", str(tmp_path / "rules.toml"), stdin=GOOD)
    assert done.returncode == 2
    assert "rules.toml" in done.stderr
