"""Tests of utterances on the session clock."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.playback.scheduled_speech import CUT, ScheduledSpeech, render_utterance, resample
from realizer.server.streams.audio_stream import PACKET
from realizer.speech.utterance import Utterance, Word

SPOKEN = Utterance(1.0, (Word(0.0, 0.4, "Five"), Word(0.5, 1.0, "six")), (), {})


@pytest.mark.parametrize(
    ("until", "now", "words", "is_complete"),
    [
        (float("inf"), 2.0, [], False),
        (float("inf"), 2.4, ["Five"], False),
        (float("inf"), 3.0, ["Five", "six"], True),
        (2.5, 9.0, ["Five"], False),
        (3.0, 9.0, ["Five", "six"], True),
    ],
)
def test_words_have_been_heard_completely(
    until: float, now: float, words: list[str], is_complete: bool
) -> None:
    speech = ScheduledSpeech(2.0, until, SPOKEN, 0)
    assert speech.words(now) == words
    assert speech.is_complete(now) is is_complete


def test_is_heard_unless_cut_off_before_the_start() -> None:
    assert [ScheduledSpeech(2.0, until, SPOKEN, 0).is_heard for until in (1.9, 2.0, 2.1)] == [
        False,
        False,
        True,
    ]


TONE = Utterance(1.0, (), (), {}, 8000, np.full(8000, 1000, np.int16))
FOREVER = float("inf")


@pytest.mark.parametrize("rate", [4000, 8000, 16000])
def test_render_utterance_is_complete_at_any_rate(rate: int) -> None:
    sound = render_utterance(ScheduledSpeech(2.0, FOREVER, TONE, 0), rate)
    assert sound.dtype == np.float32
    assert len(sound) == rate
    assert sound[10:-10] == pytest.approx(1000)


def test_render_utterance_fades_when_cut_off() -> None:
    sound = render_utterance(ScheduledSpeech(2.0, 2.5, TONE, 0), 8000)
    assert len(sound) == round((0.5 + CUT) * 8000) <= 0.55 * 8000 - PACKET / 2 * 8000
    assert sound[3999] == 1000
    assert (np.diff(sound[4000:]) < 0).all()
    assert sound[-1] == 0


def test_render_utterance_cut_off_before_its_start_is_silent() -> None:
    assert len(render_utterance(ScheduledSpeech(2.0, 1.5, TONE, 0), 8000)) == 0


def test_resample_to_a_lower_rate_does_not_alias_high_tones() -> None:
    high = (1000 * (-1) ** np.arange(800)).astype(np.int16)
    assert np.abs(resample(high, 8000, 4000)[2:-2]).max() < 1
    assert np.array_equal(resample(high, 8000, 8000), high)


def test_resample_of_no_samples_is_empty() -> None:
    assert resample(np.zeros(0, np.int16), 22050, 8000).tolist() == []
