"""Tests of the rendering of utterances."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.playback.audio_mix import CUT, render_utterance, resample
from realizer.playback.scheduled_speech import ScheduledSpeech
from realizer.server.streams.audio_stream import PACKET
from realizer.speech.utterance import Utterance

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
