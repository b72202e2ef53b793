"""Phonemes from loudness."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from realizer.animation.lips.lip_sync import lip_channels
from realizer.speech.recorded.loudness_lips import by_loudness

RATE = 16000


def tone(*parts: tuple[float, float]) -> np.ndarray:
    """A tone in parts of (seconds, how loud 0..1)."""
    pieces = [level * np.sin(np.arange(round(s * RATE)) * 0.1) for s, level in parts]
    return np.rint(20000 * np.concatenate(pieces)).astype(np.int16)


def test_by_loudness_opens_in_loud_parts() -> None:
    phonemes = by_loudness(tone((0.4, 1.0), (0.4, 0.0), (0.4, 0.1)), RATE)
    assert [p.ipa for p in phonemes] == ["a", "", "ə"]
    assert phonemes[0].start == 0.0
    assert phonemes[1].start == 0.4
    assert phonemes[-1].end == 1.2


def test_by_loudness_covers_a_sound_of_any_length() -> None:
    pcm = tone((0.213, 1.0), (0.1, 0.3))
    phonemes = by_loudness(pcm, RATE)
    assert all(a.end == b.start for a, b in pairwise(phonemes))
    assert phonemes[-1].end == len(pcm) / RATE


def test_by_loudness_ignores_the_overall_level() -> None:
    pcm = tone((0.4, 1.0), (0.4, 0.15))
    assert by_loudness(pcm, RATE) == by_loudness((pcm // 8).astype(np.int16), RATE)


def test_by_loudness_of_silence_is_empty() -> None:
    assert by_loudness(np.zeros(RATE, np.int16), RATE) == ()
    assert by_loudness(np.zeros(0, np.int16), RATE) == ()


def test_by_loudness_opens_the_jaw() -> None:
    channels = lip_channels(by_loudness(tone((0.3, 0.0), (0.4, 1.0), (0.3, 0.0)), RATE), 0.0)
    jaw = next(c for c in channels if c.target.name == "open_jaw")
    assert np.interp(0.5, jaw.times, jaw.values) > 5 * max(np.interp(0.1, jaw.times, jaw.values), 1.0)
