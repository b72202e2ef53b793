"""The articulatory features of phonemes (`phonemes.csv`)."""

import unicodedata
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


def symbols(ipa: str) -> list[tuple[str, bool]]:
    """Return (IPA symbol of the table, whether it is labialised) of each sound of a string, in order."""
    known = phoneme_features()
    found: list[tuple[str, bool]] = []
    # The composed form first: ç is a letter of its own, while õ is o with a diacritic.
    for letter in unicodedata.normalize("NFC", ipa):
        if letter == "ʷ" and found:
            found[-1] = (found[-1][0], True)
            continue
        plain = letter if letter in known else unicodedata.normalize("NFD", letter.lower())[0]
        if plain in known:
            pair = found[-1][0] + plain if found else ""
            if pair in known:  # an affricate: two letters, one sound
                found[-1] = (pair, found[-1][1])
            else:
                found.append((plain, False))
    return found
