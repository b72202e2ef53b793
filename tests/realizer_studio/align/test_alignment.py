"""The result of aligners."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.speech.utterance import Phoneme, Utterance, Word
from realizer_studio.align.alignment import MIN_PAUSE, Alignment, build, moved, probability

SECONDS = st.floats(-1.0, 4.0)


def reference(count: int) -> Utterance:
    words = tuple(Word(float(k), k + 1.0, f"w{k}") for k in range(count))
    phonemes = tuple(Phoneme(float(k), k + 1.0, "a", k % 3) for k in range(count))
    return Utterance(float(count), words, phonemes, {})


def assert_covers(found: Alignment) -> None:
    assert found.phonemes[0].start == 0
    assert found.phonemes[-1].end == found.duration
    assert all(a.end == b.start for a, b in zip(found.phonemes, found.phonemes[1:], strict=False))
    assert all(p.end > p.start for p in found.phonemes)
    assert len(found.phoneme_confidences) == len(found.phonemes)


@given(st.lists(st.tuples(SECONDS, SECONDS), min_size=1, max_size=6))
def test_moved_covers_the_recording_in_order(spans: list[tuple[float, float]]) -> None:
    times = np.array(spans)
    each = [0.5] * len(spans)
    found = moved("espeak", reference(len(spans)), 3.0, times, times, each, 0.7)
    assert_covers(found)
    ends = [time for word in found.words for time in (word.start, word.end)]
    assert ends == sorted(ends)
    assert 0 <= ends[0] <= ends[-1] <= 3.0


def test_moved_keeps_texts_stress_and_confidences() -> None:
    times = np.array([[0.5, 1.0], [1.5, 2.0]])
    found = moved("espeak", reference(2), 3.0, times, times, [0.2, 0.9], 0.7)
    assert found.words == (Word(0.5, 1.0, "w0"), Word(1.5, 2.0, "w1"))
    assert [(p.ipa, p.stress) for p in found.phonemes] == [("", 0), ("a", 0), ("", 0), ("a", 1), ("", 0)]
    assert found.phoneme_confidences == (1.0, 0.2, 1.0, 0.9, 1.0)
    assert (found.confidences, found.confidence, found.aligner) == ((0.2, 0.9), 0.7, "espeak")


def test_build_adds_short_gaps_to_the_sound_before() -> None:
    gap = MIN_PAUSE / 2
    sounds = [Phoneme(0.0, 0.5, "a"), Phoneme(0.5 + gap, 1.0, "b")]
    found = build("x", reference(1), 1.0, np.array([[0.0, 1.0]]), (sounds, [0, 0]), [1.0], 1.0)
    assert [(p.ipa, p.start, p.end) for p in found.phonemes] == [("a", 0.0, 0.5 + gap), ("b", 0.5 + gap, 1.0)]


def test_build_of_no_sounds_is_a_pause() -> None:
    found = build("x", reference(1), 1.0, np.full((1, 2), np.nan), ([], []), [0.0], 0.0)
    assert found.phonemes == (Phoneme(0.0, 1.0, ""),)
    assert found.words == (Word(0.0, 0.0, "w0"),)


@given(st.floats(-1e6, 1e6), st.floats(-10, 10), st.floats(0.01, 10))
def test_probability_is_a_logistic_curve(value: float, middle: float, width: float) -> None:
    assert probability(middle, (middle, width)) == 0.5
    rising, falling = probability(value, (middle, width)), probability(value, (middle, -width))
    assert 0 <= rising <= 1
    assert rising + falling == pytest.approx(1.0)
    assert (rising >= 0.5) == (value >= middle)
