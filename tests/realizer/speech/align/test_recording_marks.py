"""Recordings as utterances."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.speech.align.recording_marks import align_recording, utterance_of_recording
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import Recording, SpeechRequest

MARKED = (
    '<mark name="a"/>The tall woman <mark name="b"/>carried a basket of apples '
    '<break time="300ms"/><mark name="c"/>down the hill.<mark name="d"/>'
)


@pytest.mark.espeak
def test_utterance_of_recording_places_marks_before_their_words(sentence) -> None:
    said = utterance_of_recording(sentence.pcm, sentence.rate, SpeechRequest(MARKED, ("a", "b", "c", "d")))
    starts = {word.text: word.start for word in said.words}
    assert said.marks["a"] == starts["The"]
    assert said.marks["b"] == starts["carried"]
    assert said.marks["c"] == pytest.approx(starts["down"], abs=0.1)
    assert said.marks["d"] == pytest.approx(said.words[-1].end, abs=0.01)
    assert said.duration == len(sentence.pcm) / sentence.rate
    assert np.abs(said.pcm.astype(int) - sentence.pcm).max() <= 1
    assert said.stretch == (1, 1)


@pytest.mark.espeak
def test_recording_in_a_request_replaces_the_voice(sentence) -> None:
    request = SpeechRequest(MARKED, ("a",), seconds=1.0, recording=Recording(sentence.rate, sentence.pcm))
    said = speak_to_length(SilentVoice(), request)
    assert said.duration == len(sentence.pcm) / sentence.rate
    assert [word.text for word in said.words] == [word.text for word in sentence.said.words]
    assert speak_to_length(SilentVoice(), request) is said, "it is aligned once"


def test_align_recording_falls_back_to_the_sound() -> None:
    silence = Recording(8000, np.zeros(8000, np.int16))
    said = align_recording(SpeechRequest("Hello", recording=silence), silence)
    assert said.pcm is silence.pcm
    assert (said.duration, said.words, said.phonemes) == (1.0, (), ())
    assert "lips do not move with the recording" in said.warnings[0]
