"""Voices with an engine: what happens before the engine is used."""

from __future__ import annotations

from pathlib import Path

from realizer.speech.engine_process import Engine
from realizer.speech.engine_voice import EngineVoice
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
