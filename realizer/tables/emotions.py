"""Emotions: places on the wheel, words, faces, ranges of FAPs, and the parameters of models."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, partial
from typing import Literal

from realizer import tables
from realizer.tables.lexemes import face_lexemes, read_aus


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


# () -> {lower-case word: row}
whissell_words = cache(partial(tables.csv_index, "words_whissell.csv", WhissellWord, "word"))
own_words = cache(partial(tables.csv_index, "words_own.csv", OwnWord, "word"))


@cache
def ring(name: str) -> Mapping[str, Place]:
    """Return emotion -> place on a ring, by angle."""
    rows = tables.csv_rows("emotion_wheel.csv", Place)
    return {row.name: row for row in sorted(rows, key=lambda row: row.angle) if row.ring == name}


FILE = "emotions.toml"


@dataclass(frozen=True, slots=True)
class EmotionFace:
    """The face of an emotion: action units as of a `FaceLexeme`; `lexeme` may be ""."""

    emotion: str
    lexeme: str
    aus: Mapping[tuple[int, str], float]


@cache
def emotion_faces() -> Mapping[str, EmotionFace]:
    """Return lower-case emotion -> face."""
    found = {}
    for emotion, row in tables.toml_table(FILE)["face"].items():
        lexeme = row.get("lexeme", "")
        aus = face_lexemes()[lexeme].aus if lexeme else read_aus(row["aus"], f"{FILE}, face.{emotion}")
        found[emotion] = EmotionFace(emotion, lexeme, aus)
    return found


@dataclass(frozen=True, slots=True)
class EmotionModel:
    """The parameters of the emotion wheel and the recogniser."""

    most: float  # highest activation, at which our own profiles are defined
    spread: float  # share of an action unit by which a random face may differ
    middle: float  # middle of the scales of evaluation and activation
    chosen: Mapping[str, int]  # emotion -> number of its preferred published profile
    least_length: float  # least length of a range, FAPU
    absent: float  # tolerance for a FAP that is not moved, FAPU
    noise: Mapping[str, float]  # unit -> FAPU by which FAPs of tracked points are blurred
    most_square: float  # greatest square of a relative distance from a range
    least_belief: float  # belief below which a face belongs to no class
    window: float  # seconds over which frames are averaged
    unjudged: tuple[int, ...]  # FAPs that no feature point tells of alone
    strengths: tuple[float, ...]  # strengths at which our own profiles are recognised
    smiles: tuple[Mapping[int, float], ...]  # AU -> intensity, of more faces that are recognised as joy


@cache
def emotion_model() -> EmotionModel:
    """Return the model."""
    table = tables.toml_table("emotion_model.toml")
    recognition = table["recognition"]
    recognition |= {name: tuple(recognition[name]) for name in ("unjudged", "strengths")}
    smiles = [{int(unit): value for unit, value in face.items()} for face in recognition["smiles"]]
    recognition["smiles"] = tuple(smiles)
    return EmotionModel(**table["wheel"], chosen=table["chosen"], **recognition)


@dataclass(frozen=True, slots=True)
class PublishedRange:
    """The range of a FAP in a published profile, printed and corrected (Raouzaiou et al. 2002, table 5)."""

    emotion: str
    profile: int
    fap: int
    raw_low: float
    raw_high: float
    low: float
    high: float
    fault: str


@dataclass(frozen=True, slots=True)
class OwnRange:
    """The range of a FAP in one of our own profiles."""

    emotion: str
    profile: int
    fap: int
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Statistic:
    """Mean and deviation of a FAP in faces that show an emotion; None if not verified."""

    emotion: str
    fap: int
    raw_mean: float | None
    mean: float | None
    deviation: float | None


published_ranges = cache(partial(tables.csv_rows, "profiles_published.csv", PublishedRange))  # as printed
own_ranges = cache(partial(tables.csv_rows, "profiles_own.csv", OwnRange))
statistics = cache(partial(tables.csv_rows, "fap_statistics.csv", Statistic))  # by emotion and FAP
