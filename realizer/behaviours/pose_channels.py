"""AU channels that rise to a pose, and relax or stay."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping

import numpy as np

from realizer.animation.axis import Target, au
from realizer.animation.channel import Channel, Layer
from realizer.behaviours.kind import Fault
from realizer.core.array_types import Float64


def columns(aus: Mapping[tuple[int, str], float], amount: float) -> dict[Target, float]:
    """Return column -> intensity, at most 1, of {(AU, side): intensity at amount 1}."""
    values: dict[Target, float] = {}
    for (number, side), intensity in aus.items():
        for target in au(number, side):
            values[target] = max(values.get(target, 0.0), min(amount * intensity, 1.0))
    return values


def hold(values: Mapping[Target, float], times: Float64, source: str) -> tuple[Channel, ...]:
    """Return channels that are 0 at start and end, and constant from attackPeak to relax: times (4,)."""
    return tuple(
        Channel(target, times, np.array([0.0, value, value, 0.0]), source=source)
        for target, value in values.items()
        if value
    )


def keep_base(values: Mapping[Target, float], times: Float64, source: str) -> tuple[Channel, ...]:
    """Return channels of a base state that rise from start to end, and stay: times (2,)."""
    return tuple(
        Channel(target, times, np.array([0.0, value]), layer=Layer.BASE, keeps_last=True, source=source)
        for target, value in values.items()
    )


def unknown_word(attribute: str, word: str, known: Iterable[str]) -> Fault:
    """Return the fault of an unknown word, with similar known ones."""
    names = {name.upper(): name for name in known}
    got = word if len(word) <= 60 else word[:60] + "..."
    # Of names such as "template:grief" only the last part is compared.
    family, _, part = got.upper().rpartition(":")
    parts = {name.rpartition(":")[2]: name for name in names if name.rpartition(":")[0] == family}
    near = difflib.get_close_matches(part, list(parts), n=3)
    suggestions = " or ".join(names[parts[name]] for name in near)
    hint = f", did you mean {suggestions}?" if near else ""
    wanted = f"{attribute}: wanted one of {', '.join(names.values())}"
    return Fault("CANNOT_CREATE_BEHAVIOR", f"{wanted}; got {got!r}{hint}")
