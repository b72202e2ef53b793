"""Tests of `realizer_studio.editors.design.fap_entries`."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from realizer.animation.fap.fap_clip import FAPClip
from realizer.animation.fap.fap_reader import read_fap
from realizer.core.errors import RealizerError
from realizer.core.settings import Settings
from realizer.expressions.library import builtin
from realizer.expressions.timeline import Entry, Timeline, Track
from realizer.expressions.timeline_file import read_timeline, write_timeline
from realizer.outputs.fap_text import encode
from realizer.tables import faps
from realizer_studio.corpus.face_map import features
from realizer_studio.corpus.recording import Recording
from realizer_studio.editors.design.documents import export, open_file
from realizer_studio.editors.design.fap_entries import fap_entries, is_fap

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


def faps_of(timeline: Timeline, fps: float, count: int) -> np.ndarray:
    """What the timeline plays on a face without idle motion, (count, 68) integers."""
    settings = replace(SETTINGS, idle=False, fps=fps)
    values = read_fap(export(timeline, "fap", settings)).values
    return np.concatenate([values, np.zeros((count, 68), np.int32)])[:count]


def millimetres(text: str) -> np.ndarray:
    return features(Recording("", faps=read_fap(text).values.astype(np.float64)))


def test_fap_entries_are_those_of_the_timeline_that_was_saved(text: str) -> None:
    entries, _, _ = fap_entries(text, LIBRARY)
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


@pytest.mark.parametrize("fps", [25.0, 30.0])
def test_fap_file_that_no_expression_resembles_is_kept_to_the_bit(fps: float) -> None:
    low, high = (np.array([getattr(row, name) for row in faps()]) for name in ("least", "most"))
    chance = np.random.default_rng(1)
    values = chance.integers(np.maximum(low, -300), np.minimum(high, 300) + 1, (80, 68)).astype(np.int32)
    values[:7] = values[30:41] = values[:, :2] = 0
    mask = np.arange(68) > 1
    clip = FAPClip("odd", fps, values, mask, np.zeros((80, 4), np.int32), np.zeros((80, 6), np.int32))
    opened = open_file(encode(clip), SETTINGS)
    assert opened.left_out == []
    timeline = read_timeline(json.dumps(opened.timeline).encode())
    assert read_timeline(write_timeline(timeline).encode()) == timeline
    played = faps_of(timeline, fps, 80)
    assert np.array_equal(played, values)
    again = open_file(export(timeline, "bml", SETTINGS), SETTINGS)
    reread = read_timeline(json.dumps(again.timeline).encode())
    first, second = ([one.keys for one in file.tracks[0].entries] for file in (timeline, reread))
    assert first == second


def test_fap_entries_keep_visemes_and_turns_of_the_head_as_keyframes() -> None:
    values = np.zeros((50, 68), np.int32)
    values[10:40, 49] = 2000  # the head turns
    visemes = np.zeros((50, 4), np.int32)
    visemes[15:19] = 3, 0, 63, 0
    mask = np.isin(np.arange(68), [0, 49])
    clip = FAPClip("odd", 25.0, values, mask, visemes, np.zeros((50, 6), np.int32))
    entries, [(start, kept)], notes = fap_entries(encode(clip), LIBRARY)
    assert entries == []
    assert (start, kept.duration) == (0.36, 1.24)
    assert 50 in kept.faps
    assert len(kept.faps) > 3
    assert any("visemes" in one for one in notes)


def test_fap_entries_split_peaks_with_a_valley_between() -> None:
    smile = Entry("SMILE", 0.9, 1.0, 0.3, 0.3)
    twice = Timeline((Track("a", (smile, Entry("neutral", duration=0.04), smile)),))
    entries, _, _ = fap_entries(export(twice, "fap", SETTINGS), LIBRARY)
    assert len([entry for _, entry in entries if entry.expression == "SMILE" and entry.intensity > 0.5]) == 2


@given(st.lists(st.floats(0, 1), min_size=1, max_size=60))
@settings(max_examples=100)
def test_peaks_cover_every_frame_once(weights: list[float]) -> None:
    from realizer_studio.editors.design.fap_entries import _peaks

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
