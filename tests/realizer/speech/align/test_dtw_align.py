"""Alignment by a voice that speaks the same text."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.speech.align.dtw_align import Spans, dtw_align
from realizer.speech.align.recording import mono, to_aligner
from realizer.speech.espeak.voice import EspeakVoice
from realizer.speech.utterance import SpeechRequest
from tests.realizer.speech.align.conftest import TEXT, WRONG, Noisy

pytestmark = pytest.mark.espeak


def spans_of(recording: Noisy, pcm: np.ndarray, *references: object) -> Spans:
    return dtw_align(to_aligner(mono(pcm, recording.rate), recording.rate), references)  # type: ignore[arg-type]


def test_dtw_align_finds_words_and_phonemes(voice: EspeakVoice, sentence: Noisy) -> None:
    reference = voice.say(SpeechRequest(TEXT))
    found = spans_of(sentence, sentence.pcm, reference)
    assert np.median(np.abs(found.words[:, 0] - sentence.onsets)) < 0.02
    assert found.phonemes.shape == (len(reference.phonemes), 2)
    pauses = [not phoneme.ipa for phoneme in reference.phonemes]
    assert (np.isnan(found.phonemes).all(axis=1) == pauses).all()
    assert found.costs.shape == (len(reference.words),)
    assert found.cost < 0.9


def test_dtw_align_chooses_the_most_similar_voice(voice: EspeakVoice, sentence: Noisy) -> None:
    others = [voice.say(SpeechRequest(TEXT, voice=name)) for name in ("en-us+f3", "en-us+m7")]
    assert spans_of(sentence, sentence.pcm, *others).reference is others[1]


def test_dtw_align_costs_more_for_a_wrong_text(voice: EspeakVoice, sentence: Noisy) -> None:
    right, wrong = (
        spans_of(sentence, sentence.pcm, voice.say(SpeechRequest(text))) for text in (TEXT, WRONG)
    )
    assert right.cost < 0.9 < wrong.cost


def test_dtw_align_puts_unexpected_pauses_between_words(voice: EspeakVoice, sentence: Noisy) -> None:
    cut = round(sentence.onsets[3] * sentence.rate)
    noise = sentence.pcm[: sentence.rate // 2]
    pcm = np.concatenate([sentence.pcm[:cut], np.tile(noise, 4), sentence.pcm[cut:]])
    onsets = sentence.onsets + 2.0 * (np.arange(len(sentence.onsets)) >= 3)
    found = spans_of(sentence, pcm, voice.say(SpeechRequest(TEXT)))
    assert np.abs(found.words[:, 0] - onsets).max() < 0.1
    assert found.words[2, 1] < onsets[3] - 1.8


def test_dtw_align_measures_the_pace(voice: EspeakVoice) -> None:
    slow, fast = (voice.say(SpeechRequest(TEXT, rate=rate)) for rate in (1.0, 1.5))
    assert slow.pcm is not None
    sound = to_aligner(mono(slow.pcm, slow.sample_rate), slow.sample_rate)
    assert dtw_align(sound, [fast]).pace < 0.85 < dtw_align(sound, [slow]).pace
