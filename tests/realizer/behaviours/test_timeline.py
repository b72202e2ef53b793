"""Tests of timeline."""

import json
from pathlib import Path

import numpy as np
import pytest

from realizer.face.deform import deform
from realizer.face.load import load_face

SURPRISE = {"expression": "template:surprise", "duration": 1.0}
ANGER = {"expression": "template:anger", "duration": 1.0}


@pytest.fixture
def timeline(play, tmp_path: Path):
    """Play a timeline with these channels."""

    def run(*channels: dict, attributes: str = "", also: str = "", mixing: dict | None = None, **asked):
        (tmp_path / "t.json").write_text(json.dumps({"channel": list(channels)} | (mixing or {})), "utf-8")
        return play(f'<own:timeline id="t" fileName="t.json" {attributes}/>{also}', media=tmp_path, **asked)

    return run


def course(played, name: str) -> np.ndarray:
    names = played.realization.to_json()["au"]["names"]
    return played.realization.aus.before_rules[:, names.index(name)]


def test_timeline_moves_between_expressions_without_a_neutral_face(timeline) -> None:
    played = timeline({"entries": [SURPRISE, ANGER]})
    assert played.warnings == []
    assert played.times("t") == pytest.approx({"start": 0, "end": 2})
    brows, frown = course(played, "1L"), course(played, "4L")
    # Surprise starts to leave at 0.5, half a second before the border; anger is complete 0.3 s after it.
    assert brows[[0, 30, 50, 130, 200]] == pytest.approx([0, 0.9, 0.9, 0, 0], abs=1e-6)
    assert frown[[0, 50, 130, 150, 200]] == pytest.approx([0, 0, 1, 1, 0], abs=1e-6)
    # In between, both change linearly.
    assert brows[50:131] / 0.9 + frown[50:131] == pytest.approx(np.ones(81), abs=1e-5)
    assert brows[90] == pytest.approx(0.45, abs=1e-5)


@pytest.mark.parametrize(("joins", "leaves", "there"), [("onset", 100, 130), ("offset", 50, 100)])
def test_timeline_onset_or_offset_alone_leads_to_the_next_entry(timeline, joins, leaves, there) -> None:
    played = timeline({"joins": joins, "entries": [SURPRISE, ANGER]})
    brows, frown = course(played, "1L"), course(played, "4L")
    assert brows[leaves] == pytest.approx(0.9, abs=1e-5)
    assert brows[leaves + 2] < 0.9
    assert brows[there] == pytest.approx(0, abs=1e-5)
    assert frown[there] == pytest.approx(1, abs=1e-5)
    assert frown[there - 2] < 1
    # At both ends of the timeline, onset and offset are always used.
    assert brows[[0, 15, 30]] == pytest.approx([0, 0.45, 0.9], abs=1e-5)
    assert frown[[150, 175, 200]] == pytest.approx([1, 0.5, 0], abs=1e-5)


def test_timeline_neutral_entry_is_a_break(timeline) -> None:
    entries = [SURPRISE, {"expression": "neutral", "duration": 0.5}, ANGER]
    for joins in ("both", "onset", "offset"):
        played = timeline({"joins": joins, "entries": entries})
        shown = np.stack([course(played, name) for name in ("1L", "4L")])
        rested = np.flatnonzero(shown.max(axis=0) < 1e-6)
        assert ((rested > 50) & (rested < 200)).any(), joins
        assert np.abs(np.diff(shown)).max() < 0.05, joins


def test_timeline_smooth_joins_begin_and_end_softly(timeline) -> None:
    straight = course(timeline({"entries": [SURPRISE, ANGER]}), "4L")
    smooth = course(timeline({"curve": "smooth", "entries": [SURPRISE, ANGER]}), "4L")
    assert smooth[52] < straight[52]
    assert smooth[90] == pytest.approx(0.5, abs=1e-5)
    assert smooth[130] == pytest.approx(1, abs=1e-5)


def test_timeline_channels_play_together_and_the_stronger_shows(timeline) -> None:
    first = {"entries": [{"expression": "smile", "intensity": 0.5, "duration": 2.0}]}
    second = {"start": 0.5, "entries": [{"expression": "smile", "intensity": 1.0, "duration": 1.3}, SURPRISE]}
    played = timeline(first, second)
    mouth = course(played, "12L")
    assert mouth[45] == pytest.approx(0.5, abs=1e-5)
    assert mouth[98] == pytest.approx(1.0, abs=1e-2)
    assert course(played, "1L")[210] > 0.85
    assert played.times("t")["end"] == pytest.approx(2.8)


def test_timeline_stretches_as_a_whole(timeline) -> None:
    played = timeline({"entries": [SURPRISE, ANGER]}, attributes='start="1" end="5"')
    brows = course(played, "1L")
    assert brows[[100, 160, 200, 280]] == pytest.approx([0, 0.9, 0.9, 0.45], abs=1e-5)


def test_timeline_entry_shorter_than_onset_and_offset_has_a_short_apex(timeline) -> None:
    played = timeline({"entries": [{"expression": "template:anger", "duration": 0.4}]})
    frown = course(played, "4L")
    assert frown[15] == pytest.approx(1, abs=1e-5)
    assert frown[40] == 0


