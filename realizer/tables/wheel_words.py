"""Words for emotions and their places on the emotion wheel (`words_*.csv`, `emotion_wheel.csv`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Literal

from realizer import tables


@dataclass(frozen=True, slots=True)
class WhissellWord:
    """A word of Raouzaiou et al. 2002, table 6.

    Attributes:
        raw_activation: as printed.
        activation: as the paper uses it.
        angle: degrees on the ring "plutchik".
        category: archetype of the word; "" for a word between two archetypes.
    """

    word: str
    raw_activation: float | None
    activation: float | None
    evaluation: float | None
    angle: float
    category: str


@dataclass(frozen=True, slots=True)
class OwnWord:
    """Another name or degree, chosen for this project, of a word of the wheel or of Whissell.

    Attributes:
        strength: factor of the word that it is like.
    """

    word: str
    like: str
    strength: float
    source: Literal["own", "plutchik"]


@dataclass(frozen=True, slots=True)
class Place:
    """An emotion on a ring of the wheel.

    Attributes:
        angle: degrees.
        activation: 1..7 of a published archetype, or None.
        opposite, between: of Paul 2010, table 6.1, such as "trust+fear"; "" on the other rings.
    """

    ring: Literal["plutchik", "paul", "affect"]
    kind: Literal["archetype", "basic", "advanced", "rest"]
    name: str
    angle: float
    activation: float | None
    opposite: str
    between: str


@cache
def whissell_words() -> Mapping[str, WhissellWord]:
    """Return lower-case word -> row."""
    return {row.word: row for row in tables.csv_rows("words_whissell.csv", WhissellWord)}


@cache
def own_words() -> Mapping[str, OwnWord]:
    """Return lower-case word -> row."""
    return {row.word: row for row in tables.csv_rows("words_own.csv", OwnWord)}


@cache
def ring(name: str) -> Mapping[str, Place]:
    """Return emotion -> place on a ring, by angle."""
    rows = tables.csv_rows("emotion_wheel.csv", Place)
    return {row.name: row for row in sorted(rows, key=lambda row: row.angle) if row.ring == name}
