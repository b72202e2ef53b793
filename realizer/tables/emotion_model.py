"""The parameters of the emotion wheel and the recogniser (`emotion_model.toml`)."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from realizer import tables


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


@cache
def emotion_model() -> EmotionModel:
    """Return the model."""
    table = tables.toml_table("emotion_model.toml")
    recognition = table["recognition"]
    recognition |= {name: tuple(recognition[name]) for name in ("unjudged", "strengths")}
    return EmotionModel(**table["wheel"], chosen=table["chosen"], **recognition)
