"""The poses that a face sheet shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from realizer.animation.axis import au, axis, fap
from realizer.animation.frames import AUFrames
from realizer.core.array_types import Float32
from realizer.core.units import ANGLE_UNIT
from realizer.emotions.wheel import wheel
from realizer.expressions.expression import Expression
from realizer.tables import by_number, faps
from realizer.tables.control_groups import au_regions, fap_regions
from realizer.tables.emotions import archetypes, ring
from realizer.tables.lexemes import face_lexemes

if TYPE_CHECKING:
    from realizer.tables import Fap

HALF, TURN = 512, 34907  # half of the unit distance (Paul 2010, 4.4.2), and 20 degrees for rotations
# Paul 2010, 6.4: the grid of his table of emotions.
ANGLES, ACTIVATIONS = np.arange(0, 360.1, 22.5), (1, 3, 5, 7)


@dataclass(frozen=True, eq=False)
class Pose:
    """One picture: a row of the animation axis, (n_targets,) float32, with its title and notes."""

    row: Float32
    title: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Series:
    """Poses under one heading; `columns` if they form a table."""

    heading: str
    poses: Sequence[Pose]
    columns: int | None = None


def frames(series: Sequence[Series]) -> AUFrames:
    """Return all poses of these series as frames, one per second."""
    rows = np.stack([pose.row for part in series for pose in part.poses])
    return AUFrames(np.arange(len(rows), dtype=np.float64), rows)


def neutral() -> Series:
    """Return the face at rest, with which all others are compared."""
    return Series("", [Pose(_nothing(), "neutral")])


def of_faps(value: float) -> list[Series]:
    """Return each low-level FAP at +value and -value, within its range, by the groups of the standard."""
    rows = {row.fap: row for row in faps()}
    return [
        Series(
            f"FAPs: {region.name}",
            [pose for number in region.members for pose in _both_ways(rows[number], value)],
        )
        for region in fap_regions()
    ]


def _both_ways(row: Fap, value: float) -> list[Pose]:
    size = value * TURN / HALF if row.unit == "angle_unit" else value
    found = []
    for sign in (1, -1):
        amount = round(min(max(sign * size, row.least), row.most))
        if amount:
            if row.unit == "angle_unit":
                distance = f"{np.degrees(amount * ANGLE_UNIT):+.0f} degrees"
            else:
                distance = f"{amount / 1024:+.2f} {row.unit}0"
            # The names do not give the direction: some FAPs named "lower" or "depress" go up.
            title, note = f"{row.fap} {row.name} {amount:+d}", f"{distance}; + is {row.direction}"
            found.append(Pose(_faps({row.fap: amount}), title, (note,)))
    return found


def of_aus(intensity: float) -> list[Series]:
    """Return each action unit on both sides, by place and direction."""
    return [
        Series(
            f"Action units: {region.name}",
            [
                _pose(
                    {(number, "BOTH"): intensity}, f"AU{number} {unit.name}", unit.no_fap or f"{intensity:g}"
                )
                for number in region.members
                for unit in [by_number()[number]]
            ],
        )
        for region in au_regions()
    ]


def of_emotions() -> list[Series]:
    """Return the archetypes, and the wheel at 17 angles and 4 activations (Paul 2010, 6.4)."""
    poses = [
        _pose(
            face_lexemes()[emotion.name].aus,
            emotion.name.lower(),
            f"{emotion.angle:g} degrees, activation {emotion.activation:g}",
        )
        for emotion in archetypes()
    ]
    names = {place.angle: name for name, place in ring("paul").items()}
    grid = [
        Pose(
            _faps(dict(enumerate(wheel(angle, activation).frame(), 1))),
            f"{angle:g} degrees, activation {activation}",
            (names[angle % 360],),
        )
        for angle in ANGLES
        for activation in ACTIVATIONS
    ]
    return [
        Series("Emotions: archetypes", poses),
        Series("Emotions: the wheel, weak to strong", grid, len(ACTIVATIONS)),
    ]


def of_expressions(expressions: Sequence[Expression]) -> list[Pose]:
    """Return each expression at full intensity."""
    return [_pose(expression.aus, expression.name, expression.units) for expression in expressions]


def _pose(aus: Mapping[tuple[int, str], float], title: str, note: str) -> Pose:
    """Return a pose of action units, (AU, side) -> intensity."""
    row = _nothing()
    for (number, side), amount in aus.items():
        row[[target.column for target in au(number, side)]] = amount
    return Pose(row, title, (note,))


def _faps(values: Mapping[int, float]) -> Float32:
    row = _nothing()
    for number, value in values.items():
        row[fap(number).column] = value
    return row


def _nothing() -> Float32:
    return np.zeros(len(axis()), np.float32)
