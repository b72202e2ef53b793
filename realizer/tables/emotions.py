"""emotions.toml -> the archetypes on the wheel of emotions, words for them and between them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from realizer import tables
from realizer.errors import TableError
from realizer.tables.lexemes import face_lexemes

__all__ = ["Archetype", "Word", "archetypes", "words"]

FILE = "emotions.toml"


@dataclass(frozen=True, slots=True)
class Archetype:
    """An emotion with a face of its own: its face lexeme, degrees on the wheel, activation 1..7."""

    name: str
    angle: float
    activation: float


@dataclass(frozen=True, slots=True)
class Word:
    """A word for an emotion.

    Attributes:
        like: the archetype of its category; "" where it is none, None where its angle says what it is.
        angle: degrees on the wheel, None where it is of a category.
        activation: 1..7, None for that of its place.
    """

    name: str
    like: str | None = None
    angle: float | None = None
    activation: float | None = None


@cache
def archetypes() -> tuple[Archetype, ...]:
    """All of them, by rising angle.

    Raises:
        TableError: one without a face lexeme, or off the wheel.
    """
    found = []
    for name, row in _table()["archetype"].items():
        if name not in face_lexemes():
            raise TableError(f"{FILE}, archetype.{name}: wanted the name of a face lexeme")
        if not (0 <= row["angle"] < 360 and 1 <= row["activation"] <= 7):
            raise TableError(f"{FILE}, archetype.{name}: wanted angle 0..360 and activation 1..7, got {row}")
        found.append(Archetype(name, float(row["angle"]), float(row["activation"])))
    return tuple(sorted(found, key=lambda archetype: archetype.angle))


@cache
def words() -> Mapping[str, Word]:
    """Upper-case word -> what it means; the archetypes' own names first.

    Raises:
        TableError: a word that leads nowhere.
    """
    own = {archetype.name: Word(archetype.name, like=archetype.name) for archetype in archetypes()}
    found = dict(own)
    for name, row in _table()["word"].items():
        if ("like" in row) == ("angle" in row) or not set(row) <= {"like", "angle", "activation"}:
            raise TableError(f"{FILE}, word.{name}: wanted like or angle, and perhaps activation, got {row}")
        if row.get("like") and row["like"] not in own:
            raise TableError(f"{FILE}, word.{name}, like: wanted an archetype, got {row['like']!r}")
        found[name] = Word(name, **row)
    return found


@cache
def _table() -> Mapping[str, Any]:
    return tables.read_toml(tables.text_of(FILE), FILE)
