"""How expressions begin, hold and end (`expression_motion.toml`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from realizer import tables


@dataclass(frozen=True, slots=True)
class Stagger:
    """Delays between the AUs of an expression, in seconds, each at most `share` of the onset or offset."""

    onset: float
    offset: float
    share: float


@dataclass(frozen=True, slots=True)
class Asymmetry:
    """The differences between sides.

    Attributes:
        even: AUs without any, which do not drift either.
        least, most: share of the value by which one side is weaker.
        habit: how often it is the same side.
        lead_least, lead_most: seconds by which the other side is earlier.
    """

    even: frozenset[int]
    least: float
    most: float
    habit: float
    lead_least: float
    lead_most: float


@dataclass(frozen=True, slots=True)
class Hold:
    """The drift of a held value: its share, seconds between turning points, their greatest number."""

    drift: float
    least: float
    every: float
    most: int


@dataclass(frozen=True, slots=True)
class ExpressionMotion:
    """Attributes:
    places: AU -> its place in the order of onsets, 0 (first) to 1.
    """

    stagger: Stagger
    asymmetry: Asymmetry
    hold: Hold
    places: Mapping[int, float]


@cache
def expression_motion() -> ExpressionMotion:
    """Return the table."""
    table = tables.toml_table("expression_motion.toml")
    stagger = dict(table["stagger"])
    order = stagger.pop("order")
    places = {au: rank / (len(order) - 1) for rank, aus in enumerate(order) for au in aus}
    asymmetry = dict(table["asymmetry"])
    asymmetry["even"] = frozenset(asymmetry["even"])
    return ExpressionMotion(Stagger(**stagger), Asymmetry(**asymmetry), Hold(**table["hold"]), places)
