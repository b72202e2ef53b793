"""Loudness of vowels: that of the sound, of accents, and as requested."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.speech.accents import prosody_facts
from realizer.speech.loudness import quantile, with_loudness
from realizer.speech.utterance import Phoneme, Utterance

RATE = 8000
LOUDER = prosody_facts()["accents"]["louder"]
FACTORS = (1.0, 0.5, 1.0, 2.0, 1.0)  # amplitudes of five vowels


def said(*, stressed: int | None = None, volume: float = 1.0, sound: bool = True) -> Utterance:
    """Five vowels with an s between them."""
    phonemes, pcm = list[Phoneme](), list[np.ndarray]()
    for k, factor in enumerate(FACTORS):
        start = k * 0.2
        phonemes.append(Phoneme(start, start + 0.1, "a", int(k == stressed), volume))
        phonemes.append(Phoneme(start + 0.1, start + 0.2, "s"))
        tone = np.sin(np.arange(RATE // 10) * 0.7)
        pcm += [4000 * factor * tone, 200 * tone]
    made = np.concatenate(pcm).astype(np.int16)
    return Utterance(1.0, (), tuple(phonemes), {}, RATE, made if sound else None)


def volumes(utterance: Utterance) -> list[float]:
    return [p.volume for p in with_loudness(utterance) if p.ipa == "a"]


def test_with_loudness_scales_vowels_by_their_amplitude() -> None:
    found = np.array(volumes(said(stressed=0)))
    assert found / found[4] == pytest.approx([LOUDER, 0.5, 1, 2, 1], rel=0.05)
    assert [p.volume for p in with_loudness(said()) if p.ipa == "s"] == [1.0] * 5


def test_with_loudness_makes_the_last_accent_of_a_phrase_louder() -> None:
    assert volumes(said(stressed=2, sound=False)) == pytest.approx([1, 1, LOUDER, 1, 1])


def test_with_loudness_multiplies_the_requested_volume() -> None:
    usual, soft = (np.array(volumes(said(stressed=2, volume=volume))) for volume in (1.0, 0.5))
    assert soft == pytest.approx(usual / 2)


def test_with_loudness_leaves_pauses_and_silence_alone() -> None:
    silent = Utterance(
        0.2, (), (Phoneme(0, 0.1, ""), Phoneme(0.1, 0.2, "t")), {}, RATE, np.zeros(1600, np.int16)
    )
    assert with_loudness(silent) is silent.phonemes
    quiet = said(stressed=0)
    quiet = Utterance(1.0, (), quiet.phonemes, {}, RATE, np.zeros(RATE, np.int16))
    assert volumes(quiet) == pytest.approx([LOUDER, 1, 1, 1, 1])


def test_with_loudness_extends_pauses_by_the_silence_beside_them() -> None:
    tone = 4000 * np.sin(np.arange(RATE) * 0.7)
    tone[int(0.3 * RATE) : int(0.6 * RATE)] = 0
    sounds = (("a", 0.0, 0.4), ("", 0.4, 0.5), ("m", 0.5, 0.7), ("", 0.7, 0.8), ("t", 0.8, 1.0))
    utterance = Utterance(
        1.0,
        (),
        tuple(Phoneme(start, end, ipa) for ipa, start, end in sounds),
        {},
        RATE,
        tone.astype(np.int16),
    )
    found = [(p.ipa, p.start, p.end) for p in with_loudness(utterance)]
    assert [ipa for ipa, *_ in found] == ["a", "", "m", "", "t"]
    assert np.array([times for _, *times in found]) == pytest.approx(
        np.array([(0, 0.3), (0.3, 0.6), (0.6, 0.7), (0.7, 0.8), (0.8, 1.0)]), abs=0.011
    )


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("part", [0.0, 0.1, 0.5, 0.9, 1.0])
def test_quantile_is_that_of_numpy(kind: type[np.floating], part: float) -> None:
    for count in range(1, 40):
        values = np.random.default_rng(count).uniform(size=count).astype(kind)
        assert quantile(values, part) == pytest.approx(float(np.quantile(values, part)), rel=1e-6)
