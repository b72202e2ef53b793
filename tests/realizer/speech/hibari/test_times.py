"""Times of words and phonemes from the readings of hibari."""

import numpy as np
import pytest

from realizer.speech.hibari.times import (
    FADE,
    KEPT_OF_LAST,
    Sound,
    SpeechBuffer,
    cut,
    guess_lengths,
    signs_of,
    sounds,
    trim_to_sound,
    word_spans,
)
from realizer.speech.utterance import Phoneme
from realizer.speech.words import PlacedMark


def test_sounds_add_stress_signs_to_vowels_and_divide_blanks() -> None:
    sentence = [("Hi", "hˈI", True), ("you", "jˌu", False), (".", ".", False)]
    found = sounds(sentence, [10, 2, 3, 4, 4, 5, 6, 7, 8, 9])
    assert [(s.ipa, s.stress, s.start, s.end, s.token) for s in found] == [
        ("", 0, 0, 10, 0),
        ("h", 0, 10, 12, 0),
        ("aɪ", 1, 12, 21, 0),
        ("j", 0, 21, 28, 1),
        ("u", 2, 28, 41, 1),
        ("", 0, 41, 58, 2),
    ]


def test_word_spans_divide_expanded_words_by_their_sounds() -> None:
    tokens = [("at", "æt", True), ("seven", "sɛvən", True), ("P.M.", "piɛm", True), ("now", "nW", False)]
    heard = sounds(tokens, [0] + [1] * 16 + [0])
    alone = {"at": "æt", "7": "sɛvən", "pm": "piɛm"}
    separate = []

    def spoken(words: object) -> list[tuple[str, ...]]:
        separate.append(words)
        return [tuple(alone[word]) for word in words]  # type: ignore[attr-defined]

    found = word_spans(["at", "7", "pm", "now"], tokens, heard, spoken)
    assert ["".join(s.ipa for s in heard[a:b]) for a, b in found] == ["æt", "sɛvən", "piɛm", "naʊ"]
    assert separate == [["at", "7", "pm"]]


def test_word_spans_are_empty_for_words_without_sounds() -> None:
    heard = sounds([("one", "wʌn", False)], [0, 1, 1, 1, 0])
    assert word_spans(["one", "?"], [("one", "wʌn", False)], heard, lambda words: [("w",), ()]) == [
        (0, 3),
        (3, 3),
    ]
    assert word_spans(["one"], [], [], lambda words: []) == [(0, 0)]


def test_trim_to_sound_lets_pauses_start_where_silence_does() -> None:
    pcm = np.zeros(100, np.int16)
    pcm[:30] = 1000
    found = trim_to_sound([Sound("a", 0, 0, 60, 0), Sound("", 0, 60, 100, 0)], pcm)
    assert [(s.start, s.end) for s in found] == [(0, 30), (30, 100)]
    pcm[:] = 0  # never less than a part of the sound
    found = trim_to_sound([Sound("a", 0, 0, 60, 0), Sound("", 0, 60, 100, 0)], pcm)
    assert found[0].end == round(KEPT_OF_LAST * 60) == found[1].start


def test_guess_lengths_divides_the_audible_part() -> None:
    pcm = np.zeros(100, np.int16)
    pcm[10:90] = 5000
    sentence = [("aka", "aka", False)]
    lead, *signs, tail = guess_lengths(sentence, pcm)
    assert lead + sum(signs) + tail == len(pcm)
    assert (lead, tail) == (10, 10)
    assert signs[0] == pytest.approx(signs[2], abs=1)
    assert signs[0] > signs[1]
    assert guess_lengths([("", "", False)], pcm) == [0, 100]


def test_signs_of_a_sentence_end_without_a_blank() -> None:
    assert signs_of([("a", "ɐ", True), ("cat", "kæt", True)]) == ("ɐ kæt", (0, 0, 1, 1, 1))
    assert signs_of([("a", "ɐ", False), ("cat", "kæt", True)]) == ("ɐkæt", (0, 1, 1, 1))


RATE = 1000


def filled(length: int, sounds: list[Sound], words: list[tuple[int, int, str]] | None = None) -> SpeechBuffer:
    buffer = SpeechBuffer(phonemes=sounds, words=words or [])
    buffer.add(np.zeros(length // 2, np.int16))
    buffer.add(np.zeros(length - length // 2, np.int16))
    return buffer


def test_sounds_fill_gaps_with_pauses_and_join_them() -> None:
    buffer = filled(1000, [Sound("a", 1, 100, 200, 0), Sound("", 0, 200, 300, 0), Sound("b", 0, 400, 500, 1)])
    assert buffer.sounds(RATE) == (
        Phoneme(0.0, 0.1, ""),
        Phoneme(0.1, 0.2, "a", 1),
        Phoneme(0.2, 0.4, ""),
        Phoneme(0.4, 0.5, "b"),
        Phoneme(0.5, 1.0, ""),
    )


def test_sounds_are_one_pause_without_phonemes_and_none_without_sound() -> None:
    assert filled(1000, []).sounds(RATE) == (Phoneme(0.0, 1.0, ""),)
    assert SpeechBuffer().sounds(RATE) == ()


def test_marks_are_at_the_next_word_or_the_end_of_the_last() -> None:
    words = [(100, 200, "one"), (300, 400, "two")]
    placed = [
        PlacedMark("first", 0, False),
        PlacedMark("paused", 1, True),
        PlacedMark("second", 1, False),
        PlacedMark("end", 2, False),
        PlacedMark("first", 1, False),
    ]
    assert filled(500, [], words).marks(placed) == {"first": 100, "paused": 200, "second": 300, "end": 400}
    assert SpeechBuffer().marks([PlacedMark("m", 0, False)]) == {"m": 0}


def test_cut_fades_only_where_sound_was_cut_off() -> None:
    pcm = np.full(1000, 10_000, np.int16)
    assert (cut(pcm, 0, 1000, RATE) == pcm).all()
    ramp = round(FADE * RATE)
    part = cut(pcm, 100, 900, RATE)
    assert len(part) == 800
    assert part[0] == part[-1] == 0
    assert (part[ramp:-ramp] == 10_000).all()
    assert cut(pcm, 0, 900, RATE)[0] == 10_000
