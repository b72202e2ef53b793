"""The buffer that joins pieces of speech."""

from __future__ import annotations

import numpy as np

from realizer.speech.hibari.times import Sound
from realizer.speech.speech_buffer import FADE, SpeechBuffer, cut
from realizer.speech.utterance import Phoneme
from realizer.speech.words import PlacedMark

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
