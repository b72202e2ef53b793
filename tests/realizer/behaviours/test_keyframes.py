"""Tests of facekeyframe."""

import re
from itertools import pairwise

import numpy as np
import pytest

from realizer.animation.fap.fap_clip import FAPClip
from realizer.behaviours.keyframes import document_of
from realizer.core.errors import RealizerError
from realizer.offline import realize


def keyframe(type: str, parts: str, keys: str, sync: str = "") -> str:
    return (
        f'<bmlt:facekeyframe id="k" type="{type}" {sync}>'
        f'<bmlt:FaceInterpolator parts="{parts}">{keys}</bmlt:FaceInterpolator></bmlt:facekeyframe>'
    )


KEYS = "\n0 0 0\n0.5 100 -50\n2 0 0\n"


def test_keyframes_of_faps_are_reached(play) -> None:
    played = play(keyframe("FAPS", "31 5", KEYS, 'start="1"'))
    assert played.warnings == []
    assert played.times("k") == {"start": 1, "end": 3}
    assert [played.fap(31, t) for t in (1, 1.25, 1.5, 2.25, 3)] == pytest.approx([0, 50, 100, 50, 0])
    assert [played.fap(5, t) for t in (1, 1.25, 1.5, 2.25, 3)] == pytest.approx([0, -25, -50, -25, 0])


def test_keyframes_begin_at_start_and_stretch_to_end(play) -> None:
    played = play(keyframe("FAPS", "31", "10 0\n11 100\n12 0", 'start="1" end="5"'))
    assert [played.fap(31, t) for t in (1, 2, 3, 4, 5)] == pytest.approx([0, 50, 100, 50, 0])


def test_keyframes_of_action_units_have_sides(play) -> None:
    played = play(keyframe("FACS", "1.BOTH 12.LEFT 26 4.right", "0 0 0 0 0\n1 0.5 1 0.25 0.75\n2 0 0 0 0"))
    assert played.warnings == []
    assert played.aus(1.0) == {"1L": 0.5, "1R": 0.5, "4R": 0.75, "12L": 1.0, "26": 0.25}
    assert played.aus(0.5)["12L"] == pytest.approx(0.5)
    assert played.aus(2.0) == {}


@pytest.mark.slow
def test_keyframes_that_are_not_at_rest_are_eased(play) -> None:
    played = play(keyframe("FACS", "12.BOTH", "0 1\n2 1"))
    times = [t / 100 for t in (*range(21), *range(40, 180, 20), *range(179, 201))]
    course = [played.aus(t).get("12L", 0) for t in times]
    assert course[0] == course[-1] == 0
    assert max(abs(b - a) for a, b in pairwise(course)) < 0.1
    assert course[20:-21] == [1] * 9


@pytest.mark.parametrize(
    ("element", "says"),
    [
        (keyframe("MORPH", "smile", "0 0\n1 7"), "line 2 of the keys: wanted morphs 0..1, got '1 7'"),
        ('<bmlt:facekeyframe id="k"/>', "names of morphs such as"),
        ('<bmlt:facekeyframe id="k" type="FAPS"/>', "FaceInterpolator"),
        (keyframe("FAPS", "31 99", KEYS), "FAP numbers 3..68 such as"),
        (keyframe("FAPS", "1 31", KEYS), "got '1'"),
        (keyframe("FAPS", "31.BOTH", "0 0\n1 1"), "got '31.BOTH'"),
        (keyframe("FACS", "3", "0 0\n1 1"), "action units such as"),
        (keyframe("FACS", "12.UP", "0 0\n1 1"), "got '12.UP'"),
        (keyframe("FACS", "12 12.BOTH", KEYS), "got '12.BOTH' twice"),
        (
            keyframe("FAPS", "31 5", "\n0 0 0\n\n1 100\n"),
            "line 2 of the keys: wanted a time and 2 values, got '1 100'",
        ),
        (
            keyframe("FAPS", "31", "0 0\n1 nan\n"),
            "line 2 of the keys: wanted a time and 1 value, got '1 nan'",
        ),
        (keyframe("FAPS", "31", "0 0\n1 1e9\n"), "line 2 of the keys: wanted numbers within a million"),
        (keyframe("FAPS", "31", "0 0\n1 5\n1 7\n"), "line 3 of the keys: wanted a time after 1, got 1"),
        (keyframe("FACS", "12", "0 0\n1 100\n"), "line 2 of the keys: wanted action units 0..1, got '1 100'"),
        (keyframe("FAPS", "31", "0 5"), "wanted at least two lines, got 1"),
        (keyframe("FAPS", "31", ""), "wanted at least two lines, got 0"),
    ],
)
def test_keyframes_that_cannot_be_read_are_dropped(play, element: str, says: str) -> None:
    played = play(element + '<head id="h" lexeme="NOD"/>')
    assert played.warnings == [("b:k", "CANNOT_CREATE_BEHAVIOR")]
    assert says in played.warnings_text
    assert played.times("h")


