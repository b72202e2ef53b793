"""Tests of the spans of speech and the instants of sync points."""

from __future__ import annotations

from dataclasses import replace

from realizer.outputs.speech_spans import Span, phonemes, points, words


def test_words_are_on_the_clock_of_the_realization(realization) -> None:
    (speaking,) = realization.speeches
    assert list(words(speaking)) == [Span(0.25, 0.65, "Hello"), Span(0.65, 1.15, "R&D <team>")]


def test_words_end_where_the_speech_is_cut_off(realization) -> None:
    (speaking,) = realization.speeches
    assert list(words(replace(speaking, until=0.5))) == [Span(0.25, 0.5, "Hello")]
    assert list(words(replace(speaking, until=0.2505))) == []


def test_phonemes_exclude_pauses(realization) -> None:
    (speaking,) = realization.speeches
    assert [span.text for span in phonemes(speaking)] == ["h", "o\u028a", "i\u02d0"]


def test_points_have_the_names_of_block_and_behaviour(realization) -> None:
    assert list(points(realization)) == [
        (0.2, "greeting:nod:start"),
        (0.81, "greeting:nod:stroke"),
        (1.4, "greeting:nod:end"),
    ]
