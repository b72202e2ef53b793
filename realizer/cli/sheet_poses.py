"""The poses that a face sheet shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from realizer.animation.axis import au, axis, fap
from realizer.animation.frames import AUFrames
from realizer.core.array_types import Float32
from realizer.emotions.wheel import wheel
from realizer.expressions.expression import Expression
from realizer.tables import by_number, faps
from realizer.tables.control_groups import au_regions, fap_regions
from realizer.tables.emotions import archetypes
from realizer.tables.lexemes import face_lexemes
from realizer.tables.wheel_words import ring

if TYPE_CHECKING:
    from realizer.tables import Fap

HALF, TURN = 512, 34907  # half a face distance (Paul 2010, 4.4.2), and the 20 degrees that go with it
# Paul 2010, 6.4: the grid of his table of emotions.
ANGLES, ACTIVATIONS = np.arange(0, 360.1, 22.5), (1, 3, 5, 7)


@dataclass(frozen=True, eq=False)
class Pose:
    """One picture: (n_targets,) float32 of the axis of all that is animated, and what to write below it."""

    row: Float32
    title: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Series:
    """Poses that belong together; `columns` where they make a table."""

    heading: str
    poses: Sequence[Pose]
    columns: int | None = None


def frames(series: Sequence[Series]) -> AUFrames:
    """All poses of these series, one a second."""
    rows = np.stack([pose.row for part in series for pose in part.poses])
    return AUFrames(np.arange(len(rows), dtype=np.float64), rows)


def neutral() -> Series:
    """The face at rest, which all others are compared with."""
    return Series("", [Pose(_nothing(), "neutral")])


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


def _both_ways(row: Fap, value: float) -> list[Pose]:
    size = value * TURN / HALF if row.unit == "angle_unit" else value
    found = []
    for sign in (1, -1):
        amount = round(min(max(sign * size, row.least), row.most))
        if amount:
            far = (
                f"{np.degrees(amount * 1e-5):+.0f} degrees"
                if row.unit == "angle_unit"
                else f"{amount / 1024:+.2f} {row.unit}0"
            )
            # Some FAPs are named "lower" or "depress" and go up: say which way plus is.
            title, note = f"{row.fap} {row.name} {amount:+d}", f"{far}; + is {row.direction}"
            found.append(Pose(_faps({row.fap: amount}), title, (note,)))
    return found


def of_aus(intensity: float) -> list[Series]:
    """Each action unit on both sides, by place and direction."""
    names = by_number()
    return [
        Series(
            f"Action units: {region.name}",
            _poses(
                [{(number, "BOTH"): intensity} for number in region.members],
                [f"AU{number} {names[number].name}" for number in region.members],
                [names[number].no_fap or f"{intensity:g}" for number in region.members],
            ),
        )
        for region in au_regions()
    ]


def of_emotions() -> list[Series]:
    """The archetypes, and Paul's table of the wheel: 17 angles at 4 activations (2010, 6.4)."""
    known = archetypes()
    shown = _poses(
        [face_lexemes()[emotion.name].aus for emotion in known],
        [emotion.name.lower() for emotion in known],
        [f"{emotion.angle:g} degrees, activation {emotion.activation:g}" for emotion in known],
    )
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
        Series("Emotions: archetypes", shown),
        Series("Emotions: the wheel, weak to strong", grid, len(ACTIVATIONS)),
    ]


def of_expressions(expressions: Sequence[Expression]) -> list[Pose]:
    """Each expression of the library, at full intensity."""
    return _poses(
        [one.aus for one in expressions],
        [one.name for one in expressions],
        [one.units for one in expressions],
    )


def _poses(
    shown: Sequence[Mapping[tuple[int, str], float]], titles: Sequence[str], notes: Sequence[str]
) -> list[Pose]:
    """Poses of action units: (AU, side) -> intensity each."""
    found = []
    for aus, title, note in zip(shown, titles, notes, strict=True):
        row = _nothing()
        for (number, side), amount in aus.items():
            row[[target.column for target in au(number, side)]] = amount
        found.append(Pose(row, title, (note,)))
    return found


def _faps(values: Mapping[int, float]) -> Float32:
    row = _nothing()
    for number, value in values.items():
        row[fap(number).column] = value
    return row


def _nothing() -> Float32:
    return np.zeros(len(axis()), np.float32)
