"""Alignment by a voice that speaks the same text."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.speech.espeak.voice import EspeakVoice
from realizer.speech.utterance import SpeechRequest, Utterance
from realizer_studio.align.alignment import Alignment
from realizer_studio.align.dtw import States
from realizer_studio.align.dtw_align import _adaptation, dtw_align
from realizer_studio.align.features import mono, to_aligner
from tests.realizer_studio.align.conftest import TEXT, WRONG, Noisy

pytestmark = pytest.mark.espeak


def aligned(recording: Noisy, pcm: np.ndarray, *references: Utterance) -> Alignment:
    sound = to_aligner(mono(pcm, recording.rate), recording.rate)
    return dtw_align(sound, len(pcm) / recording.rate, references)


def starts(found: Alignment) -> np.ndarray:
    return np.array([word.start for word in found.words])


def test_dtw_align_finds_words_and_phonemes(voice: EspeakVoice, sentence: Noisy) -> None:
    reference = voice.say(SpeechRequest(TEXT))
    found = aligned(sentence, sentence.pcm, reference)
    assert np.median(np.abs(starts(found) - sentence.onsets)) < 0.02
    assert [p.ipa for p in found.phonemes if p.ipa] == [p.ipa for p in reference.phonemes if p.ipa]
    assert len(found.confidences) == len(reference.words)
    assert found.confidence > 0.9


def test_dtw_align_chooses_the_most_similar_voice(voice: EspeakVoice, sentence: Noisy) -> None:
    others = [voice.say(SpeechRequest(TEXT, voice=name)) for name in ("en-us+f3", "en-us+m7")]
    assert aligned(sentence, sentence.pcm, *others) == aligned(sentence, sentence.pcm, others[1])


def test_dtw_align_is_less_sure_of_a_wrong_text(voice: EspeakVoice, sentence: Noisy) -> None:
    right, wrong = (aligned(sentence, sentence.pcm, voice.say(SpeechRequest(text))) for text in (TEXT, WRONG))
    assert right.confidence > 0.9 > 0.5 > wrong.confidence


def test_dtw_align_puts_unexpected_pauses_between_words(voice: EspeakVoice, sentence: Noisy) -> None:
    cut = round(sentence.onsets[3] * sentence.rate)
    noise = sentence.pcm[: sentence.rate // 2]
    pcm = np.concatenate([sentence.pcm[:cut], np.tile(noise, 4), sentence.pcm[cut:]])
    onsets = sentence.onsets + 2.0 * (np.arange(len(sentence.onsets)) >= 3)
    found = aligned(sentence, pcm, voice.say(SpeechRequest(TEXT)))
    assert np.abs(starts(found) - onsets).max() < 0.1
    assert found.words[2].end < onsets[3] - 1.8


@given(st.integers(1, 60), st.floats(-2, 2))
def test_adaptation_is_nearly_the_identity_unless_much_speech_differs(frames: int, off: float) -> None:
    ours = np.random.default_rng(frames).normal(size=(frames + 1, 4))
    pause = np.arange(frames + 1) == 0
    states = States(ours, pause, np.arange(frames + 1) * 0.02)
    same = np.eye(5)[:, :4]
    assert _adaptation(ours, states, np.arange(frames + 1)) == pytest.approx(same, abs=1e-9)
    way = np.repeat(np.arange(1, frames + 1), 400)
    likened = np.hstack([ours, np.ones((frames + 1, 1))]) @ _adaptation(ours[way] + off, states, way)
    assert likened[1:] == pytest.approx(ours[1:] + off, abs=0.15 * abs(off) + 1e-9)
    few = _adaptation(ours[:2] + off, states, np.array([0, 1]))
    assert np.abs(few - same).max() < abs(off) / 4 + 1e-9
