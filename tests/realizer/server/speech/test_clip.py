"""Clips that are spoken while they arrive."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.protocol.messages.speech import TimedText
from realizer.server.speech.clip import ArrivingClip, Clip, samples_of

RATE = 1000


def arriving(words=(), phonemes=()) -> ArrivingClip:
    lists = ([TimedText(start=s, end=e, text=text) for s, e, text in items] for items in (words, phonemes))
    return ArrivingClip(RATE, *lists)


def add(clip: ArrivingClip, seconds: float) -> None:
    clip.sound += np.arange(round(seconds * RATE), dtype="<i2").tobytes()


def test_clip_survives_as_json() -> None:
    clip = Clip(sound=(RATE, np.arange(5, dtype=np.int16)), text="Hi", is_annotated=False)
    again = Clip.from_json(clip.to_json())
    assert again.to_json() == clip.to_json()
    assert samples_of(b"\x01\x00\xff\xff").tolist() == [1, -1]


def test_arriving_clip_without_words_is_ready_after_200_ms() -> None:
    clip = arriving()
    add(clip, 0.19)
    assert clip.ready == 0
    add(clip, 0.05)
    assert clip.ready == 240
    assert clip.take(240)[0].tolist() == [*range(190), *range(50)]
    assert (clip.ready, clip.taken, clip.count, clip.sound) == (0, 240, 1, b"")


def test_arriving_clip_ends_parts_where_a_word_begins() -> None:
    clip = arriving([(0.1, None, "one"), (0.5, 0.7, "two"), (0.8, None, "three")])
    add(clip, 0.6)
    assert clip.ready == 500
    _, words, _ = clip.take(500)
    assert [(w.start, w.end, w.text) for w in words] == [(0.1, None, "one")]
    add(clip, 0.5)
    assert clip.ready == 300
    _, words, _ = clip.take(300)
    assert [(w.start, pytest.approx(w.end), w.text) for w in words] == [(0, pytest.approx(0.2), "two")]
    assert clip.ready == 0, "the last word may go on"
    add(clip, 0.7)
    assert clip.ready == 1000, "but not for longer than a second"


def test_arriving_clip_divides_phonemes_between_parts() -> None:
    clip = arriving(phonemes=[(0.0, None, "a"), (0.25, 0.5, "b"), (0.6, None, "c")])
    add(clip, 1.0)
    parts = [clip.take(300)[2], clip.take(400)[2]]
    spans = [[(round(p.start, 3), round(p.end, 3), p.text) for p in part] for part in parts]
    assert spans == [[(0, 0.25, "a"), (0.25, 0.3, "b")], [(0, 0.2, "b"), (0.3, 0.4, "c")]]


def test_arriving_clip_adds_what_begins_after_the_sound_to_its_last_part() -> None:
    clip = arriving([(0.1, None, "one"), (100, 200, "two")], [(0.1, 0.2, "w"), (100, None, "t")])
    add(clip, 0.5)
    _, words, phonemes = clip.take(500, ends=True)
    assert [(w.start, w.end, w.text) for w in words] == [(0.1, None, "one"), (100, 200, "two")]
    assert [(p.start, p.end, p.text) for p in phonemes] == [(0.1, 0.2, "w"), (100, None, "t")]


def test_arriving_clip_of_noise_has_pauses_until_somebody_speaks() -> None:
    clip = arriving()
    random = np.random.default_rng(1)
    kinds = []
    for level in (50, 50, 5000, 50):
        clip.sound += np.rint(level * random.standard_normal(400)).astype("<i2").tobytes()
        _, _, phonemes = clip.take(400)
        kinds.append([(p.start, p.end, p.text) for p in phonemes])
    pause = [(0.0, pytest.approx(0.4), "")]
    assert kinds == [pause, pause, [], []]  # a turn goes on in a short pause