@pytest.mark.parametrize("morph", ["mouthSmileLeft", "mouth_smile_left", "AU12_L", "au12L"])
def test_keyframes_of_morphs_move_what_their_names_say(play, morph: str) -> None:
    played = play(keyframe("MORPH", morph, "0 0\n1 1\n2 0"))
    assert not played.warnings
    moved = played.aus(1.0)
    assert moved["12L"] > 0.5
    assert not moved.get("12R")


def test_keyframes_of_unknown_morphs_are_named(play) -> None:
    played = play(keyframe("MORPH", "smile Body_Shape_7", "0 0 0\n1 1 1\n2 0 0"))
    assert played.warnings == [("b:k", "CUSTOM_ATTRIBUTE_NOT_SUPPORTED")]
    assert "got Body_Shape_7; they do not move" in played.warnings_text
    assert played.aus(1.0)["12L"] > 0.5


def test_keyframes_of_faps_beyond_their_range_are_limited_with_a_warning(play) -> None:
    played = play(keyframe("FAPS", "19", "0 0\n1 3000\n2 0"))
    assert played.warnings == [("b:k", "CUSTOM_ATTRIBUTE_NOT_SUPPORTED")]
    assert played.fap(19, 1.0) == 1080


def clip(values: np.ndarray, *used: int, fps: float = 25) -> FAPClip:
    count = len(values)
    all_values = np.zeros((count, 68), np.int32)
    all_values[:, [fap - 1 for fap in used]] = values
    mask = np.isin(np.arange(1, 69), used)
    return FAPClip("x", fps, all_values, mask, np.zeros((count, 4), np.int32), np.zeros((count, 6), np.int32))


@pytest.mark.parametrize("fps", [2, 12.5, 25, 30, 29.97])
def test_document_of_a_clip_plays_it_at_its_rate(fps: float) -> None:
    course = np.round(300 * np.sin(np.linspace(0, np.pi, 31)))
    played = realize(document_of(clip(course[:, None], 3, fps=fps), "b"), fps=fps, idle=False)
    assert played.warnings == ()
    assert played.schedules[0].at("fap", "end") == pytest.approx(30 / fps, abs=1e-3)
    np.testing.assert_allclose(played.faps.values[:31, 2], course, atol=2)


def test_document_of_a_clip_holds_its_faps_of_0() -> None:
    document = document_of(clip(np.zeros((50, 1)), 12), "b")
    smile = '<bml id="s"><faceLexeme id="l" lexeme="SMILE" start="0" end="1.9"/></bml>'
    played = realize([smile, document], idle=False)
    assert played.faps.values[25, 11] == 0
    assert played.faps.values[25, 12] > 20


def test_document_of_a_clip_limits_values_without_a_warning() -> None:
    played = realize(document_of(clip(np.full((50, 1), 99_999), 3), "b"), idle=False)
    assert played.warnings == ()
    assert played.faps.values[25, 2] == 4320


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (clip(np.zeros((1, 1)), 3), "wanted at least two frames of a FAP from 3 on, got 1 frames of 1 FAPs"),
        (clip(np.zeros((5, 0))), "got 5 frames of 0 FAPs"),
    ],
)
def test_document_of_an_empty_clip_is_refused(given: FAPClip, says: str) -> None:
    with pytest.raises(RealizerError, match=re.escape(says)):
        document_of(given, "b")
