"""Conversion between IPA and ARPABET, by a table."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache

from realizer import tables

STRIPPED = str.maketrans("", "", "ːˑˈˌ̩̯̃̍͡ʲʰˀ_-~|")


@dataclass(frozen=True, slots=True)
class Sounded:
    """One or two phones of ARPABET, and their IPA."""

    arpabet: str
    ipa: str


def to_arpabet(ipa: Iterable[str]) -> tuple[str, ...]:
    """Return the phones of phonemes; symbols that are not in the table are ignored."""
    phones: list[str] = []
    for phoneme in ipa:
        text, at = phoneme.translate(STRIPPED), 0
        while at < len(text):
            size = next((n for n in range(len(text) - at, 0, -1) if text[at : at + n] in _phones()), 0)
            if size:
                phones += _phones()[text[at : at + size]].split()
            at += size or 1
    return tuple(phones)


def to_ipa(phone: str) -> str:
    """Return the IPA of one phone; "" for silence and noise."""
    return _sounds().get(phone, "")


@cache
def _rows() -> tuple[Sounded, ...]:
    return tables.read_csv(tables.text_of("phonemes_arpabet.csv"), Sounded, "phonemes_arpabet.csv")


@cache
def _phones() -> Mapping[str, str]:
    return {row.ipa: row.arpabet for row in _rows()}


@cache
def _sounds() -> Mapping[str, str]:
    return {row.arpabet: row.ipa for row in reversed(_rows())}
