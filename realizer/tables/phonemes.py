"""The table of phonemes: their articulatory features."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Literal

from realizer import tables


@dataclass(frozen=True, slots=True)
class PhonemeFeatures:
    """How one IPA symbol is made; `height` of vowels only, 0 close .. 1 open."""

    ipa: str
    kind: Literal["vowel", "consonant"]
    place: str
    manner: str
    height: float | None
    rounded: float


@cache
def phoneme_features() -> Mapping[str, PhonemeFeatures]:
    """IPA symbol -> features."""
    rows = tables.read_csv(tables.text_of("phonemes.csv"), PhonemeFeatures, "phonemes.csv")
    return {row.ipa: row for row in rows}


@cache
def vowels() -> frozenset[str]:
    """The IPA letters of vowels."""
    return frozenset(ipa for ipa, row in phoneme_features().items() if row.kind == "vowel")
