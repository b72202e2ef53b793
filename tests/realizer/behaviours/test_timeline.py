"""Timelines: channels of expressions that grow out of each other, in documents."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

SURPRISE = {"expression": "template:surprise", "duration": 1.0}
ANGER = {"expression": "template:anger", "duration": 1.0}


@pytest.fixture
def timeline(play, tmp_path: Path):
    """Plays a timeline with these channels."""

    def run(*channels: dict, attributes: str = "", also: str = ""):
        (tmp_path / "t.json").write_text(json.dumps({"channel": list(channels)}), "utf-8")
        return play(f'<own:timeline id="t" fileName="t.json" {attributes}/>{also}', media=tmp_path)

    return run


def course(played, name: str) -> np.ndarray:
    names = played.realization.to_json()["au"]["names"]
    return played.realization.aus.asked[:, names.index(name)]


def test_an_expression_grows_out_of_the_one_before_without_a_neutral_face(timeline) -> None:
    played = timeline({"entries": [SURPRISE, ANGER]})
    assert played.warnings == []
    assert played.times("t") == pytest.approx({"start": 0, "end": 2})
    brows, frown = course(played, "1L"), course(played, "4L")
    # Surprise leaves at 0.5, half a second before the border; anger is whole 0.3 s behind it.
    assert brows[[0, 30, 50, 130, 200]] == pytest.approx([0, 0.9, 0.9, 0, 0], abs=1e-6)
    assert frown[[0, 50, 130, 150, 200]] == pytest.approx([0, 0, 1, 1, 0], abs=1e-6)
    # Between, one comes as the other goes, in a straight line.
    assert brows[50:131] / 0.9 + frown[50:131] == pytest.approx(np.ones(81), abs=1e-5)
    assert brows[90] == pytest.approx(0.45, abs=1e-5)


@pytest.mark.parametrize(("joins", "leaves", "there"), [("onset", 100, 130), ("offset", 50, 100)])
def test_onset_or_offset_alone_may_lead_from_one_to_the_next(timeline, joins, leaves, there) -> None:
    played = timeline({"joins": joins, "entries": [SURPRISE, ANGER]})
    brows, frown = course(played, "1L"), course(played, "4L")
    assert brows[leaves] == pytest.approx(0.9, abs=1e-5)
    assert brows[leaves + 2] < 0.9
    assert brows[there] == pytest.approx(0, abs=1e-5)
    assert frown[there] == pytest.approx(1, abs=1e-5)
    assert frown[there - 2] < 1
    # At the very ends onset and offset count whatever leads between.
    assert brows[[0, 15, 30]] == pytest.approx([0, 0.45, 0.9], abs=1e-5)
    assert frown[[150, 175, 200]] == pytest.approx([1, 0.5, 0], abs=1e-5)


def test_a_neutral_entry_is_a_break(timeline) -> None:
    entries = [SURPRISE, {"expression": "neutral", "duration": 0.5}, ANGER]
    for joins in ("both", "onset", "offset"):
        played = timeline({"joins": joins, "entries": entries})
        shown = np.stack([course(played, name) for name in ("1L", "4L")])
        rested = np.flatnonzero(shown.max(axis=0) < 1e-6)
        assert ((rested > 50) & (rested < 200)).any(), joins
        assert np.abs(np.diff(shown)).max() < 0.05, joins


def test_smooth_joins_begin_and_end_softly(timeline) -> None:
    straight = course(timeline({"entries": [SURPRISE, ANGER]}), "4L")
    smooth = course(timeline({"curve": "smooth", "entries": [SURPRISE, ANGER]}), "4L")
    assert smooth[52] < straight[52]
    assert smooth[90] == pytest.approx(0.5, abs=1e-5)
    assert smooth[130] == pytest.approx(1, abs=1e-5)


def test_channels_play_together_and_the_stronger_of_two_shows(timeline) -> None:
    first = {"entries": [{"expression": "smile", "intensity": 0.5, "duration": 2.0}]}
    second = {"start": 0.5, "entries": [{"expression": "smile", "intensity": 1.0, "duration": 1.3}, SURPRISE]}
    played = timeline(first, second)
    mouth = course(played, "12L")
    assert mouth[45] == pytest.approx(0.425, abs=1e-5)
    assert mouth[98] == pytest.approx(0.85, abs=1e-2)
    assert course(played, "1L")[210] > 0.85
    assert played.times("t")["end"] == pytest.approx(2.8)


def test_it_stretches_as_a_whole(timeline) -> None:
    played = timeline({"entries": [SURPRISE, ANGER]}, attributes='start="1" end="5"')
    brows = course(played, "1L")
    assert brows[[100, 160, 200, 280]] == pytest.approx([0, 0.9, 0.9, 0.45], abs=1e-5)


def test_an_entry_too_short_for_its_onset_and_offset_is_whole_for_an_instant(timeline) -> None:
    played = timeline({"entries": [{"expression": "template:anger", "duration": 0.4}]})
    frown = course(played, "4L")
    assert frown[15] == pytest.approx(1, abs=1e-5)
    assert frown[40] == 0


def test_it_can_be_tied_to_what_is_said(timeline) -> None:
    played = timeline(
        {"entries": [SURPRISE]}, attributes='end="n:stroke"', also='<head id="n" lexeme="NOD"/>'
    )
    assert played.times("t")["end"] == pytest.approx(played.times("n")["stroke"])


@pytest.mark.parametrize(
    ("channel", "told"),
    [
        (
            {"name": "brows", "entries": [{"expression": "smiel"}, {"expression": "angr"}]},
            ["channel brows, entry 1, expression: ", "did you mean SMILE", "channel brows, entry 2"],
        ),
        ({"entries": []}, ["'t.json': channel 1, entries: wanted a list"]),
        ({"entries": [{"expression": "smile", "intensity": 3}]}, ["channel 1, entry 1, intensity: wanted"]),
    ],
)
def test_every_fault_of_a_file_is_told_in_one_warning(timeline, channel, told) -> None:
    played = timeline(channel)
    assert played.warnings == [("b:t", "CANNOT_CREATE_BEHAVIOR")]
    for part in told:
        assert part in played.told
