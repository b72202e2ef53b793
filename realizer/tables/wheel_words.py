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
        raw_activation: as printed; `activation`: as the paper computes.
        angle: degrees on the ring "plutchik".
        category: the archetype it belongs to; "" for a word between two archetypes.
    """

    word: str
    raw_activation: float | None
    activation: float | None
    evaluation: float | None
    angle: float
    category: str


@dataclass(frozen=True, slots=True)
class OwnWord:
    """A word that no source of ours lists: it is another name for one that is known."""

    word: str
    like: str
    source: Literal["own"]


@dataclass(frozen=True, slots=True)
class Place:
    """An emotion on a ring of the wheel.

    Attributes:
        angle: degrees.
        activation: 1..7 of the published archetype, or None.
        opposite, between: Paul 2010, table 6.1; "" in the other ring, `between` = "trust+fear".
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
    """Lower-case word -> row."""
    rows = tables.read_csv(tables.text_of("words_whissell.csv"), WhissellWord, "words_whissell.csv")
    return {row.word: row for row in rows}


@cache
def own_words() -> Mapping[str, OwnWord]:
    """Lower-case word -> row."""
    rows = tables.read_csv(tables.text_of("words_own.csv"), OwnWord, "words_own.csv")
    return {row.word: row for row in rows}


@cache
def ring(name: str) -> Mapping[str, Place]:
    """Emotion -> its place on that ring, by rising angle."""
    rows = tables.read_csv(tables.text_of("emotion_wheel.csv"), Place, "emotion_wheel.csv")
    return {row.name: row for row in sorted(rows, key=lambda row: row.angle) if row.ring == name}
