"""Lines of subtitles."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import pytest

from bml_schema import SpeechText
from realizer.offline import realize
from realizer.outputs.captions import MOST, Track, captions
from realizer.outputs.speech_spans import Span
from realizer.speech.utterance import Word


def spoken(realization, *spoken_words, until=99.0, also=()):
    """Return the realization with these words spoken from 1 s on; `also` by another character."""
    (speaking,) = realization.speeches

    def says(words, character):
        utterance = replace(speaking.utterance, words=tuple(Word(*word) for word in words))
        return replace(speaking, start=1.0, until=until, utterance=utterance, character=character)

    return replace(realization, speeches=(says(spoken_words, 0), *([says(also, 1)] if also else ())))


def test_captions_break_lines_at_pauses_and_when_full(realization):
    words = [(0.3 * k, 0.3 * k + 0.3, f"wonderful{k}") for k in range(8)]
    found = captions(spoken(realization, *words, (4.0, 4.3, "after"), (4.3, 4.5, "all")))
    assert [line.text for line in found] == [
        "wonderful0 wonderful1 wonderful2",
        "wonderful3 wonderful4 wonderful5",
        "wonderful6 wonderful7",
        "after all",
    ]
    assert all(len(line.text) <= MOST for line in found)
    assert all(before.end <= after.start for before, after in pairwise(found))
    assert found[0].start == 1.0
    assert found[-1].end == pytest.approx(5.9)  # a little longer than it is heard


def test_captions_have_the_punctuation_of_the_text_and_end_at_sentences():
    text = """Hello there. How are you? He said, "It is Dr. Smith \u2013 not 50% \u2013 of <sync id="m"/>all
        'em!" (Yes.) 你好，世界。"""
    played = realize(f'<bml id="b"><speech id="s"><text>{text}</text></speech></bml>', voice="silent")
    assert [line.text for line in captions(played)] == [
        "Hello there.",
        "How are you?",
        'He said, "It is Dr.',
        "Smith \u2013 not fifty percent",
        "of all 'em!\"",
        "(Yes.)",
        "你好，世界。",
    ]


def test_captions_of_words_that_are_not_in_the_text_have_only_blanks(realization):
    found = spoken(realization, (0, 1, "World"), (1, 2, "Wide"), (2, 3, "Web"), (3, 4, "works"))
    text = SpeechText(parts=("The WWW, works?",))
    speeches = tuple(replace(speech, text=text) for speech in found.speeches)
    assert [line.text for line in captions(replace(found, speeches=speeches))] == ["World Wide Web works?"]


def test_captions_have_lines_of_one_long_word(realization):
    found = captions(spoken(realization, (0, 1, "x" * 60), (1, 2, "y")))
    assert [line.text for line in found] == ["x" * 60, "y"]


def test_captions_of_speech_without_words_are_empty(realization):
    assert captions(spoken(realization)) == ()


def test_captions_show_simultaneous_speech_in_separate_lines(realization):
    found = captions(spoken(realization, (0.0, 1.0, "one"), also=((0.5, 1.5, "two"),)))
    assert found == (
        Span(1.0, 1.5, "one"),
        Span(1.5, 2.4, "one\ntwo"),
        Span(2.4, 2.9, "two"),
    )


def test_captions_exclude_words_that_were_cut_off(realization):
    found = captions(spoken(realization, (0, 1, "heard"), (1, 2, "lost"), until=2.0))
    assert [line.text for line in found] == ["heard"]


@pytest.mark.parametrize(("end", "last"), [(9.0, 1000), (2.25, 250)])
def test_track_shows_each_line_from_its_start_to_its_end(end: float, last: int) -> None:
    written: list[Any] = []
    film = SimpleNamespace(
        add_stream=lambda codec: SimpleNamespace(codec_context=SimpleNamespace()), mux=written.append
    )
    av = SimpleNamespace(Packet=lambda data: SimpleNamespace(data=data))
    track = Track(av, film, "webvtt", [Span(0.5, 1.25, "one"), Span(2.0, 3.0, "a & b")], end)
    track.write(1.0)
    assert [(p.data, p.pts, p.duration) for p in written] == [(b"one", 500, 750)]
    track.write(9.0)
    assert [(p.data, p.pts, p.duration) for p in written[1:]] == [(b"a &amp; b", 2000, last)]
