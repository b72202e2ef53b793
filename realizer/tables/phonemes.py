"""The articulatory features of phonemes (`phonemes.csv`)."""

from dataclasses import dataclass
from functools import cache, partial
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


# () -> {IPA symbol: features}
phoneme_features = cache(partial(tables.csv_index, "phonemes.csv", PhonemeFeatures, "ipa"))


@cache
def vowels() -> frozenset[str]:
    """Return the IPA symbols of vowels."""
    return frozenset(ipa for ipa, row in phoneme_features().items() if row.kind == "vowel")
