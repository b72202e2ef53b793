"""Action units by intensity and a behaviour's times -> channels that rise to a pose and leave or keep it."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping

import numpy as np

from realizer.animation.channel import Channel, Layer
from realizer.animation.targets import Target, au
from realizer.arrays import Float64
from realizer.behaviours.kind import Fault

__all__: list[str] = []


def columns(aus: Mapping[tuple[int, str], float], amount: float) -> dict[Target, float]:
    """Column -> intensity, of {(AU, side): intensity at amount 1}; an AU that is named twice is the stronger.

    What goes beyond an AU's 1 is as strong as it can be.
    """
    values: dict[Target, float] = {}
    for (number, side), intensity in aus.items():
        for target in au(number, side):
            values[target] = max(values.get(target, 0.0), min(amount * intensity, 1.0))
    return values


def shown(values: Mapping[Target, float], times: Float64, source: str) -> tuple[Channel, ...]:
    """Channels that are 0 at start, there from attackPeak to relax, 0 at end: times (4,)."""
    return tuple(
        Channel(target, times, np.array([0.0, value, value, 0.0]), source=source)
        for target, value in values.items()
        if value
    )


def kept(values: Mapping[Target, float], times: Float64, source: str) -> tuple[Channel, ...]:
    """Channels of a base state that rise from start to end, and stay: times (2,)."""
    return tuple(
        Channel(target, times, np.array([0.0, value]), layer=Layer.BASE, holds=True, source=source)
        for target, value in values.items()
    )


def unknown(attribute: str, word: str, known: Iterable[str], *, prefix: str = "") -> Fault:
    """The fault of a word that nobody knows, with those near it, or all if none is.

    `prefix` stands before the word and before all that are known, and does not make them alike.
    """
    names = {name.upper(): prefix + name for name in known}
    got = prefix + (word if len(word) <= 60 else word[:60] + "...")
    near = difflib.get_close_matches(word[:60].upper(), list(names), n=3)
    wanted = f"one of {', '.join(names.values())}" if not near else " or ".join(names[name] for name in near)
    return Fault("CANNOT_CREATE_BEHAVIOR", f"{attribute}: wanted {wanted}; got {got!r}")
