"""Tests of `realizer study`."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from realizer.cli import cli
from realizer_studio.cli.study import KINDS
from realizer_studio.study import items
from tests.studies import kit, line, matches, named, write


def run(*args: object) -> Result:
    return CliRunner().invoke(cli, [*map(str, args)])


def test_kinds_are_those_of_the_library() -> None:
    assert KINDS == items.KINDS


def test_analyse_finds_the_key_beside_the_answers(tmp_path: Path) -> None:
    key = json.loads(kit(tmp_path / "s", [*matches(4), *named()]).read_text())
    rows = [line(key, name, "right" if one["options"] else "joy") for name, one in key["items"].items()]
    answers = write(tmp_path / "a.csv", rows)
    done = run("study", "analyse", answers, "-o", tmp_path / "out")
    assert done.exit_code == 0, done.output
    assert "report.html" in done.stderr
    with (tmp_path / "out" / "5.1.csv").open() as file:
        assert next(csv.DictReader(file))["right"] == "1"
    assert "data:image/webp" in (tmp_path / "out" / "report.html").read_text()


def test_analyse_names_who_failed_and_leaves_them_out(tmp_path: Path) -> None:
    check = items.Item("naming", {"check": "joy"}, {}, check="joy")
    key = json.loads(kit(tmp_path / "s", [*named(), check]).read_text())
    (asked,) = [name for name, one in key["items"].items() if "check" in one]
    rows = [line(key, name, "fear" if name == asked else "joy", 7) for name in key["items"]]
    answers = write(tmp_path / "a.csv", rows)
    none = run("study", "analyse", answers, "-o", tmp_path / "out")
    assert (none.exit_code, "left out: 7 (people)" in none.stderr) == (1, True)
    kept = run("study", "analyse", answers, "-o", tmp_path / "out", "--keep")
    assert (kept.exit_code, "kept: 7 (people)" in kept.stderr) == (0, True)


def test_analyse_says_what_is_wrong_in_a_sentence(tmp_path: Path) -> None:
    key = kit(tmp_path / "s", named())
    other = kit(tmp_path / "t", named())
    answers = write(tmp_path / "a.csv", [])
    out = ("-o", tmp_path / "out")
    for args, said in (
        ((answers,), "wanted --key DIR.key.json, got 2 keys"),
        ((answers, "--key", key), "at least one answer"),
        ((other, "--key", key), "wanted answers with the columns"),
        ((answers, "--key", answers), "wanted the key of a study"),
    ):
        done = run("study", "analyse", *args, *out)
        assert done.exit_code != 0
        assert said in f"{done.output}{done.exception}"
    assert not (tmp_path / "out").exists()


def test_make_refuses_before_it_draws(tmp_path: Path) -> None:
    kit(tmp_path / "s", named())
    for args, said in (
        ((tmp_path / "s",), "wanted a new or empty folder"),
        ((tmp_path / "no" / "s",), "wanted a folder that can be written, to make s in it"),
        ((tmp_path / "x", "--face", "zorg"), "zorg"),
        ((tmp_path / "x", "--face", "ada", "--face", "ada"), "wanted different names"),
        ((tmp_path / "x", "--kind", "smell"), "smell"),
        ((tmp_path / "x", "--judges", 0), "0"),
    ):
        done = run("study", "make", *args)
        assert done.exit_code == 2
        assert said in done.output
    assert (tmp_path / "s" / "index.html").is_file()


@pytest.mark.gl
@pytest.mark.slow
def test_make_judge_and_analyse_go_together(tmp_path: Path) -> None:
    pytest.importorskip("ai_edge_litert")
    made = run("study", "make", tmp_path / "s", "--items", 4, "--seed", 1)
    assert made.exit_code == 0, made.output
    judged = run("study", "judge", tmp_path / "s", "-o", tmp_path / "machine.csv")
    assert judged.exit_code == 0, judged.output
    assert run("study", "analyse", tmp_path / "machine.csv", "-o", tmp_path / "out").exit_code == 0
    with (tmp_path / "out" / "5.1.csv").open() as file:
        assert next(csv.DictReader(file))["who"] == "machine"
