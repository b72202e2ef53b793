"""Tests of `realizer timeline`, and of `realizer check` with timelines."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from realizer.cli import cli

GOOD = """
[[channel]]
name = "brows"
entries = [
    { expression = "template:surprise" },
    { expression = "neutral" },
    { expression = "wry", duration = 3 },
]
"""
OWN = "aus = { 12R = 0.6 }\nprobable = [0.5, 1.5]\n"


def run(*words: str) -> Result:
    return CliRunner().invoke(cli, list(words), standalone_mode=False)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "wry.toml").write_text(OWN, "utf-8")
    path = tmp_path / "a & b.toml"
    path.write_text(GOOD, "utf-8")
    return path


def test_timeline_plays_like_a_document(file: Path) -> None:
    out = file.with_suffix(".json")
    done = run("timeline", str(file), "--expressions", str(file.parent / "mine"), "-o", str(out), "--no-idle")
    assert done.return_value == 0, done.stderr
    written = json.loads(out.read_text("utf-8"))
    assert written["warnings"] == []
    names = written["au"]["names"]
    values = written["au"]["values"]
    assert max(row[names.index("1L")] for row in values) == pytest.approx(0.9, abs=1e-3)
    assert max(row[names.index("12R")] for row in values) == pytest.approx(0.6, abs=1e-3)
    assert written["duration"] == pytest.approx(1.4 + 0.5 + 3, abs=1e-3)


def test_timeline_prints_every_fault(file: Path) -> None:
    done = run("timeline", str(file))
    assert done.return_value == 1
    assert f"{file}: channel brows, entry 3, expression: wanted a name" in done.stderr
    assert done.stdout == ""


def test_check_prints_faults_of_a_timeline_on_standard_output(file: Path) -> None:
    done = run("check", str(file))
    assert done.return_value == 1
    assert done.stdout.startswith(f"{file}: channel brows, entry 3, expression: wanted")
    file.write_text("channel = [1, 2]", "utf-8")
    assert len(run("check", str(file)).stdout.splitlines()) == 2


def test_check_gives_advice_on_a_timeline_without_faults(file: Path) -> None:
    done = run("check", str(file), "--expressions", str(file.parent / "mine"))
    assert done.return_value == 0
    assert done.stdout == ""
    assert "ADVICE channel brows, entry 3: wry is visible for 2.6 s, which is unusually long" in done.stderr
    assert "wry.toml" in done.stderr
    text = '{"channel": [{"entries": [{"expression": "template:disgust", "duration": 4}]}]}'
    file.with_suffix(".json").write_text(text, "utf-8")
    done = run("check", str(file.with_suffix(".json")))
    assert "it was never observed so long" in done.stderr
    assert "disgust stands alone" in done.stderr
    limited = run("check", str(file.with_suffix(".json")), "--limit")
    assert limited.return_value == 1
    assert "IMPOSSIBLE_LENGTH" in limited.stdout


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["x.bml"], "x.bml: wanted a name that ends in .toml or .json"),
        (["x.toml", "--media", "."], "refers to no"),
    ],
)
def test_timeline_refuses_wrong_options(tmp_path: Path, words: list[str], message: str) -> None:
    (tmp_path / words[0]).write_text("", "utf-8")
    done = CliRunner().invoke(cli, ["timeline", str(tmp_path / words[0]), *words[1:]])
    assert done.exit_code == 2
    assert message in " ".join(done.stderr.split())


def test_timeline_plays_with_a_warning_on_a_mixer_without_effect(file: Path) -> None:
    file.write_text('mixer = "successive"\n[[channel]]\nentries = [{ expression = "smile" }]', "utf-8")
    out = str(file.with_suffix(".json"))
    done = run("timeline", str(file), "--deformer", "mpeg4", "-o", out)
    assert done.return_value == 0
    assert "mixer: no effect, FAPs move this face" in done.stderr
    done = run("timeline", str(file), "--deformer", "au", "-o", out)
    assert done.return_value == 0
    assert "no effect" not in done.stderr


def test_check_gives_advice_on_an_order_without_effect(file: Path) -> None:
    file.write_text('order = [4, 1]\n[[channel]]\nentries = [{ expression = "smile" }]', "utf-8")
    done = run("check", str(file))
    assert done.return_value == 0
    assert "ADVICE order: no effect, a sum has no order" in done.stderr
    file.write_text('order = [4, 51]\n[[channel]]\nentries = [{ expression = "smile" }]', "utf-8")
    done = run("check", str(file))
    assert done.return_value == 1
    assert done.stdout.startswith(f"{file}: timeline, order, place 2: wanted the number of an action unit")
