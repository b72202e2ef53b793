"""Tests of the times that a document gives of its recording."""

from __future__ import annotations

import numpy as np

from bml_schema import Description, Speech, SpeechText
from bml_schema.nodes import OWN, RECORDED
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.recorded.given_times import at_given_times, given_times, with_times
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import GivenTimes, Phoneme, Recording, SpeechRequest, Utterance, Word

TIMES = (
    f'<recorded xmlns="{OWN}"><mark name="a" time="0"/><word start="0" end="0.4">one</word>'
    '<mark name="b" time="0.5"/><word start="0.5" end="1">two</word>'
    '<viseme name="oo" start="0.1" end="0.4" amount="1"/><viseme name="TH" start="0.4" end="0.8"/></recorded>'
)


def speech(content: str) -> Speech:
    description = Description(priority=1, type=RECORDED, content=content)
    return Speech(id="s", text=SpeechText(parts=("one two",)), descriptions=(description,))


def test_given_times_reads_marks_words_and_visemes() -> None:
    given = given_times(speech(TIMES))
    assert given is not None
    assert given.marks == {"a": 0, "b": 0.5}
    assert given.words == (Word(0, 0.4, "one"), Word(0.5, 1, "two"))
    assert given.phonemes == (Phoneme(0, 0.1, ""), Phoneme(0.1, 0.4, "u"), Phoneme(0.4, 0.8, "θ"))
    assert (given.duration, given.last, given.warnings) == (1, 0.8, ())


def test_given_times_without_a_readable_description_are_none() -> None:
    assert given_times(Speech(id="s")) is None
    assert given_times(speech("<recorded")) is None
    assert given_times(speech(TIMES.replace('time="0.5"', 'time="soon"'))) is None


def test_given_times_are_those_of_the_sound() -> None:
    given = given_times(speech(TIMES))
    assert given is not None
    recording = Recording(8000, np.zeros(8000, np.int16))
    timed = with_times(recording, given)
    assert timed is with_times(recording, given)
    assert (timed.words, timed.phonemes) == (given.words, given.phonemes)
    assert timed.pcm is recording.pcm


def test_given_times_are_those_of_what_a_voice_says() -> None:
    given = given_times(speech(TIMES))
    assert given is not None
    request = SpeechRequest("one <mark name='b'/>two", ("b",), given=given)
    said = speak_to_length(SilentVoice(), request)
    assert (said.duration, said.marks, said.words) == (1, {"a": 0, "b": 0.5}, given.words)
    assert said.phonemes[:3] == given.phonemes
    assert all(p.start >= 0.8 for p in said.phonemes[3:])


def test_given_times_without_words_are_an_utterance_without_sound() -> None:
    given = given_times(speech(TIMES))
    assert given is not None
    silent = at_given_times(Utterance(0.0, (), (), {}), given)
    assert (silent.duration, silent.phonemes, silent.pcm) == (1, given.phonemes, None)
    assert GivenTimes({}, unknown=("zork",)).warnings == ("visemes without a mouth shape: zork",)


def test_words_without_times_are_kept() -> None:
    given = GivenTimes({"b": 0.5, "c": 1.0}, (Word(0.5, 1.0, "two"),))
    said = speak_to_length(SilentVoice(), SpeechRequest("one <mark name='b'/>two", ("b",), given=given))
    assert [word.text for word in said.words] == ["one", "two"]
