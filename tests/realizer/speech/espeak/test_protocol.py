"""Answers of espeak-ng's process: events as structs, followed by samples."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from realizer.speech.espeak.protocol import END, MARK, PHONEME, WORD, Event, read_answer
from realizer.speech.espeak.worker import Event as Struct

SENTENCE = 2


def struct(kind: int, sample: int = 0, place: int = 0, text: bytes = b"") -> bytes:
    event = Struct(type=kind, sample=sample, text_position=place)
    ctypes.memmove(ctypes.addressof(event.id), text, len(text))
    return bytes(event)


def read(*structs: bytes, marks: tuple[str, ...] = (), sound: bytes = b"") -> list[Event]:
    told = b"".join(structs)
    return read_answer({"events": len(told), "marks": list(marks)}, told + sound)[0]


def test_read_answer_returns_type_sample_place_and_text() -> None:
    assert read(struct(WORD, 10, 8), struct(PHONEME, 20, 9, "aɪ".encode()), struct(END, 30)) == [
        (WORD, 10, 8, ""),
        (PHONEME, 20, 9, "aɪ"),
        (END, 30, 0, ""),
    ]


def test_read_answer_ignores_other_events() -> None:
    assert read(struct(SENTENCE), struct(WORD, 5), struct(8)) == [(WORD, 5, 0, "")]


def test_read_answer_names_marks_by_the_head() -> None:
    told = read(struct(MARK, 1), struct(WORD, 2), struct(MARK, 3), marks=("m0", "m1"))
    assert [(sample, text) for _, sample, _, text in told] == [(1, "m0"), (2, ""), (3, "m1")]


@pytest.mark.parametrize(
    ("raw", "ipa"),
    [
        ("ˈaɪəɹ".encode()[:8], "ˈaɪə\ufffd"),  # eight bytes, no end: nothing of what follows is read
        ("ˈaʊə".encode(), "ˈaʊə"),
        (b"a\0t\0", "a"),  # what an earlier one left behind its end
        (b"", ""),
    ],
)
def test_read_answer_ends_phonemes_at_0_or_after_eight_bytes(raw: bytes, ipa: str) -> None:
    assert read(struct(PHONEME, 0, 0, raw)) == [(PHONEME, 0, 0, ipa)]


def test_read_answer_returns_read_only_samples() -> None:
    told = struct(WORD) + struct(END)
    _, pcm = read_answer({"events": len(told), "marks": []}, told + np.array([1, -2, 3], "<i2").tobytes())
    assert pcm.tolist() == [1, -2, 3]
    assert not pcm.flags.writeable
