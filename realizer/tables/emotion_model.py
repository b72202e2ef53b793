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
    """The parameters of the emotion wheel and the recogniser.

    Attributes:
        most: highest activation, at which our own profiles are defined.
        spread: share of an action unit by which a random face may differ.
        middle: middle of the scales of evaluation and activation.
        chosen: emotion -> number of its preferred published profile.
        core, base: shares of a range's length where membership is 1, and where it ends.
        least_length: least length of a range, FAPU.
        absent: tolerance for a FAP that is not moved, FAPU.
        strengths: strengths at which our own profiles are recognised.
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
    """Return the model.

    Raises:
        TableError: an invalid value.
    """
    table = tables.toml_table(FILE)
    recognition = table["recognition"] | {"strengths": tuple(table["recognition"]["strengths"])}
    model = EmotionModel(**table["wheel"], chosen=table["chosen"], **recognition)
    if not (0 <= model.core < model.base and model.least_length > 0 and model.absent > 0):
        raise TableError(f"{FILE}, recognition: wanted 0 <= core < base, and lengths above 0, got {model}")
    if not model.strengths or min(model.strengths) <= 0:
        raise TableError(f"{FILE}, recognition: wanted strengths above 0, got {model.strengths}")
    return model
