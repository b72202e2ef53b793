"""Co-occurrence rules, which reduce action units to what a face can show together (Wojdel 2005, 5.2).

All rules are applied at once: each reads the requested intensities, and a unit keeps the least value that any
rule allows. So the order of rules does not matter, a second pass changes nothing, and a small change of the
input changes the output by at most twice as much. Domination is eq. 5.2, 5.5, 5.7, 5.8; exclusion eq. 5.9;
opposition eq. 5.10.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from realizer.animation.axis import AU_NAMES
from realizer.animation.group_reduce import GroupReduction
from realizer.core.array_types import Bool, Float32, Index
from realizer.tables.cooccurrence import Rule, Rules, Unit


@dataclass(frozen=True, eq=False)
class Terms:
    """Rules that limit a unit to 1 - min(m(a), m(b)), where m is membership in a fuzzy set.

    Attributes:
        weaker: (m,) the row of the limited unit, rising.
        stronger: (2, m) indices into `rows` of a and b, which may be equal.
        rows: (2, k) the rows of both sides of a stronger unit, which may be equal.
        start, low, high: (k, 1) its membership at 0, and the slopes below and above 0.5.
    """

    weaker: Index
    stronger: Index
    rows: Index
    start: Float32
    low: Float32
    high: Float32

    def among(self, row: Index) -> Bound | None:
        """Return the limits among active units, or None if there are none.

        Args:
            row: (n_au,) the row of each active unit, -1 for other units.
        """
        up = row >= 0
        strong: Bool = up[self.rows[0]] | up[self.rows[1]]
        terms = np.flatnonzero(up[self.weaker] & strong[self.stronger].all(axis=0))
        if not len(terms):
            return None
        rounds = GroupReduction.of(self.weaker[terms])
        used, stronger = np.unique(self.stronger[:, terms[rounds.order]], return_inverse=True)
        one, other = row[self.rows[:, used]]
        return Bound(
            row[rounds.groups],
            rounds,
            stronger.reshape(2, -1),
            np.stack([np.where(one < 0, other, one), np.where(other < 0, one, other)]),
            self.start[used],
            self.low[used],
            self.high[used],
        )


@dataclass(frozen=True, eq=False)
class Bound:
    """The `Terms` of active units, by their rows; terms are ordered as `rounds`, `units` as its groups."""

    units: Index
    rounds: GroupReduction
    stronger: Index
    rows: Index
    start: Float32
    low: Float32
    high: Float32

    def lower(self, left: Float32, aus: Float32) -> None:
        """Reduce `left` (u, n), in place, to what the intensities `aus` (u, n) allow."""
        value = np.maximum(*aus.take(self.rows, axis=0))  # (k, n): the stronger of two sides
        half = np.minimum(value, np.float32(0.5))
        value -= half
        value *= self.high
        half *= self.low
        half += self.start
        half += value
        degree = np.minimum(*half.take(self.stronger, axis=0))
        most = self.rounds.reduced(degree, np.maximum)
        left[self.units] = np.minimum(left[self.units], 1 - most)


@dataclass(frozen=True, eq=False)
class Bounds:
    """The rules among active units, by their rows.

    `taking` reduces movement; `holding` reduces the score alone, by units whose appearance includes another
    one (the lips part when the jaw drops); `opposed` is (2, k).
    """

    taking: Bound | None
    holding: Bound | None
    opposed: Index

    def moving(self, requested: Float32) -> Float32:
        """Return the part (u, n) of requested intensities that moves the face, scored or not."""
        if self.taking is None and not self.opposed.size:
            return requested
        left = requested.copy()
        if self.opposed.size:
            pairs = requested.take(self.opposed, axis=0)  # (2, k, n)
            pairs -= np.minimum(*pairs)
            left[self.opposed] = pairs
        if self.taking is not None:
            self.taking.lower(left, requested)
        return left

    def scored(self, requested: Float32, moving: Float32) -> Float32:
        """Return the part (u, n) of `moving` (u, n) that a FACS coder would score."""
        if self.holding is None:
            return moving
        left = moving.copy()
        self.holding.lower(left, requested)
        return left


# Sessions repeat a few sets of units; each entry takes 5 kB.
@lru_cache(maxsize=512)
def bounds(rules: Rules, live: tuple[int, ...]) -> Bounds:
    """Return the rules among the units in rows `live`, rising, which are the ones that may differ from 0."""
    taking, holding, opposed = _compile(rules)
    row = np.full(len(AU_NAMES()), -1)
    row[list(live)] = np.arange(len(live))
    return Bounds(taking.among(row), holding.among(row), row[opposed[:, (row[opposed] >= 0).all(axis=0)]])


@lru_cache(maxsize=8)
def _compile(rules: Rules) -> tuple[Terms, Terms, Index]:
    opposed = [
        (row, _rows(rule.stronger[0].au, side)[0])
        for rule in rules.rules
        if rule.kind == "opposition"
        for row, side in _sides(rule.weaker)
    ]
    return (
        _terms([rule for rule in rules.rules if rule.kind in ("domination", "exclusion")], rules),
        _terms([rule for rule in rules.rules if rule.kind == "inclusion"], rules),
        np.array(opposed, np.intp).reshape(-1, 2).T,
    )


def _terms(chosen: list[Rule], rules: Rules) -> Terms:
    lines = sorted(
        (
            row,
            [
                (_rows(unit.au, side), _membership(unit, rule, rules))
                for unit in (rule.stronger[0], rule.stronger[-1])
            ],
        )
        for rule in chosen
        for row, side in _sides(rule.weaker)
    )
    distinct = list(dict.fromkeys(member for _, pair in lines for member in pair))
    sets = np.array([degrees for _, degrees in distinct], np.float32).reshape(-1, 3)
    at_0, at_half, at_1 = (sets[:, i : i + 1] for i in range(3))
    return Terms(
        np.array([row for row, _ in lines], np.intp),
        np.array([[distinct.index(m) for m in pair] for _, pair in lines], np.intp).reshape(-1, 2).T,
        np.array([rows for rows, _ in distinct], np.intp).reshape(-1, 2).T,
        at_0,
        2 * (at_half - at_0),
        2 * (at_1 - at_half),
    )


def _membership(unit: Unit, rule: Rule, rules: Rules) -> tuple[float, float, float]:
    """Return the membership of the stronger unit at 0, 0.5 and 1; an excluding unit counts if not small."""
    if rule.kind in ("exclusion", "inclusion"):
        small = rules.sets["X"]
        return 1 - small[0], 1 - small[1], 1 - small[2]
    return rules.sets[unit.set] if unit.set else (0.0, 0.5, 1.0)


def _sides(number: int) -> list[tuple[int, str]]:
    """Return (row, side) for each side of an AU; side is "" if it has a single row."""
    names = AU_NAMES()
    if str(number) in names:
        return [(names.index(str(number)), "")]
    return [(names.index(f"{number}{side}"), side) for side in "LR"]


def _rows(number: int, side: str) -> tuple[int, int]:
    """Return the rows of a stronger unit that act on a weaker one on `side`: of the same side, or both."""
    rows = _sides(number)
    own = [row for row, other in rows if not side or not other or other == side]
    return own[0], own[-1]
