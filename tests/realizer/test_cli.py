"""The command line as its user sees it: texts, exit status, files."""

import json
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from realizer.speech.espeak.voice import EspeakVoice
from tests.commands import run
from tests.interrupts import SIGNALS, check_interrupted

GOOD = '<bml id="b"><head id="n" lexeme="NOD" start="1"/></bml>'
DROPS = '<bml id="b">\n<head id="n" lexeme="NOD" amount="7"/>\n<head id="m" lexeme="SHAKE"/></bml>'
REALIZER = [sys.executable, "-m", "realizer"]


def process(*args: str, stdin: str = "", cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run a command in a process of its own."""
    return subprocess.run(
        [*REALIZER, *args], input=stdin, capture_output=True, text=True, cwd=cwd, check=False
    )


def test_process_reads_standard_input_and_exits_with_its_status() -> None:
    done = process("check", "-", stdin=DROPS)
    assert (done.returncode, done.stderr.count("Traceback")) == (1, 0)
    assert "line 2" in done.stdout


def test_process_ends_quietly_when_its_reader_closes_the_pipe() -> None:
    with subprocess.Popen(
        [*REALIZER, "emotion", "joy"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as done:
        assert done.stdout is not None
        done.stdout.close()
        assert done.stderr is not None
        assert (done.wait(), done.stderr.read()) == (1, b"")


def test_process_of_realize_writes_the_bytes_that_this_process_writes(tmp_path: Path) -> None:
    assert run("realize", "-", "-o", str(tmp_path / "here.fap"), stdin=GOOD).returncode == 0
    assert process("realize", "-", "-o", "there.fap", cwd=tmp_path, stdin=GOOD).returncode == 0
    assert (tmp_path / "here.fap").read_bytes() == (tmp_path / "there.fap").read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".json", ".wav"])
def test_process_of_realize_writes_the_same_bytes_twice(suffix: str, tmp_path: Path) -> None:
    for name in ("one", "two"):
        done = process("realize", "-", "-o", f"{name}{suffix}", cwd=tmp_path, stdin=GOOD)
        assert done.returncode == 0
    one, two = ((tmp_path / f"{name}{suffix}").read_bytes() for name in ("one", "two"))
    assert one == two
    assert one


def test_process_of_serve_says_that_a_port_is_in_use() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        done = process("serve", "--port", str(taken.getsockname()[1]))
    assert done.returncode == 3
    assert "in use" in done.stderr
    assert "; choose another one with --port" in done.stderr
    assert "Traceback" not in done.stderr


def test_serve_refuses_an_unknown_face() -> None:
    done = run("serve", "--port", "0", "--face", "nobody")
    assert done.returncode == 2
    assert "nobody" in done.stderr


def test_version_and_help_name_the_program_and_its_commands() -> None:
    assert run("--version").stdout.startswith("realizer, version ")
    text = run("--help").stdout
    for command in ("serve", "realize", "schedule", "check", "faces", "voices", "outputs", "doctor", "demo"):
        assert command in text


def test_realize_without_an_output_prints_json() -> None:
    done = run("realize", "-", "--voice", "silent", stdin=GOOD)
    assert done.returncode == 0
    assert json.loads(done.stdout)["schedule"][0]["behaviours"]["n"]["start"] == 1.0


def test_realize_lists_the_known_suffixes_for_an_unknown_one() -> None:
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
    points = ["start", "ready", "strokeStart", "stroke", "strokeEnd", "relax", "end"]
    assert list(out["behaviours"]["n"]) == points


def test_check_prints_every_fault_with_line_and_path_and_exits_with_1() -> None:
    done = run("check", "-", stdin=DROPS)
    assert done.returncode == 1
    (line,) = done.stdout.splitlines()
    for text in ("line 2", "/bml/head[1]", "amount"):
        assert text in line


def test_check_of_a_document_without_faults_exits_with_0() -> None:
    done = run("check", "-", stdin=GOOD)
    assert (done.returncode, done.stdout) == (0, "")


def test_realize_exits_with_1_for_a_dropped_behaviour_only_if_strict() -> None:
    assert run("realize", "-", stdin=DROPS).returncode == 0
    assert run("realize", "-", "--strict", stdin=DROPS).returncode == 1


@pytest.mark.parametrize("command", ["realize", "schedule", "check"])
def test_command_exits_with_1_and_a_message_for_a_refused_document(command: str) -> None:
    done = run(command, "-", stdin="<bml><head/></bml>")
    assert done.returncode == 1
    assert "id" in done.stdout + done.stderr


def test_check_of_a_missing_file_is_wrong_usage() -> None:
    done = run("check", "nowhere.bml")
    assert done.returncode == 2
    assert "nowhere.bml" in done.stderr


def test_realize_with_a_missing_voice_exits_with_3_and_says_what_to_do(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(EspeakVoice, "missing", classmethod(lambda cls, voice=None: "install espeak-ng"))
    done = run("realize", "-", "--voice", "espeak", stdin=GOOD)
    assert (done.returncode, done.stderr) == (3, "realizer: install espeak-ng\n")


@pytest.mark.parametrize("flags", [("--voice", "nobody"), ("--face", "nobody"), ("--light", "nobody")])
def test_realize_with_an_unknown_name_exits_with_2(flags: tuple[str, str]) -> None:
    done = run("realize", "-", *flags, "-o", "x.png", stdin=GOOD)
    assert done.returncode == 2
    assert "wanted one of" in done.stderr
    assert "nobody" in done.stderr


@pytest.mark.parametrize(
    "words",
    [
        "realize",
        "realize no.bml",
        "fap info no.fap",
        "nope",
        "replay no",
        "realize - --fps x",
        "faces sheet no",
    ],
)
def test_errors_have_one_prefix(words: str) -> None:
    done = run(*words.split(), stdin=GOOD)
    assert done.returncode == 2
    assert done.stderr
    assert all(line.startswith("realizer: ") for line in done.stderr.splitlines())


def test_lists_of_voices_outputs_and_faces_are_printed() -> None:
    assert "silent" in run("voices").stdout
    assert ".fap" in run("outputs").stdout
    assert run("faces", "list").stdout.split()


@pytest.mark.parametrize("flags", [["--fps", "nan"], ["--at", "nan", "-o", "x.png"], ["--size", "0x9"]])
def test_realize_refuses_numbers_that_are_none(flags: list[str]) -> None:
    assert run("realize", "-", *flags, stdin=GOOD).returncode == 2


def test_settings_come_from_the_environment_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("REALIZER_FPS", "10")
    assert json.loads(run("realize", "-", stdin=GOOD).stdout)["fps"] == 10
    assert json.loads(run("realize", "-", "--fps", "50", stdin=GOOD).stdout)["fps"] == 50


def test_realize_drops_a_text_too_long_for_a_voice_and_plays_the_rest() -> None:
    long = f'<bml id="b"><speech id="s"><text>{"la " * 8000}</text></speech><head id="n" lexeme="NOD"/></bml>'
    done = run("realize", "-", "--voice", "silent", stdin=long)
    assert done.returncode == 0
    played = json.loads(done.stdout)
    assert [w["id"] for w in played["warnings"]] == ["b:s"]
    assert list(played["schedule"][0]["behaviours"]) == ["n"]


def test_realize_says_what_is_too_much_of_a_document_of_a_day() -> None:
    done = run("realize", "-", stdin='<bml id="b"><wait id="w" duration="86400"/></bml>')
    assert done.returncode == 3
    assert "at most" in done.stderr


def test_media_folder_has_the_files_that_documents_refer_to(tmp_path: Path) -> None:
    mask = " ".join("1" if fap == 31 else "0" for fap in range(1, 69))
    frames = "\n".join(f"{mask}\n{k} {value}" for k, value in enumerate((0, 80, 0)))
    (tmp_path / "brow.fap").write_text(f"2.1 brow 25 3\n{frames}\n")
    document = '<bml id="b" xmlns:o="urn:bml-realizer:1"><o:fapFile id="f" fileName="brow.fap"/></bml>'
    for command in (["schedule"], ["realize", "--no-idle"], ["check"]):
        without = run(*command, "-", stdin=document)
        assert "--media DIR" in without.stdout + without.stderr
        found = run(*command, "-", "--media", str(tmp_path), stdin=document)
        assert found.returncode == 0
        assert "--media" not in found.stdout + found.stderr
        if command[0] == "realize":
            assert [row[30] for row in json.loads(found.stdout)["fap"]["values"]] == [0, 80, 0]
    assert run("realize", "-", "--media", str(tmp_path / "none"), stdin=document).returncode == 2


def test_schedule_plays_a_gaze_at_an_unknown_target_even_if_strict(tmp_path: Path) -> None:
    scene = tmp_path / "scene"
    scene.write_text("cup 0.2 0 0.5\n")
    gaze = '<bml id="b"><gaze id="g" target="cap"/></bml>'
    done = run("schedule", "-", "--strict", "--scene", str(scene), stdin=gaze)
    assert done.returncode == 0
    assert "NO_SUCH_TARGET" in done.stderr


def test_prosody_can_be_switched_off() -> None:
    talk = '<bml id="b"><speech id="s"><text>Remember the tower</text></speech></bml>'
    lively, still, wrong = (
        run("realize", "-", "--voice", "silent", "--prosody", word, stdin=talk)
        for word in ("on", "off", "some")
    )
    assert json.loads(lively.stdout)["au"] != json.loads(still.stdout)["au"]
    assert wrong.returncode == 2


def test_liveliness_can_be_turned_down() -> None:
    wait = '<bml id="b"><wait id="w" duration="2"/></bml>'
    usual, alive, calm, wrong = (
        run("realize", "-", *flags, stdin=wait)
        for flags in ((), ("--liveliness", "1"), ("--liveliness", "0"), ("--liveliness", "2"))
    )
    assert usual.stdout == alive.stdout
    names, *shown = (json.loads(done.stdout)["au"] for done in (alive, alive, calm))
    nostrils = [max(row[names["names"].index("38L")] for row in aus["values"]) for aus in shown]
    assert nostrils[0] > 0.1
    assert nostrils[1] == 0
    assert wrong.returncode == 2


def test_realize_refuses_a_file_of_rules_that_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "rules.toml").write_text("[domination]\nrules = ['5<99']\n")
    done = run("realize", "-", "--cooccurrence", str(tmp_path / "rules.toml"), stdin=GOOD)
    assert done.returncode == 2
    assert "rules.toml" in done.stderr


@pytest.mark.parametrize("ending", SIGNALS, ids=lambda row: row[0].name)
@pytest.mark.parametrize(
    ("arguments", "event"),
    [(("realize", "long.bml", "-o", "film.mp4"), ".film.*"), (("demo",), ".demo.mp4.*")],
    ids=["realize", "demo"],
)
def test_interrupted_command_says_so_and_keeps_what_was_there(
    arguments: tuple[str, ...], event: str, ending: tuple[signal.Signals, int, str], tmp_path: Path
) -> None:
    check_interrupted(arguments, event, ending, tmp_path)