def test_timeline_can_be_tied_to_speech(timeline) -> None:
    played = timeline(
        {"entries": [SURPRISE]}, attributes='end="n:stroke"', also='<head id="n" lexeme="NOD"/>'
    )
    assert played.times("t")["end"] == pytest.approx(played.times("n")["stroke"])


@pytest.mark.parametrize(
    ("channel", "parts"),
    [
        (
            {"name": "brows", "entries": [{"expression": "smiel"}, {"expression": "angr"}]},
            ["channel brows, entry 1, expression: ", "did you mean SMILE", "channel brows, entry 2"],
        ),
        ({"entries": []}, ["'t.json': channel 1, entries: wanted a list"]),
        ({"entries": [{"expression": "smile", "intensity": 3}]}, ["channel 1, entry 1, intensity: wanted"]),
    ],
)
def test_timeline_faults_of_a_file_are_one_warning(timeline, channel, parts) -> None:
    played = timeline(channel)
    assert played.warnings == [("b:t", "CANNOT_CREATE_BEHAVIOR")]
    for part in parts:
        assert part in played.warnings_text


SNEER = {"entries": [{"expression": "template:disgust", "duration": 2.0}]}
GRIN = {"entries": [{"expression": "smile", "duration": 2.0}]}
AMAZED = {"entries": [{"expression": "template:surprise", "duration": 2.0}]}


def mixed(played, face, name: str) -> np.ndarray:
    return played.realization.poses[:, face.inputs.index(name)]


def test_timeline_mixer_and_order_reach_the_face(timeline) -> None:
    """The change is soft at both ends; in between the mixer works fully, in the file's order."""
    face = load_face(deformer="au")
    asked = {"mixer": "successive", "order": [26, 12, 1]}
    played = timeline(GRIN, AMAZED, mixing=asked, attributes='start="1" end="4"', deformer="au")
    assert played.warnings == []
    share = mixed(played, face, "successive")
    assert share[[100, 110, 120, 250, 380, 400]] == pytest.approx([0, 0.5, 1, 1, 1, 0], abs=1e-5)
    ranks = np.stack([mixed(played, face, f"rank {au}") for au in (26, 12, 1, 2)])[:, 101:400]
    assert (ranks[0] > ranks[1]).all()
    assert (ranks[1] > ranks[2]).all()
    assert (ranks[2] > ranks[3]).all()
    assert not ranks[3].any()


def test_timeline_mixers_and_orders_give_different_faces(timeline) -> None:
    """Wojdel's figures 5.1 and 5.2; before and after the timeline, units are added up."""
    face = load_face(deformer="au")

    def shown(**mixing) -> np.ndarray:
        played = timeline(GRIN, SNEER, mixing=mixing, deformer="au")
        return np.asarray(deform(face, played.realization.poses[[0, 100]]))

    summed, first = shown(mixer="additive"), shown(mixer="successive", order=[12])
    last = shown(mixer="successive", order=[9, 6, 12])
    assert np.array_equal(summed, shown())
    assert np.array_equal(summed[0], first[0])
    for one, other in ((summed, first), (summed, last), (first, last)):
        assert np.linalg.norm(one[1] - other[1], axis=1).max() > 5e-4


def test_timeline_warns_of_mixing_that_the_face_cannot_do(timeline) -> None:
    played = timeline(GRIN, mixing={"mixer": "successive"}, deformer="mpeg4")
    assert played.warnings == [("b:t", "CUSTOM_ATTRIBUTE_NOT_SUPPORTED")]
    assert "fileName: 't.json': mixer: no effect, FAPs move this face; wanted" in played.warnings_text
    assert course(played, "12L").max() > 0.8
    played = timeline(GRIN, mixing={"order": [12]}, deformer="au")
    assert "order: no effect, a sum has no order" in played.warnings_text


def test_timeline_orders_of_two_at_once_are_kept(play, tmp_path: Path) -> None:
    face = load_face(deformer="au")
    for name, order in (("a", [4, 12, 1]), ("b", [4, 1, 12])):
        content = {"mixer": "successive", "order": order, "channel": [GRIN]}
        (tmp_path / f"{name}.json").write_text(json.dumps(content), "utf-8")
    nodes = "".join(f'<own:timeline id="{name}" fileName="{name}.json"/>' for name in "ab")
    played = play(nodes, media=tmp_path, deformer="au")
    values = [mixed(played, face, name)[100] for name in ("successive", "rank 4", "rank 12", "rank 1")]
    assert values == pytest.approx([1, 1, 0.5, 0.5])


@pytest.mark.parametrize(
    "mixing", [{"mixer": "sum"}, {"order": [51]}, {"mixer": "successive", "order": [1, 1]}]
)
def test_timeline_refuses_an_unknown_mixer_or_order(timeline, mixing) -> None:
    played = timeline(GRIN, mixing=mixing)
    assert played.warnings == [("b:t", "CANNOT_CREATE_BEHAVIOR")]
    assert "'t.json': timeline, " in played.warnings_text
