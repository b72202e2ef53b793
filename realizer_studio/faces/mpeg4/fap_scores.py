"""Scores of a face's 127 FAP displacements against the MPEG-4 definitions.

Paul 2010 (4.4) scored displacements by eye: 3 correct, 2 slightly odd, 1 only the location is right, 0 no
displacement. Here rules compute the score, so that it is reproducible.
"""

from collections.abc import Collection
from dataclasses import dataclass
from functools import cache

from realizer.face.model import Face
from realizer.tables import Fap, csv_rows, faps
from realizer_studio.faces.mpeg4.fap_limits import ROLLED, accompanying_faps, usual_range
from realizer_studio.faces.mpeg4.fap_measures import (
    Measure,
    asymmetry_of,
    error_of,
    flips_of,
    roughness_of,
    side_effect_of,
)

HALF, TURN = 512.0, 20000.0  # FAPU, angle units: Paul judged half a face distance
# Limits for scores 3 and 2: error, mirror, side effect, share of area that flips, roughness; for 1: error.
# A hundredth of a percent of the moved skin is less than a pixel.
CORRECT = (0.02, 0.01, 0.05, 1e-4, 0.25)
ACCEPTABLE = (0.25, 0.15, 0.25, 0.02, 0.45)
RECOGNISABLE = 0.75
# The sentence for each fault, in the same order.
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
        fap, name, sign, weight: the FAP, its direction (+1 or -1), and its importance (Paul's w).
        error: of the feature point's displacement in the FAP's direction (or of the angle, or of the
            pupil's width).
        mirror: the largest difference from the mirror image of the other side's FAP.
        side_effect: the largest displacement of a point that must stay (the opposite lip or lid; FAP 3: all
            lips).
        flips: the share by area of the moved skin, including mouth and sockets, whose triangles turn by more
            than a right angle at the usual maximum, or by more than 120 degrees together with the other FAPs
            of the action unit that uses it most, because lips may roll.
        roughness: the difference of a vertex's displacement from the mean of its neighbours', the 95th
            percentile over visible skin that moves by more than 5 % of the largest displacement.
        usual: the usual maximum, in the FAP's unit.
        score: 3, 2, 1 or 0.
    """

    fap: int
    name: str
    sign: int
    weight: int
    error: float
    mirror: float
    side_effect: float
    flips: float
    roughness: float
    usual: float

    @property
    def faults(self) -> tuple[float, float, float, float, float]:
        return self.error, self.mirror, self.side_effect, self.flips, self.roughness

    @property
    def score(self) -> int:
        if all(fault <= most for fault, most in zip(self.faults, CORRECT, strict=True)):
            return 3
        if all(fault <= most for fault, most in zip(self.faults, ACCEPTABLE, strict=True)):
            return 2
        return 1 if self.error <= RECOGNISABLE else 0

    @property
    def reasons(self) -> tuple[str, ...]:
        """A sentence for each rule that keeps the score under 3."""
        return tuple(
            rule.format(fault)
            for rule, fault, most in zip(RULES, self.faults, CORRECT, strict=True)
            if fault > most
        )


def mean_score(truths: tuple[FapScore, ...]) -> float:
    """Return the mean score, weighted by the importance of the FAPs."""
    return sum(t.weight * t.score for t in truths) / sum(t.weight for t in truths)


def score_faps(face: Face, only: Collection[int] = ()) -> tuple[FapScore, ...]:
    """Return the 127 scores of FAPs 3 to 68 in each direction, or those of the FAPs in `only`."""
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
    """Return the importance of each FAP, 1, 2 or 3 (Paul 2010, table 4.3)."""
    return {row.fap: row.weight for row in csv_rows("fap_weights.csv", _Weight, __package__)}


def _score_fap(measure: Measure, row: Fap, sign: int) -> FapScore:
    top = usual_range(row.fap, sign)
    half = TURN if row.unit == "angle_unit" else min(HALF, row.most if sign > 0 else -row.least)
    half = top if row.direction == "growing" else half
    value = sign * half
    # The displacement must be correct in the range that Paul judged and in the usual range.
    values = [value] + ([sign * top] if top < half else [])
    moves = [measure.displacement({row.fap: v}) for v in values]
    return FapScore(
        fap=row.fap,
        name=row.name,
        sign=sign,
        weight=weights()[row.fap],
        error=max(error_of(measure, row, v, m) for v, m in zip(values, moves, strict=True)),
        mirror=asymmetry_of(measure, row, moves[0], measure.displacement({row.mirror: value * row.sign})),
        side_effect=side_effect_of(measure, row, values, moves),
        flips=max(
            flips_of(measure, row, {row.fap: sign * top}),
            flips_of(measure, row, accompanying_faps(row.fap, sign), ROLLED),
        ),
        roughness=roughness_of(measure, row, moves[0][measure.skin]),
        usual=top,
    )
