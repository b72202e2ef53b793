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
        least_length: least length of a range, FAPU.
        absent: tolerance for a FAP that is not moved, FAPU.
        noise: unit -> FAPU by which FAPs of tracked points are blurred.
        most_square: greatest square of a relative distance from a range.
        least_belief: belief below which a face belongs to no class.
        window: seconds over which frames are averaged.
        unjudged: FAPs that no feature point tells of alone.
        strengths: strengths at which our own profiles are recognised.
    """

    most: float
    spread: float
    middle: float
    chosen: Mapping[str, int]
    least_length: float
    absent: float
    noise: Mapping[str, float]
    most_square: float
    least_belief: float
    window: float
    unjudged: tuple[int, ...]
    strengths: tuple[float, ...]


@cache
def emotion_model() -> EmotionModel:
    """Return the model."""
    table = tables.toml_table("emotion_model.toml")
    recognition = table["recognition"]
    recognition |= {name: tuple(recognition[name]) for name in ("unjudged", "strengths")}
    return EmotionModel(**table["wheel"], chosen=table["chosen"], **recognition)
