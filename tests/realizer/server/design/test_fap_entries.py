"""Tests of `realizer.server.design.fap_entries`."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from realizer.animation.fap.fap_clip import FAPClip
from realizer.animation.fap.fap_reader import read_fap
from realizer.core.errors import RealizerError
from realizer.core.settings import Settings
from realizer.corpus.learn import features
from realizer.corpus.recording import Recording
from realizer.expressions.library import builtin
from realizer.expressions.timeline import Entry, Timeline, Track
from realizer.expressions.timeline_file import read_timeline
from realizer.outputs.fap_text import encode
from realizer.server.design.documents import export, open_file
from realizer.server.design.fap_entries import fap_entries, is_fap

SETTINGS = Settings(voice="silent")
LIBRARY = list(builtin().values())
TIMELINE = Timeline(
    (
        Track(
            "a", (Entry("RAISE_BROWS", 0.8, 1.2, 0.3, 0.5), Entry("neutral", duration=0.4), Entry("SMILE"))
        ),
        Track("b", (Entry("LOWER_MOUTH_CORNERS", 0.5, 1.0, 0.2, 0.3),), start=3.8),
    )
)


@pytest.fixture(scope="module")
def text() -> str:
    return export(TIMELINE, "fap", SETTINGS)


def millimetres(text: str) -> np.ndarray:
    return features(Recording("", faps=read_fap(text).values.astype(np.float64)))


def test_fap_entries_are_those_of_the_timeline_that_was_saved(text: str) -> None:
    entries, _ = fap_entries(text, LIBRARY)
    found = {entry.expression: (start, entry) for start, entry in entries if entry.intensity > 0.3}
    assert {*found} == {"RAISE_BROWS", "SMILE", "LOWER_MOUTH_CORNERS"}
    start, brows = found["RAISE_BROWS"]
    assert start == pytest.approx(0, abs=0.08)
    assert brows.intensity == pytest.approx(0.8, abs=0.05)
    assert brows.duration == pytest.approx(1.2, abs=0.12)
    assert found["SMILE"][0] == pytest.approx(1.6, abs=0.12)
    assert found["LOWER_MOUTH_CORNERS"][1].intensity == pytest.approx(0.5, abs=0.1)


def test_fap_file_opened_and_saved_moves_the_same(text: str) -> None:
    opened = open_file(text, SETTINGS)
    again = millimetres(export(read_timeline(json.dumps(opened.timeline).encode()), "fap", SETTINGS))
    before = millimetres(text)
    count = min(len(before), len(again))
    assert np.sum((before[:count] - again[:count]) ** 2) < 0.03 * np.sum(before**2)


def test_fap_entries_say_what_a_timeline_cannot_hold() -> None:
    values = np.zeros((50, 68), np.int32)
    values[:, 49] = 2000  # the head turns
    values[10:40, 16] = 900  # the upper lip alone goes out on one side, which no expression does
    visemes = np.zeros((50, 4), np.int32)
    visemes[5:9, 0] = 3
    mask = np.ones(68, bool)
    clip = FAPClip("odd", 25.0, values, mask, visemes, np.zeros((50, 6), np.int32))
    _, left = fap_entries(encode(clip), LIBRARY)
    assert any("visemes" in one for one in left)
    assert any("turns of the head" in one for one in left)
    assert any(one.endswith("in FAP 17") for one in left), left


def test_fap_entries_split_peaks_with_a_valley_between() -> None:
    smile = Entry("SMILE", 0.9, 1.0, 0.3, 0.3)
    twice = Timeline((Track("a", (smile, Entry("neutral", duration=0.04), smile)),))
    entries, _ = fap_entries(export(twice, "fap", SETTINGS), LIBRARY)
    assert len([entry for _, entry in entries if entry.expression == "SMILE" and entry.intensity > 0.5]) == 2


@given(st.lists(st.floats(0, 1), min_size=1, max_size=60))
@settings(max_examples=100)
def test_peaks_cover_every_frame_once(weights: list[float]) -> None:
    from realizer.server.design.fap_entries import _peaks

    ends = _peaks(np.array(weights))
    assert [k for begin, end in ends for k in range(begin, end)] == [*range(len(weights))]


@pytest.mark.parametrize("text", ["2.1 name 25 3\n", "# only a comment\n2.1 x 25 0"])
def test_fap_entries_want_frames(text: str) -> None:
    assert is_fap(text)
    with pytest.raises(RealizerError, match="wanted frames of FAPs, a mask and values each, got none"):
        fap_entries(text, LIBRARY)


def test_fap_entries_want_at_most_five_minutes() -> None:
    values, visemes, expressions = (np.zeros((400, width), np.int32) for width in (68, 4, 6))
    clip = FAPClip("long", 1.0, values, np.arange(68) > 1, visemes, expressions)
    with pytest.raises(RealizerError, match=r"wanted FAPs of at most 300 s, got 400\.0 s"):
        fap_entries(encode(clip), LIBRARY)


def test_timelines_are_no_fap_files() -> None:
    for form in ("toml", "json", "bml"):
        assert not is_fap(export(TIMELINE, form, SETTINGS) if form != "json" else '{"channel": []}')
    assert not is_fap("")
