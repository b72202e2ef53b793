"""Phonemes from loudness, for recordings without a transcript."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from realizer import tables
from realizer.core.array_types import Int16
from realizer.speech.utterance import Phoneme


def by_loudness(pcm: Int16, rate: int) -> tuple[Phoneme, ...]:
    """Return vowels that are the more open the louder the sound is (`envelope.toml`).

    Phonemes and pauses cover the sound without gaps; () for silence.

    Args:
        pcm: (n,) mono.
        rate: Hz.
    """
    facts = _facts()
    size = max(1, round(facts["window"] * rate))
    count = -(-len(pcm) // size)
    padded = np.zeros(count * size)
    padded[: len(pcm)] = pcm
    rms = np.sqrt(np.mean(padded.reshape(count, size) ** 2, axis=1))
    loud = float(np.quantile(rms, facts["loud"])) if count else 0.0
    if loud < facts["quietest"]:
        return ()
    level = 20 * np.log10(np.maximum(rms, 1e-9) / loud)
    steps = facts["opening"]
    sounds = [next((s["ipa"] for s in steps if one >= s["above"]), "") for one in level]
    starts = [k for k in range(count) if k == 0 or sounds[k] != sounds[k - 1]]
    ends = [*starts[1:], count]
    whole = len(pcm) / rate
    return tuple(
        Phoneme(first * size / rate, min(last * size / rate, whole), sounds[first])
        for first, last in zip(starts, ends, strict=True)
    )


@cache
def _facts() -> dict[str, Any]:
    return tables.read_toml(tables.text_of("envelope.toml"), "envelope.toml")
