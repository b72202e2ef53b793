"""Tests of `realizer_studio.corpus.finder`."""

import numpy as np

from realizer_studio.corpus.face_map import learn
from realizer_studio.corpus.finder import agreement, find, segments
from realizer_studio.corpus.recording import Segment
from tests.realizer_studio.corpus.test_face_map import acted


def shown(text: str) -> np.ndarray:
    return np.array([sign == "x" for sign in text])


def test_segments_fill_gaps_drop_short_ones_and_join_near_ones() -> None:
    assert segments(shown("..xxx.xx....")) == [(2, 7)]
    assert segments(shown("..xxx..xx...")) == []
    assert segments(shown("xxxxx" + "." * 11 + "xxxxx")) == [(0, 20)]
    assert segments(shown("xxxxx" + "." * 12 + "xxxxx")) == [(0, 4), (17, 21)]
    assert segments(shown("....")) == []


def test_find_agrees_with_labels_as_much_as_hers() -> None:
    """7.4: 86.3 % of frames and 77.7 % of segments, on recordings that the map has not seen."""
    learnt = learn([acted(1), acted(2)])
    for seed in (3, 4):
        recording = acted(seed)
        frames, met = agreement(recording.segments(), find(recording, learnt), recording.frames)
        assert frames > 0.863
        assert met > 0.777


def test_find_needs_no_labels() -> None:
    recording = acted(3)
    found = find(recording, learn([acted(1, labelled=False), acted(2, labelled=False)]))
    frames, met = agreement(recording.segments(), found, recording.frames)
    assert frames > 0.7
    assert met > 0.4
    assert all(len(segment) >= 5 and segment.by == "map" for segment in found)


def test_agreement_counts_frames_and_segments() -> None:
    true = [Segment(0, 9, "a"), Segment(5, 14, "b")]
    assert agreement(true, true, 20) == (1, 1)
    assert agreement(true, [Segment(0, 4, "a"), Segment(10, 12, "c")], 20) == (0.5, 0.5)
    assert agreement([], [], 10) == (1, 0)
