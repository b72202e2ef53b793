"""Scores of a face's 127 FAP displacements against the MPEG-4 definitions.

Paul 2010 (4.4) scored displacements by eye: 3 as it should look, 2 slightly odd, 1 only its place is
right, 0 nothing. Here rules give the score, so that it can be repeated.
"""

from collections.abc import Collection
from dataclasses import dataclass
from functools import cache

from realizer.face.model import Face
from realizer.tables import Fap, csv_rows, faps
from realizer_studio.faces.mpeg4.fap_limits import ROLLED, accompanying_faps, usual_range
from realizer_studio.faces.mpeg4.fap_measures import (
    Measure,
    error_of,
    flips_of,
    mirror_of,
    others_of,
    rough_of,
)

HALF, TURN = 512.0, 20000.0  # FAPU, angle units: half a face distance is what Paul looked at
# For scores 3 and 2: error, mirror, others, share of area that flips, roughness; and for 1: error.
# A hundredth of a percent of the moved skin is less than a pixel.
RIGHT = (0.02, 0.01, 0.05, 1e-4, 0.25)
ODD = (0.25, 0.15, 0.25, 0.02, 0.45)
KNOWN = 0.75
# What each fault is, in the same order.
RULES = (
    "its feature point goes {:.1%} too far, too short or astray",
    "left and right differ by {:.1%}",
    "a point that must stay goes along by {:.1%}",
    "{:.2%} of the moved skin turns over",
    "neighbours move apart by {:.0%}",
)


@dataclass(frozen=True, slots=True)
class FapScore:
    """The measures of one FAP in one direction, as shares of the requested movement.

    Attributes:
        fap, name, sign, weight: which, +1 or -1, and how much it matters (Paul's w).
        error: how far the feature point's move along its way (or the angle, or the pupil's width) is off.
        mirror: the largest difference from the twin's mirror image, of the largest move.
        others: the largest move of a point that must stay (the opposite lip or lid; FAP 3: all lips).
        flips: the share (by area) of the moved skin, mouth and sockets too, whose triangles turn by more
            than a right angle at the most that is usual; with all that the action unit asks for that asks
            most of it lips may roll, and a third of a turn counts.
        rough: 95th percentile, over the open skin that moves by more than 5 % of the largest move, of how
            far a vertex's move is from the mean of its neighbours', of the largest move.
        usual: the most that is usual, in the FAP's own unit.
        score: 3, 2, 1 or 0.
    """

    fap: int
    name: str
    sign: int
    weight: int
    error: float
    mirror: float
    others: float
    flips: float
    rough: float
    usual: float

    @property
    def faults(self) -> tuple[float, float, float, float, float]:
        return self.error, self.mirror, self.others, self.flips, self.rough

    @property
    def score(self) -> int:
        if all(fault <= most for fault, most in zip(self.faults, RIGHT, strict=True)):
            return 3
        if all(fault <= most for fault, most in zip(self.faults, ODD, strict=True)):
            return 2
        return 1 if self.error <= KNOWN else 0

    @property
    def reasons(self) -> tuple[str, ...]:
        """A sentence for each rule that keeps the score under 3."""
        return tuple(
            rule.format(fault)
            for rule, fault, most in zip(RULES, self.faults, RIGHT, strict=True)
            if fault > most
        )


def mean_score(truths: tuple[FapScore, ...]) -> float:
    """Return the mean weighted by how much each FAP matters."""
    return sum(t.weight * t.score for t in truths) / sum(t.weight for t in truths)


def score_faps(face: Face, only: Collection[int] = ()) -> tuple[FapScore, ...]:
    """Return the scores of the FAPs from 3 to 68 in each of their directions, 127, or of `only` some FAPs."""
    return tuple(
        _score_fap(Measure.of(face), row, sign)
        for row in faps()[2:]
        if not only or row.fap in only
        for sign in ((1, -1) if row.least < 0 else (1,))
    )


@dataclass(frozen=True)
class _Weight:
    fap: int
    weight: int


@cache
def weights() -> dict[int, int]:
    """Return how much each FAP matters (Paul 2010, table 4.3): 1, 2 or 3."""
    return {row.fap: row.weight for row in csv_rows("fap_weights.csv", _Weight, __package__)}


def _score_fap(measure: Measure, row: Fap, sign: int) -> FapScore:
    top = usual_range(row.fap, sign)
    half = TURN if row.unit == "angle_unit" else min(HALF, row.most if sign > 0 else -row.least)
    half = top if row.direction == "growing" else half
    value = sign * half
    # Both the range that Paul judged and the usual range must be right.
    asked = [value] + ([sign * top] if top < half else [])
    moves = [measure.moves({row.fap: v}) for v in asked]
    return FapScore(
        fap=row.fap,
        name=row.name,
        sign=sign,
        weight=weights()[row.fap],
        error=max(error_of(measure, row, v, m) for v, m in zip(asked, moves, strict=True)),
        mirror=mirror_of(measure, row, moves[0], measure.moves({row.mirror: value * row.sign})),
        others=others_of(measure, row, asked, moves),
        flips=max(
            flips_of(measure, row, {row.fap: sign * top}),
            flips_of(measure, row, accompanying_faps(row.fap, sign), ROLLED),
        ),
        rough=rough_of(measure, row, moves[0][measure.skin]),
        usual=top,
    )
