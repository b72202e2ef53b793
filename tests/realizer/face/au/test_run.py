"""Tests of documents played by both deformers."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import realizer
from realizer.cli import cli
from realizer.core.options import PlayOptions
from realizer.core.settings import Settings, SettingsError
from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.face.model import Face
from realizer.playback.player import Player
from realizer.render.renderer import Renderer
from realizer.server.session.session import Session
from realizer.server.streams.frame_windows import FrameTimeline

pytestmark = pytest.mark.xdist_group("render")

BOTH = ("mpeg4", "au")
SPEECH = '<speech id="s" start="0.2"><text>Maybe you would both prefer a warm moment of fun.</text></speech>'
WHEN = 'start="0" attackPeak="0.4" relax="1" end="1.4"'
PEAK = 15  # the frame at 25 fps that is looked at


def facs(au: int, side: str = "BOTH") -> str:
    return f'<faceFacs id="f" au="{au}" side="{side}" amount="1" {WHEN}/>'


def lexeme(name: str) -> str:
    return f'<faceLexeme id="f" lexeme="{name}" {WHEN}/>'


def play(inner: str, deformer: str, **options: Any) -> realizer.Realization:
    document = f'<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="b">{inner}</bml>'
    return realizer.realize(document, deformer=deformer, voice="silent", **{"idle": False, **options})


@pytest.fixture(scope="module")
def faces() -> dict[str, Face]:
    return {name: load_face(deformer=name) for name in BOTH}


@pytest.mark.parametrize(
    ("inner", "points"),
    [
        (lexeme("SMILE"), ("8.3", "8.4")),
        (facs(12, "LEFT"), ("8.3",)),
        (facs(15), ("8.3", "8.4")),
        (lexeme("OPEN_MOUTH"), ("2.3", "2.1", "8.2")),
        (facs(27), ("2.3", "2.1", "8.2")),
        (lexeme("RAISE_BROWS"), ("4.1", "4.2", "4.3", "4.4", "4.5", "4.6")),
        (lexeme("LOWER_BROWS"), ("4.1", "4.2", "4.3", "4.4")),
        (facs(43), ("3.1", "3.2")),
        (facs(5), ("3.1", "3.2")),
    ],
    ids=["smile", "smile-left", "frown", "open", "stretch", "brows-up", "brows-down", "closed", "wide"],
)
def test_deformers_move_a_landmark_the_same_way(
    faces: dict[str, Face], inner: str, points: tuple[str, ...]
) -> None:
    moved = {}
    for name, face in faces.items():
        pose = play(inner, name).poses[[PEAK]]
        moved[name] = deform(face, pose)[0].astype(float) - face.vertices
    for point in points:
        vertex = faces["au"].feature_points[point]
        one, other = (moved[name][vertex] for name in BOTH)
        long, length = np.linalg.norm(one), np.linalg.norm(other)
        assert one @ other > 0.85 * long * length, f"{point} goes another way"
        assert 0.5 < length / long < 2.2, f"{point} goes {length / long:.2f} times as far"


@pytest.mark.parametrize("extra", ["", lexeme("SMILE"), lexeme("OPEN_MOUTH")], ids=["", "smile", "open"])
def test_deformers_speak_alike(faces: dict[str, Face], extra: str) -> None:
    gaps = {}
    for name, face in faces.items():
        played = play(SPEECH + extra.replace('end="1.4"', 'end="9"').replace('relax="1"', 'relax="8"'), name)
        spoken = played.poses[: round(25 * (played.speech[0][0] + played.speech[0][1].duration))]
        vertices = deform(face, spoken)
        upper, lower = (face.feature_points[point] for point in ("2.2", "2.3"))
        gaps[name] = (vertices[:, upper, 1] - vertices[:, lower, 1])[12:-8]
    assert gaps["mpeg4"].max() > 0.004, "it speaks"
    assert gaps["au"] == pytest.approx(gaps["mpeg4"], abs=0.0006)


@pytest.mark.parametrize(
    "inner",
    [
        '<gaze id="g" target="cup" influence="HEAD" start="0" ready="0.3" relax="1" end="1.4"/>',
        '<head id="n" lexeme="NOD" start="0" end="1"/>',
        f'<faceFacs id="f" au="61" side="BOTH" amount="0.6" {WHEN}/>',
    ],
    ids=["gaze", "nod", "eyes"],
)
def test_deformers_turn_gaze_and_head_equally(faces: dict[str, Face], inner: str) -> None:
    made = [
        deform(face, play(inner, name, scene={"cup": (0.4, -0.1, 0.6)}).poses) for name, face in faces.items()
    ]
    assert np.array_equal(made[0], made[1])
    assert np.abs(made[0] - made[0][0]).max() > 0.002


def test_deformers_do_not_change_fap_streams_and_files() -> None:
    one, other = (play(lexeme("SMILE") + SPEECH, name) for name in BOTH)
    assert np.array_equal(one.faps.values, other.faps.values)
    assert json.dumps(one.to_json()) == json.dumps(other.to_json())
    assert np.array_equal(one.poses, one.faps.values)
    assert other.poses.shape[1] > 68


def test_deformers_give_sessions_the_meshes_of_films(faces: dict[str, Face]) -> None:
    from realizer.face.surface import quantise

    face = faces["au"]
    player = Player(PlayOptions(idle=True, seed=3))
    window = FrameTimeline(player, 0, 25, lambda: face).window(0, 20)
    assert window.poses.shape == (window.end - window.first, len(face.inputs))
    meshes = quantise(face, deform(face, window.poses[:30]))
    for row in (0, 29, 7, 8):  # in any order
        assert np.array_equal(window.mesh(row), meshes[row])
    assert not np.array_equal(meshes[0], meshes[-1])


def test_deformer_of_a_session_is_the_service_s_setting(faces: dict[str, Face]) -> None:
    session = Session("s", Settings(deformer="au"), 0.0)
    assert session.faces.of(0).inputs == faces["au"].inputs
    assert Session("s", Settings(), 0.0).faces.of(0).inputs == faces["mpeg4"].inputs


@pytest.fixture(scope="module")
def renderers() -> Iterator[dict[str, Renderer]]:
    made = {name: Renderer("default", (160, 160), "close", deformer=name) for name in BOTH}
    yield made
    for renderer in made.values():
        renderer.close()


@pytest.mark.gl
@pytest.mark.parametrize(
    "inner",
    [facs(12), facs(43), lexeme("RAISE_BROWS"), facs(26)],
    ids=["smile", "closed", "brows", "jaw"],
)
@pytest.mark.slow
def test_deformers_change_the_picture_at_the_same_place(renderers: dict[str, Renderer], inner: str) -> None:
    places = []
    for name, renderer in renderers.items():
        still, shown = renderer.draw(play(inner, name).poses[[0, PEAK]]).astype(float).sum(axis=3)
        change = np.abs(shown - still)
        assert change.max() > 60
        change[change < 0.1 * change.max()] = 0
        places.append((np.arange(160) @ change.sum(axis=1)) / change.sum())
    assert abs(places[0] - places[1]) < 10, f"rows {places}"


@pytest.mark.gl
@pytest.mark.long
@pytest.mark.slow
def test_deformer_option_draws_a_still(renderers: dict[str, Renderer], tmp_path: Path) -> None:
    from PIL import Image

    out = tmp_path / "x.png"
    (tmp_path / "x.bml").write_text(f'<bml id="b">{facs(12)}</bml>')
    words = ["realize", str(tmp_path / "x.bml"), "-o", str(out), "--at", str(PEAK / 25)]
    words += ["--size", "160x160", "--camera", "close", "--no-idle", "--voice", "silent"]
    done = CliRunner().invoke(cli, [*words, "--deformer", "au"])
    assert done.exit_code == 0, done.output
    picture = np.asarray(Image.open(out))
    drawn = {name: one.draw(play(facs(12), name).poses[[PEAK]])[0] for name, one in renderers.items()}
    assert np.array_equal(picture, drawn["au"])
    assert not np.array_equal(picture, drawn["mpeg4"])


def test_deformer_is_a_setting() -> None:
    assert Settings.read(environment={"REALIZER_DEFORMER": "au"}).deformer == "au"
    assert Settings().deformer is None
    with pytest.raises(SettingsError, match="deformer: wanted mpeg4 or au, got 'bones'"):
        Settings(deformer="bones")
