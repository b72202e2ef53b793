"""A sentence with known times, by a voice that no aligner uses."""

from dataclasses import dataclass

import numpy as np
import pytest

from realizer.speech.espeak.voice import EspeakVoice
from realizer.speech.utterance import SpeechRequest, Utterance
from tests.realizer.speech.conftest import _skip_without_the_engine, voice

__all__ = ["_skip_without_the_engine", "voice"]

TEXT = "The tall woman carried a basket of apples down the hill."
WRONG = "Yesterday it rained all day; today the sun is shining."


@dataclass(frozen=True, eq=False)
class Noisy:
    """The recording: half a second of noise before the speech, and noise 20 dB under it."""

    said: Utterance
    pcm: np.ndarray
    rate: int
    onsets: np.ndarray


def noisy(said: Utterance) -> Noisy:
    assert said.pcm is not None
    before = said.sample_rate // 2
    clean = np.pad(said.pcm.astype(float), (before, before))
    loud = 0.1 * np.sqrt((said.pcm.astype(float) ** 2).mean())
    pcm = clean + np.random.default_rng(3).normal(0, loud, len(clean))
    onsets = np.array([word.start for word in said.words]) + 0.5
    return Noisy(said, np.clip(pcm / 2, -32768, 32767).astype(np.int16), said.sample_rate, onsets)


@pytest.fixture(scope="session")
def sentence(voice: EspeakVoice) -> Noisy:
    return noisy(voice.say(SpeechRequest(TEXT, voice="en-us+m7")))


@pytest.fixture(scope="session")
def zin(voice: EspeakVoice) -> Noisy:
    return noisy(
        voice.say(
            SpeechRequest("Mijn zus woont in een klein huis aan het water.", language="nl", voice="nl+m3")
        )
    )
