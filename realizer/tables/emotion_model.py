"""The parameters of the emotion wheel and the recogniser (`emotion_model.toml`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from realizer import tables
from realizer.core.errors import TableError

FILE = "emotion_model.toml"


@dataclass(frozen=True, slots=True)
class EmotionModel:
    """The parameters that are not in the other tables of emotions.

    Attributes:
        most: the highest activation, for which our own profiles are drawn.
        spread: the part of an action unit by which a drawn face may differ.
        middle: of evaluation and activation.
        chosen: emotion -> the number of its published profile.
        core, base: parts of a range's length within which a value belongs to it for sure, and perhaps.
        least_length: FAPU, of a range.
        absent: FAPU, as far as a FAP that is not moved may be off.
        strengths: parts of one of our own profiles at which it is recognised.
    """

    most: float
    spread: float
    middle: float
    chosen: Mapping[str, int]
    core: float
    base: float
    least_length: float
    absent: float
    strengths: tuple[float, ...]


@cache
def emotion_model() -> EmotionModel:
    """The table.

    Raises:
        TableError: a membership that does not fall, no strength, or one of nothing.
    """
    table = tables.read_toml(tables.text_of(FILE), FILE)
    recognition = table["recognition"] | {"strengths": tuple(table["recognition"]["strengths"])}
    model = EmotionModel(**table["wheel"], chosen=table["chosen"], **recognition)
    if not (0 <= model.core < model.base and model.least_length > 0 and model.absent > 0):
        raise TableError(f"{FILE}, recognition: wanted 0 <= core < base, and lengths above 0, got {model}")
    if not model.strengths or min(model.strengths) <= 0:
        raise TableError(f"{FILE}, recognition: wanted strengths above 0, got {model.strengths}")
    return model
