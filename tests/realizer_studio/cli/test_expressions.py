"""Tests of `realizer expressions`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from realizer.animation.axis import au_row
from realizer.animation.frames import AUFrames
from realizer.animation.pose import poses
from realizer.cli import cli
from realizer.expressions.library import builtin
from realizer.face.load import input_names, list_faces
from tests.pictures import drawn_here


def run(*words: str) -> Result:
    return CliRunner().invoke(cli, ["expressions", *words])


def test_list_has_all_expressions_with_units_and_times() -> None:
    done = run("list")
    assert done.exit_code == 0
    lines = done.stdout.splitlines()
    assert len(lines) == len(builtin())
    assert any(line.split()[:2] == ["SMILE", "6+12"] for line in lines)


def test_list_as_json_has_all_fields() -> None:
    rows = {row["name"]: row for row in json.loads(run("list", "--json").stdout)}
    grief = rows["template:grief"]
    assert grief["aus"] == {"1": 1.0}
    assert grief["possible"] == [0.25, 4.0]
    assert "Wojdel" in grief["apex"]["source"]


def test_find_searches_by_words_and_by_action_units() -> None:
    assert "template:regret" in run("find", "sorry").stdout.splitlines()[0]
    assert "template:disgust" in run("find", "--au", "9").stdout.splitlines()[0]
    assert "LEFT_BROW" in run("find", "--au", "AU1L=0.8, 2L").stdout.splitlines()[0]


def test_find_prints_at_most_the_requested_number() -> None:
    rows = json.loads(run("find", "smile", "--limit", "2", "--json").stdout)
    assert len(rows) == 2
    assert rows[0]["score"] >= rows[1]["score"] > 0


def test_find_includes_a_users_expressions(tmp_path: Path) -> None:
    (tmp_path / "wave.toml").write_text('means = ["hullo"]\naus = { 12R = 0.5 }\n', "utf-8")
    done = run("find", "hullo", "--expressions", str(tmp_path))
    assert "wave" in done.stdout
    assert "wave.toml" in done.stdout


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["find"], "wanted one of TEXT, --au and --like"),
        (["find", "smile", "--au", "1"], "wanted one of TEXT, --au and --like"),
        (["find", "--au", "99"], "wanted an action unit such as 12 or 12L, got '99'"),
        (["find", "--au", "1=7"], "'--au': 1: wanted an intensity above 0 and to 1, got 7"),
        (["list", "-o", "sheet.txt"], "sheet.txt: wanted a name that ends in .png"),
    ],
)
def test_expressions_refuse_wrong_options(words: list[str], error: str) -> None:
    done = CliRunner().invoke(cli, ["expressions", *words])
    assert done.exit_code == 2
    assert error in " ".join(done.stderr.split())


def test_find_without_a_match_exits_with_1() -> None:
    done = CliRunner().invoke(cli, ["expressions", "find", "qqqq"], standalone_mode=False)
    assert done.return_value == 1
    assert "no expression matches 'qqqq'" in done.stderr


@pytest.mark.xdist_group("picture_search")
@pytest.mark.slow
@pytest.mark.long
def test_find_like_a_neutral_face_that_idles_has_no_match(tmp_path: Path) -> None:
    from PIL import Image

    pose = np.zeros((1, 68), np.float32)
    pose[0, 47:50] = 442, -442, -343  # a head that idles
    Image.fromarray(drawn_here("ben", (300, 400), pose)[0]).save(tmp_path / "ben.png")
    done = CliRunner().invoke(
        cli,
        ["expressions", "find", "--like", str(tmp_path / "ben.png"), "--face", "ben"],
        standalone_mode=False,
    )
    assert done.stdout == ""
    assert (done.return_value, "no expression matches" in done.stderr) == (1, True)


@pytest.mark.xdist_group("picture_search")
@pytest.mark.slow
@pytest.mark.long
def test_find_like_tracks_a_picture_of_none_of_our_faces(tmp_path: Path, monkeypatch) -> None:
    from PIL import Image

    ada = [info for info in list_faces() if info.name == "ada"]
    monkeypatch.setattr("realizer_studio.analysis.picture_search.list_faces", lambda: ada)
    smile = poses(AUFrames(np.zeros(1), au_row({(12, "BOTH"): 1.0})[None]), input_names("nia"))
    Image.fromarray(drawn_here("nia", (300, 400), smile, camera="close")[0]).save(tmp_path / "x.png")
    done = CliRunner().invoke(cli, ["expressions", "find", "--like", str(tmp_path / "x.png"), "--json"])
    assert "none of our faces; action units" in done.stderr
    assert {row["name"] for row in json.loads(done.stdout)[:2]} == {"SMILE", "RAISE_MOUTH_CORNERS"}
