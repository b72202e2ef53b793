"""FAPs, action units and emotions in; the poses that a sheet shows of them out, each as a row of FAPs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from realizer.animation.fap import to_fap
from realizer.animation.frames import AUFrames
from realizer.animation.targets import au, axis
from realizer.arrays import Float32
from realizer.tables import action_units, by_number, faps
from realizer.tables.emotions import archetypes
from realizer.tables.lexemes import face_lexemes
from realizer.tables.regions import au_regions, fap_regions

if TYPE_CHECKING:
    from realizer.tables import Fap

__all__: list[str] = []

HALF, TURN = 512, 34907  # half a face distance (Paul 2010, 4.4.2), and the 20 degrees that go with it
# Paul 2010, 6.4: the grid of his table of emotions.
ANGLES, ACTIVATIONS = np.arange(0, 360.1, 22.5), (1, 3, 5, 7)


@dataclass(frozen=True, eq=False)
class Pose:
    """One picture: (68,) float32 FAPs, and what to write below it."""

    row: Float32
    title: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Series:
    """Poses that belong together; `columns` where they make a table."""

    heading: str
    poses: Sequence[Pose]
    columns: int | None = None


def neutral() -> Series:
    """The face at rest, which all others are compared with."""
    return Series("", [Pose(np.zeros(68, np.float32), "neutral")])


def of_faps(value: float) -> list[Series]:
    """Each low-level FAP at +value and -value, by the standard's groups; less where it does not go so far."""
    rows = {row.fap: row for row in faps()}
    return [
        Series(
            f"FAPs: {region.name}",
            [pose for number in region.members for pose in _both_ways(rows[number], value)],
        )
        for region in fap_regions()
    ]


def _both_ways(fap: Fap, value: float) -> list[Pose]:
    size = value * TURN / HALF if fap.unit == "angle_unit" else value
    found = []
    for sign in (1, -1):
        amount = round(min(max(sign * size, fap.least), fap.most))
        if amount:
            row = np.zeros(68, np.float32)
            row[fap.fap - 1] = amount
            far = (
                f"{np.degrees(amount * 1e-5):+.0f} degrees"
                if fap.unit == "angle_unit"
                else f"{amount / 1024:+.2f} {fap.unit}0"
            )
            # Some FAPs are named "lower" or "depress" and go up: say which way plus is.
            found.append(Pose(row, f"{fap.fap} {fap.name} {amount:+d}", (f"{far}; + is {fap.direction}",)))
    return found


def of_aus(intensity: float) -> list[Series]:
    """Each action unit on both sides, by place and direction."""
    names = by_number(action_units())
    return [
        Series(
            f"Action units: {region.name}",
            _poses(
                [{(number, "BOTH"): intensity} for number in region.members],
                [f"AU{number} {names[number].name}" for number in region.members],
                [f"{intensity:g}" for _ in region.members],
            ),
        )
        for region in au_regions()
    ]


def of_emotions() -> list[Series]:
    """The archetypes."""
    known = archetypes()
    return [
        Series(
            "Emotions: archetypes",
            _poses(
                [face_lexemes()[emotion.name].aus for emotion in known],
                [emotion.name.lower() for emotion in known],
                [f"{emotion.angle:g} degrees, activation {emotion.activation:g}" for emotion in known],
            ),
        )
    ]


def _poses(
    shown: Sequence[Mapping[tuple[int, str], float]], titles: Sequence[str], notes: Sequence[str]
) -> list[Pose]:
    """Poses of action units: (AU, side) -> intensity each."""
    values = np.zeros((len(shown), len(axis())), np.float32)
    for row, aus in zip(values, shown, strict=True):
        for (number, side), amount in aus.items():
            row[[target.column for target in au(number, side)]] = amount
    rows = to_fap(AUFrames(np.arange(len(values), dtype=np.float64), values)).values
    return [
        Pose(row, title, (note,) if note else ())
        for row, title, note in zip(rows, titles, notes, strict=True)
    ]
