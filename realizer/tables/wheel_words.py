"""Words for emotions and their places on the emotion wheel (`words_*.csv`, `emotion_wheel.csv`)."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Literal

from realizer import tables


@dataclass(frozen=True, slots=True)
class WhissellWord:
    """A word of Raouzaiou et al. 2002, table 6."""

    word: str
    raw_activation: float | None  # as printed
    activation: float | None  # as the paper uses it
    evaluation: float | None
    angle: float  # degrees on the ring "plutchik"
    category: str  # archetype of the word; "" for a word between two archetypes


@dataclass(frozen=True, slots=True)
class OwnWord:
    """Another name or degree, chosen for this project, of a word of the wheel or of Whissell."""

    word: str
    like: str
    strength: float  # factor of the word that it is like
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
