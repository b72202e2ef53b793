"""Voices with an engine: what happens before the engine is used."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realizer.speech import engine_voice
from realizer.speech.engine_process import Engine
from realizer.speech.engine_voice import MOST, EngineVoice, UtteranceCache
from realizer.speech.ssml import Script
from realizer.speech.utterance import SpeechRequest, Utterance


class Counting(EngineVoice):
    name = "counting"
    worker = Engine("counting", Path("none.py"), lambda: None)
    asked = 0

    def _synthesize(self, request: SpeechRequest, script: Script) -> Utterance:
        self.asked += 1
        return Utterance(1.0, (), (), {})


def test_engine_voice_speaks_the_same_request_once() -> None:
    voice = Counting()
    assert voice.say(SpeechRequest("Hello")) is voice.say(SpeechRequest("Hello"))
    voice.say(SpeechRequest("Bye"))
    assert voice.asked == 2


def test_engine_voice_says_nothing_without_its_engine() -> None:
    voice = Counting()
    said = voice.say(SpeechRequest('<mark name="m"/> ', marks=("m",)))
    assert (said.duration, said.marks, voice.asked, voice.pid) == (0.0, {"m": 0.0}, 0, None)
    assert said.warnings


def test_engine_voice_asks_for_a_break() -> None:
    voice = Counting()
    voice.say(SpeechRequest('<break time="1s"/>'))
    assert voice.asked == 1


def test_engine_voice_can_be_closed_twice() -> None:
    voice = Counting("low")
    assert voice.name == "counting:low"
    voice.close()
    voice.close()


class Speaker:
    """Synthesizes a sound of some samples and counts requests."""

    def __init__(self, samples: int | None = None) -> None:
        self.samples = samples
        self.requests: list[str] = []

    def __call__(self, request: SpeechRequest) -> Utterance:
        self.requests.append(request.ssml)
        pcm = None if self.samples is None else np.zeros(self.samples, np.int16)
        return Utterance(1.0, (), (), {}, 8000, pcm)


def test_cache_returns_an_equal_request_without_synthesis() -> None:
    utterances, speaker = UtteranceCache(), Speaker()
    first = utterances.get(SpeechRequest("a"), speaker)
    assert utterances.get(SpeechRequest("a"), speaker) is first
    assert utterances.get(SpeechRequest("a", rate=2.0), speaker) is not first
    assert speaker.requests == ["a", "a"]


def test_cache_drops_the_utterance_that_was_not_used_for_longest() -> None:
    utterances, speaker = UtteranceCache(), Speaker()
    for k in range(MOST):
        utterances.get(SpeechRequest(str(k)), speaker)
    utterances.get(SpeechRequest("0"), speaker)  # now 1 is the oldest
    utterances.get(SpeechRequest("new"), speaker)
    del speaker.requests[:]
    for text in ("0", "2", "new", "1"):
        utterances.get(SpeechRequest(text), speaker)
    assert speaker.requests == ["1"]


def test_cache_limits_the_sum_of_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine_voice, "MAX_SAMPLES", 1000)
    utterances, speaker = UtteranceCache(), Speaker(400)
    for text in "abcb":
        utterances.get(SpeechRequest(text), speaker)
    assert speaker.requests == ["a", "b", "c"]
    utterances.get(SpeechRequest("a"), speaker)
    assert speaker.requests[3:] == ["a"]
    huge = Speaker(2000)
    for _ in range(2):
        utterances.get(SpeechRequest("huge"), huge)
    assert len(huge.requests) == 2


def test_cache_keeps_the_later_of_two_simultaneous_utterances() -> None:
    utterances, inner, outer = UtteranceCache(), Speaker(10), Speaker(10)
    request = SpeechRequest("a")

    def slow(request: SpeechRequest) -> Utterance:
        utterances.get(request, inner)  # as from another thread, meanwhile
        return outer(request)

    last = utterances.get(request, slow)
    assert utterances.get(request, inner) is last
    assert (len(inner.requests), len(outer.requests)) == (1, 1)
