"""Tests of `realizer realize` and `realizer schedule`."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner, Result

from bml_schema import Block, SyncRef, parse, read
from realizer.behaviours.registry import VOCABULARY
from realizer.cli import cli
from realizer.offline import realize as realize_documents
from tests import avatars
from tests.commands import run
from tests.rows import each_row

CORPUS = Path(__file__).parents[2] / "corpus"
TALK = """<bml id="b">
  <speech id="s"><text>Hello <sync id="t"/> there</text></speech>
  <head id="n" lexeme="NOD" repetition="2" stroke="s:t"/>
  <faceLexeme id="f" lexeme="NOPE"/>
  <wait id="w" start="f:end" duration="1"/>
  <constraint><after ref="n:end"><sync ref="w:start"/></after></constraint>
</bml>"""


def schedule(*args: str, text: str = "") -> Result:
    arguments = ["-q", "schedule", *args, "--voice", "silent"]
    return CliRunner().invoke(cli, arguments, input=text, standalone_mode=False, catch_exceptions=False)


def times(text: str) -> list[dict[str, object]]:
    out = json.loads(schedule("-", "--json", text=text).stdout)
    return out if isinstance(out, list) else [out]


def test_schedule_as_bml_has_every_time_as_a_number() -> None:
    done = schedule("-", "--bml", text=TALK)
    assert done.return_value == 0
    assert "b:f: CANNOT_CREATE_BEHAVIOR" in done.stderr
    block = parse(done.stdout)
    assert [node.id for node in block.behaviours] == ["s", "n", "w"]
    for node in block.behaviours:
        assert set(node.syncs) == set(node.sync_points)
        assert all(ref == SyncRef(offset=ref.offset) for ref in node.syncs.values())
    assert times(done.stdout)[0]["behaviours"] == times(TALK)[0]["behaviours"]


DOCUMENTS = [
    path
    for path in sorted(CORPUS.rglob("*.xml"))
    if [type(item) for item in read(path.read_bytes(), VOCABULARY)] == [Block]
]


@each_row("path", DOCUMENTS[::3])
def test_schedule_of_its_own_bml_gives_the_same_times(path: Path) -> None:
    first = schedule(str(path), "--json")
    written = schedule(str(path), "--bml")
    assert written.return_value == first.return_value
    wanted = json.loads(first.stdout)
    if not written.stdout:
        assert first.return_value == 1
        return
    (again,) = times(written.stdout)
    assert again["block"] == wanted["block"]
    assert again["behaviours"].keys() == wanted["behaviours"].keys()
    for behaviour, points in wanted["behaviours"].items():
        assert again["behaviours"][behaviour] == pytest.approx(points, abs=1e-6)


def test_schedule_as_bml_writes_several_documents(tmp_path: Path) -> None:
    out = tmp_path / "timed.bml"
    two = TALK + '<bml id="c" composition="APPEND"><head id="h" lexeme="NOD" start="b:n:end + 1"/></bml>'
    done = schedule("-", "--bml", "-o", str(out), text=two)
    assert done.stdout == ""
    blocks = list(read(out.read_bytes()))
    assert [block.id for block in blocks if isinstance(block, Block)] == ["b", "c"]
    assert times(out.read_text("utf-8"))[1]["behaviours"]["h"] == pytest.approx(
        times(two)[1]["behaviours"]["h"], abs=1e-6
    )


def test_schedule_as_bml_leaves_out_a_refused_block() -> None:
    done = schedule("-", "--bml", text=TALK + '<bml id="c"><required><head id="h"/></required></bml>')
    assert done.return_value == 1
    assert [item.id for item in read(done.stdout) if isinstance(item, Block)] == ["b"]
    assert "c" in done.stderr


@pytest.mark.parametrize("text", ["", "<!-- later -->", "<bml/>", "<bml id='b'><oops"])
def test_realize_writes_nothing_if_no_block_was_accepted(tmp_path: Path, text: str) -> None:
    out = tmp_path / "x.png"
    out.write_bytes(b"of before")
    done = CliRunner().invoke(cli, ["realize", "-", "-o", str(out)], input=text, standalone_mode=False)
    assert done.return_value == 1
    assert "not written" in done.stderr
    assert out.read_bytes() == b"of before"


@pytest.mark.parametrize(
    ("inside", "status"),
    [
        ('<faceLexeme id="f" lexeme="NOPE"/>', 1),
        ('<speech id="s"><text> </text></speech>', 1),
        ('<gesture id="g" lexeme="BEAT" start="nobody:end"/>', 1),
        ('<wait id="w" duration="1"/>', 0),
        ('<faceLexeme id="f" lexeme="NOPE"/><head id="h" lexeme="NOD"/>', 0),
        ('<speech id="s" start="0" end="0.2"><text>My name is Sam.</text></speech>', 0),
        ("", 0),
    ],
)
def test_realize_exits_with_1_if_something_was_asked_for_and_nothing_plays(
    tmp_path: Path, inside: str, status: int
) -> None:
    command = ["-q", "realize", "-", "-o", str(tmp_path / "x.json"), "--voice", "silent"]
    done = CliRunner().invoke(cli, command, input=f'<bml id="b">{inside}</bml>', standalone_mode=False)
    assert done.return_value == status
    assert ("nothing is heard or moves" in done.stderr) == bool(status)
    assert (tmp_path / "x.json").is_file()


@pytest.mark.parametrize("command", ["realize -o out/0.json", "batch -o out --format json"])
def test_realize_on_a_full_disk_names_the_file_and_leaves_no_part(tmp_path: Path, command: str) -> None:
    (tmp_path / "0.bml").write_text(TALK)
    (tmp_path / "out").mkdir()
    name, *flags = command.split()
    # -B: the limit would also cut compiled modules, which other processes load.
    line = shlex.join([sys.executable, "-B", "-m", "realizer", name, "0.bml", "--voice", "silent", *flags])
    limited = ["sh", "-c", f"ulimit -f 8; exec {line}"]
    done = subprocess.run(limited, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 3
    assert re.search(r"realizer: .*out/0\.json: File too large", done.stderr)
    assert not list((tmp_path / "out").glob("*.json"))
    assert not list((tmp_path / "out").glob(".0*"))


@pytest.mark.parametrize(("suffix", "is_named"), [(".fap", True), (".vtt", False)])
def test_realize_names_characters_that_a_format_leaves_out(
    tmp_path: Path, suffix: str, is_named: bool
) -> None:
    two = "".join(f'<bml id="{who}" characterId="{who}"><wait id="w" duration="1"/></bml>' for who in "ab")
    done = CliRunner().invoke(cli, ["-q", "realize", "-", "-o", str(tmp_path / f"x{suffix}")], input=two)
    assert done.exit_code == 0
    assert ("shows a, not b" in done.stderr) is is_named


def test_schedule_keeps_the_planned_times_of_a_replaced_block() -> None:
    text = TALK + '<bml id="c" composition="REPLACE"><wait id="w" duration="1"/></bml>'
    first, second = times(text)
    assert first["behaviours"] == times(TALK)[0]["behaviours"]
    assert second["behaviours"] == {"w": {"start": 0.0, "end": 1.0}}


def test_schedule_drops_what_realize_drops_when_a_block_starts() -> None:
    text = (
        '<bml id="a"><gaze id="g" target="LEFT" start="0" end="2"/></bml>'
        '<bml id="b"><gaze id="g" target="RIGHT" start="0" end="1"/><wait id="w" duration="1"/></bml>'
    )
    done = schedule("-", "--json", "--detail", "--strict", text=text)
    played = realize_documents(text, voice="silent", idle=False).schedules
    rows = json.loads(done.stdout)
    assert [row["warnings"] for row in rows] == [s.to_json()["warnings"] for s in played]
    assert [list(row["behaviours"]) for row in rows] == [["g"], ["w"]]
    assert [gone["id"] for gone in rows[1]["dropped"]] == ["g"]
    assert done.return_value == 1


def test_schedule_starts_what_another_document_activates() -> None:
    preplanned = '<bml xmlns:bmla="http://www.asap-project.org/bmla" id="a" bmla:preplan="true"/>'
    activates = preplanned.replace('id="a" bmla:preplan="true"', 'id="b" bmla:onStart="a"')
    late = activates.replace("/>", ' composition="APPEND"/>')
    first, *_ = times(preplanned + '<bml id="c"><wait id="w" duration="1.5"/></bml>' + late)
    assert first["start"] == 1.5


def test_schedule_refuses_json_and_bml_together(tmp_path: Path) -> None:
    done = CliRunner().invoke(cli, ["schedule", "-", "--bml", "--json"], input=TALK)
    assert done.exit_code == 2
    done = CliRunner().invoke(cli, ["schedule", "-", "-o", str(tmp_path / "no" / "x")], input=TALK)
    assert done.exit_code == 2
    assert "No such file" in done.stderr


@pytest.mark.parametrize("suffix", [".svg", ".png"])
def test_schedule_draws_a_plot_instead_of_a_table(tmp_path: Path, suffix: str) -> None:
    out = tmp_path / f"timeline{suffix}"
    done = schedule("-", "--plot", str(out), text=TALK)
    assert (done.return_value, done.stdout) == (0, "")
    assert out.read_bytes().startswith(b"<svg" if suffix == ".svg" else b"\x89PNG")


def test_schedule_draws_a_plot_and_prints_json(tmp_path: Path) -> None:
    out = tmp_path / "timeline.svg"
    both = schedule("-", "--json", "--plot", str(out), text=TALK)
    assert json.loads(both.stdout) == json.loads(schedule("-", "--json", text=TALK).stdout)
    assert ">n<" in out.read_text()


def test_schedule_draws_several_documents_in_one_plot(tmp_path: Path) -> None:
    (tmp_path / "a.bml").write_text(TALK)
    (tmp_path / "b.bml").write_text(TALK.replace('id="b"', 'id="later" composition="APPEND"'))
    out = tmp_path / "timeline.svg"
    schedule(str(tmp_path / "a.bml"), str(tmp_path / "b.bml"), "--plot", str(out))
    assert "Timeline of b, later" in out.read_text()


@pytest.mark.parametrize("name", ["timeline.pdf", "timeline"])
def test_schedule_refuses_an_unknown_suffix_of_a_plot(tmp_path: Path, name: str) -> None:
    with pytest.raises(click.BadParameter, match=r"wanted a suffix of \.svg \.png"):
        schedule("-", "--plot", str(tmp_path / name), text=TALK)
    assert list(tmp_path.iterdir()) == []


def test_schedule_refuses_a_plot_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(click.UsageError, match="No such file or directory"):
        schedule("-", "--plot", str(tmp_path / "nowhere" / "timeline.svg"), text=TALK)


def test_schedule_in_detail_has_further_keys() -> None:
    plain = json.loads(schedule("-", "--json", text=TALK).stdout)
    detailed = json.loads(schedule("-", "--json", "--detail", text=TALK).stdout)
    assert {key: detailed[key] for key in plain} == plain
    assert set(detailed) - set(plain) == {"state", "cost", "gaps", "links", "dropped"}
    assert detailed["gaps"].keys() == detailed["links"].keys() == plain["behaviours"].keys()
    assert [link["to"] for link in detailed["links"]["n"]] == ["s:t"]
    assert [gone["id"] for gone in detailed["dropped"]] == ["f"]


def test_schedule_refuses_detail_without_json() -> None:
    with pytest.raises(click.UsageError, match="wanted --json"):
        schedule("-", "--detail", text=TALK)


def test_realize_refuses_visemes_except_for_fap_files(tmp_path: Path) -> None:
    for out, status in (("clip.fap", 0), ("clip.json", 2)):
        path = tmp_path / out
        arguments = ["-q", "realize", "-", "-o", str(path), "--voice", "silent", "--visemes"]
        done = CliRunner().invoke(cli, arguments, input=TALK)
        assert done.exit_code == status
        assert path.exists() == (status == 0)
        assert ("wanted a .fap file" in done.stderr) == (status == 2)


def test_realize_refuses_morphs_except_for_glb_files(tmp_path: Path) -> None:
    arguments = ["-q", "realize", "-", "--voice", "silent", "--morphs", "arkit"]
    done = CliRunner().invoke(cli, [*arguments, "-o", str(tmp_path / "x.fap")], input=TALK)
    assert done.exit_code == 2
    assert "wanted a .glb file to write morph targets into" in done.stderr


def test_realize_animates_an_avatar_and_says_which_names_it_wants(tmp_path: Path) -> None:
    (tmp_path / "mine.glb").write_bytes(avatars.avatar())
    (tmp_path / "foreign.vrm").write_bytes(avatars.avatar(("grin",)))
    for name, status in (("mine.glb", 0), ("foreign.vrm", 2), ("none.glb", 2)):
        out = tmp_path / f"{name}-out.glb"
        arguments = [
            "-q",
            "realize",
            "-",
            "-o",
            str(out),
            "--voice",
            "silent",
            "--avatar",
            str(tmp_path / name),
        ]
        done = CliRunner().invoke(cli, arguments, input=TALK)
        assert (done.exit_code, out.exists()) == (status, status == 0)
        assert ("wanted morph targets with ARKit's names" in done.stderr) == (name == "foreign.vrm")


DIALECT = '<act><bml><head type="NOD"/></bml></act>'


@pytest.mark.parametrize("command", ["realize", "schedule"])
def test_strict_bml_refuses_what_is_read_as_a_dialect_otherwise(tmp_path: Path, command: str) -> None:
    document = tmp_path / "d.bml"
    document.write_text(DIALECT)
    lenient = CliRunner().invoke(cli, [command, str(document), "--strict"], standalone_mode=False)
    assert lenient.return_value == 0
    assert "unnamed1: NOT_BML_1_0" in lenient.stderr
    for options, variables in ((["--strict-bml"], {}), ([], {"REALIZER_STRICT_BML": "1"})):
        strict = CliRunner().invoke(
            cli, [command, str(document), *options], env=variables, standalone_mode=False
        )
        assert strict.return_value == 1
        assert "id: wanted one, got none; this is SmartBody's BML, which is not read in" in strict.stderr


def test_schedule_writes_a_dialect_as_bml_1_0(tmp_path: Path) -> None:
    document = tmp_path / "d.bml"
    document.write_text(DIALECT)
    written = CliRunner().invoke(cli, ["schedule", str(document), "--bml"], standalone_mode=False).stdout
    assert 'id="unnamed1"' in written
    assert '<head id="head1" lexeme="NOD" start="0"' in written


@pytest.mark.parametrize(("suffix", "status"), [("fap", 0), ("png", 2)])
def test_realize_checks_the_camera_of_pictures_only(tmp_path: Path, suffix: str, status: int) -> None:
    output = str(tmp_path / f"a.{suffix}")
    flags = ["--voice", "silent", "--camera", "top", "-o", output]
    done = CliRunner().invoke(cli, ["realize", "-", *flags], input='<bml id="b"><wait duration="1"/></bml>')
    assert done.exit_code == status
    assert ("got 'top'" in done.output) is (status == 2)
    assert Path(output).exists() is (status == 0)


def test_realize_names_options_that_change_nothing_without_pictures(tmp_path: Path) -> None:
    done = run(
        "realize", "-", "-o", str(tmp_path / "x.fap"), "--size", "64x64", "--light", "studio", stdin=TALK
    )
    assert ".fap has no pictures: --size, --light changes nothing\n" in done.stderr
    assert "changes nothing" not in run("realize", "-", "-o", str(tmp_path / "x.fap"), stdin=TALK).stderr


def test_realize_speaks_a_text(tmp_path: Path) -> None:
    done = run("realize", "Hello there", "--voice", "silent", "-o", str(tmp_path / "x.vtt"))
    assert done.returncode == 0
    assert "Hello" in (tmp_path / "x.vtt").read_text()


@pytest.mark.parametrize("name", ["hello.bml", "no/such"])
@pytest.mark.parametrize("command", ["realize", "schedule", "check"])
def test_commands_refuse_a_missing_file(command: str, name: str) -> None:
    done = run(command, name)
    assert done.returncode == 2
    assert f"{name}: no such file" in done.stderr


@pytest.mark.parametrize(
    "flags",
    [["--face", "adda"], ["--face", "no/face"], ["--voice", "nobody"], ["--at", "9"], ["--light", "x"]],
)
def test_realize_refuses_wrong_names_with_status_2(tmp_path: Path, flags: list[str]) -> None:
    done = run("realize", "-", *flags, "-o", str(tmp_path / "x.png"), stdin=TALK)
    assert done.returncode == 2
    assert "wanted" in done.stderr or "no such face" in done.stderr
    assert not list(tmp_path.iterdir())
