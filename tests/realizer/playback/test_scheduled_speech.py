"""Tests of utterances on the session clock."""

from __future__ import annotations

import pytest

from realizer.playback.scheduled_speech import ScheduledSpeech
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
