"""The articulatory features of phonemes (`phonemes.csv`)."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Literal

from realizer import tables


@dataclass(frozen=True, slots=True)
class PhonemeFeatures:
    """The articulation of an IPA symbol; vowels have a `height` from 0 (close) to 1 (open)."""

    ipa: str
    kind: Literal["vowel", "consonant"]
    place: str
    manner: str
    height: float | None
    rounded: float


@cache
def phoneme_features() -> Mapping[str, PhonemeFeatures]:
    """Return IPA symbol -> features."""
    return {row.ipa: row for row in tables.csv_rows("phonemes.csv", PhonemeFeatures)}


@cache
def vowels() -> frozenset[str]:
    """Return the IPA symbols of vowels."""
    return frozenset(ipa for ipa, row in phoneme_features().items() if row.kind == "vowel")
