"""Tests of `realizer fap`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from realizer.animation.fap.fap_reader import read_fap
from realizer.cli import cli

MASK = " ".join("1" if fap in (1, 2, 31) else "0" for fap in range(1, 69))


def run(*args: str, input: bytes | None = None) -> Result:
    return CliRunner().invoke(cli, ["fap", *args], input=input)


@pytest.fixture
def actor(tmp_path: Path) -> Path:
    """A second in which the mouth says a, the face is surprised, and a brow does as it likes."""
    lines = ["2.1 C:\\my clips\\actor.fap 25 26"]
    for frame in range(26):
        lines += [MASK, f"{frame} 10 0 63 0 6 63 0 0 0 0 {10 * (frame % 2)}"]
    path = tmp_path / "actor.fap"
    path.write_text("\r\n".join(lines))
    return path


def test_info_prints_duration_rate_and_ranges(actor: Path) -> None:
    done = run("info", str(actor))
    assert done.exit_code == 0
    assert done.stdout.splitlines() == [
        "C:\\my clips\\actor.fap: 26 frames at 25 fps, 1 s",
        "  31 raise_l_i_eyebrow            0 .. 10      ENS",
        "   1 visemes                10",
        "   2 expressions            6",
    ]
    assert done.stderr == f"{actor}: line 1: the name has blanks\n"


def test_info_as_json_has_the_same_values(actor: Path) -> None:
    done = json.loads(run("info", str(actor), "--json").stdout)
    assert done == {
        "name": "C:\\my clips\\actor.fap",
        "fps": 25.0,
        "frames": 26,
        "duration": 1.0,
        "faps": {"raise_l_i_eyebrow": {"least": 0, "most": 10, "unit": "ENS"}},
        "visemes": [10],
        "expressions": [6],
        "notes": ["line 1: the name has blanks"],
    }


def test_info_reads_standard_input_and_a_file_without_frames(actor: Path) -> None:
    assert run("info", "-", input=actor.read_bytes()).stdout.startswith("C:\\my clips")
    assert run("info", "-", input=b"2.1 x 25 0\n").stdout == "x: 0 frames at 25 fps, 0 s\n"


def test_convert_writes_the_form_of_the_standard(actor: Path, tmp_path: Path) -> None:
    out = tmp_path / "clean.fap"
    done = run("convert", str(actor), "-o", str(out))
    assert done.exit_code == 0
    text = out.read_text()
    assert text.splitlines()[0] == "2.1 C:\\my_clips\\actor.fap 25 26"
    assert text.splitlines()[1:3] == [MASK, "0 10 0 63 0 6 63 0 0 0 0 0"]
    assert "\r" not in text
    assert read_fap(text).notes == ()


def test_convert_round_trips_by_csv_and_json_at_another_rate(actor: Path, tmp_path: Path) -> None:
    table, data, back = (str(tmp_path / name) for name in ("a.csv", "a.json", "a.fap"))
    for args in (
        (str(actor), "-o", table, "--fps", "50"),
        (table, "-o", data),
        (data, "-o", back, "--fps", "25"),
    ):
        assert run("convert", *args).exit_code == 0
    assert Path(table).read_text().splitlines()[0].startswith("time,viseme_select1,")
    assert len(Path(table).read_text().splitlines()) == 1 + 51
    got, original = read_fap(Path(back).read_text()), read_fap(actor.read_text())
    np.testing.assert_array_equal(got.values, original.values)
    np.testing.assert_array_equal(got.expressions, original.expressions)


def test_convert_expands_visemes_and_expressions(actor: Path, tmp_path: Path) -> None:
    out = tmp_path / "plain.fap"
    assert run("convert", str(actor), "-o", str(out), "--expand").exit_code == 0
    got = read_fap(out.read_text())
    assert not got.mask[:2].any()
    assert got.values[0, 4] < -300
    assert got.values[:, 31].min() > 100


def test_convert_limits_values_and_reports_it(tmp_path: Path) -> None:
    mask = " ".join("1" if fap == 3 else "0" for fap in range(1, 69))
    done = run("convert", "-", "-o", str(tmp_path / "x.fap"), input=f"2.1 x 25 1\n{mask}\n0 -9\n".encode())
    assert "FAP 3 (open_jaw): wanted 0..4320, got -9; limited to it" in done.stderr
    assert read_fap((tmp_path / "x.fap").read_text()).values[0, 2] == 0


def test_play_writes_a_file_at_the_rate_of_the_clip(actor: Path, tmp_path: Path) -> None:
    out = tmp_path / "played.json"
    done = run("play", str(actor), "--no-idle", "-o", str(out))
    assert done.exit_code == 0, done.output
    played = json.loads(out.read_text())
    assert (played["fps"], played["frames"], played["warnings"]) == (25, 26, [])
    values = np.array(played["fap"]["values"])
    assert values[5:20, 30].tolist() == [10 * (k % 2) for k in range(5, 20)]
    assert values[12, 4] < -300
    assert values[12, 31] > 100


def test_play_holds_a_file_of_one_frame_for_a_second(tmp_path: Path) -> None:
    out = tmp_path / "held.csv"
    mask = " ".join("1" if fap == 3 else "0" for fap in range(1, 69))
    done = run("play", "-", "--no-idle", "-o", str(out), input=f"2.1 x 25 1\n{mask}\n0 400\n".encode())
    assert done.exit_code == 0, done.output
    rows = [line.split(",") for line in out.read_text().splitlines()]
    jaw = rows[0].index("open_jaw")
    assert len(rows) == 1 + 26
    assert rows[13][jaw] == "400"


@pytest.mark.slow
def test_play_draws_a_picture(actor: Path, tmp_path: Path) -> None:
    out = tmp_path / "face.png"
    done = run("play", str(actor), "--at", "0.5", "--size", "64x64", "--face", "ben", "-o", str(out))
    assert done.exit_code == 0, done.output
    assert out.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("command", ["info", "play", "convert"])
def test_fap_exits_with_1_for_a_file_that_is_not_fap(command: str, tmp_path: Path) -> None:
    (tmp_path / "x.fap").write_text("hello world")
    out = ["-o", str(tmp_path / "out.fap")] if command != "info" else []
    done = run(command, str(tmp_path / "x.fap"), *out)
    assert done.exit_code == 1
    assert "x.fap: line 1: wanted a header '2.1 NAME FPS COUNT' or a mask, got 'hello'" in done.output
    assert not (tmp_path / "out.fap").exists()


@pytest.mark.parametrize("content", [b"2.1 x 25 0\n", b"2.1 x 25 1\n" + b"0 " * 68 + b"\n0\n"])
def test_play_refuses_a_file_without_frames(content: bytes) -> None:
    done = run("play", "-", input=content)
    assert done.exit_code == 1
    assert "wanted at least two frames of a FAP from 3 on" in done.output


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (["-o", "x.png"], "x.png: wanted a name that ends in .fap or .csv or .json"),
        (["-o", "x"], "x: wanted a name that ends in .fap or .csv or .json"),
        ([], "Missing option '-o'"),
        (["-o", "x.fap", "--fps", "0"], "--fps"),
        (["-o", "no/such/folder/x.fap"], "No such file or directory"),
    ],
)
def test_convert_refuses_wrong_options(actor: Path, args: list[str], says: str) -> None:
    done = run("convert", str(actor), *args)
    assert done.exit_code == 2
    assert says in done.output


def test_play_refuses_too_many_frames(tmp_path: Path) -> None:
    mask = " ".join("01"[fap > 2] for fap in range(1, 69))
    frames = "".join(f"{mask}\n{frame} {'1000 ' * 66}\n" for frame in range(4_000))
    done = run("play", "-", "-o", str(tmp_path / "long.csv"), input=f"2.1 long 25 4000\n{frames}".encode())
    assert done.exit_code == 1
    assert "wanted at most about" in done.stderr
    assert "got 4000; `realizer fap convert --fps`" in done.stderr
    assert not (tmp_path / "long.csv").exists()
