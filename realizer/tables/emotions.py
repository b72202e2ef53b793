"""The action units of the archetypal emotions (`emotions.toml`)."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from realizer import tables
from realizer.tables.lexemes import face_lexemes, read_aus
from realizer.tables.wheel_words import ring

FILE = "emotions.toml"


@dataclass(frozen=True, slots=True)
class EmotionFace:
    """The face of an emotion: action units as of a `FaceLexeme`; `lexeme` may be ""."""

    emotion: str
    lexeme: str
    aus: Mapping[tuple[int, str], float]


@dataclass(frozen=True, slots=True)
class Archetype:
    """An emotion with a face lexeme of this name, its angle on Plutchik's ring, and activation 1..7."""

    name: str
    angle: float
    activation: float


@cache
def emotion_faces() -> Mapping[str, EmotionFace]:
    """Return lower-case emotion -> face."""
    found = {}
    for emotion, row in tables.toml_table(FILE)["face"].items():
        lexeme = row.get("lexeme", "")
        aus = face_lexemes()[lexeme].aus if lexeme else read_aus(row["aus"], f"{FILE}, face.{emotion}")
        found[emotion] = EmotionFace(emotion, lexeme, aus)
    return found


@cache
def archetypes() -> tuple[Archetype, ...]:
    """Return the emotions with a lexeme, by angle."""
    return tuple(
        Archetype(emotion_faces()[place.name].lexeme, place.angle, place.activation)
        for place in ring("plutchik").values()
        if place.activation is not None
    )
