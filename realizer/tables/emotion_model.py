"""The parameters of the emotion wheel and the recogniser (`emotion_model.toml`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from realizer import tables


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
    """Return the model."""
    table = tables.toml_table("emotion_model.toml")
    recognition = table["recognition"] | {"strengths": tuple(table["recognition"]["strengths"])}
    return EmotionModel(**table["wheel"], chosen=table["chosen"], **recognition)
