"""Co-occurrence rules, which reduce action units to what a face can show together (Wojdel 2005, 5.2).

All rules are applied at once: each reads the requested intensities, and a unit keeps the least value that any
rule allows. So the order of rules does not matter, a second pass changes nothing, and a small change of the
input changes the output by at most twice as much. Domination is eq. 5.2, 5.5, 5.7, 5.8; exclusion eq. 5.9;
opposition eq. 5.10.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import groupby
from operator import itemgetter

import numpy as np

from realizer.animation.axis import au
from realizer.core.array_types import Bool, Float32, Index
from realizer.tables.cooccurrence import Rule, Rules, Unit


@dataclass(frozen=True, eq=False)
class Terms:
    """Rules that limit a unit to 1 - min(m(a), m(b)), where m is membership in a fuzzy set."""

    units: Index  # (g,) the rows of the limited units
    # (2, m, g) indices into `rows` of a and b, which may be equal; some rules may be repeated
    stronger: Index
    rows: Index  # (2, k) the rows of both sides of a stronger unit, which may be equal
    # start, low, high: (k, 1) its membership at 0, and the slopes below and above 0.5
    start: Float32
    low: Float32
    high: Float32

    def lower(self, left: Float32, aus: Float32) -> None:
        """Reduce `left` (n_au, n), in place, to what the intensities `aus` (n_au, n) allow."""
        live: Bool = (aus != 0).any(axis=1)
        acting: Bool = live[self.rows].any(axis=0) | (self.start[:, 0] > 0)
        # A unit that is 0 cannot be reduced, and a rule without movement reduces nothing.
        limited = live[self.units] & acting[self.stronger].all(axis=0).any(axis=0)
        if not limited.any():
            return
        units = self.units[limited]
        value = np.maximum(*aus.take(self.rows, axis=0))  # (k, n): the stronger of two sides
        half = np.minimum(value, np.float32(0.5))
        value -= half
        value *= self.high
        half *= self.low
        half += self.start
        half += value
        degree = np.minimum(*half.take(self.stronger[..., limited], axis=0))
        left[units] = np.minimum(left[units], 1 - degree.max(axis=0, initial=0))


@dataclass(frozen=True, eq=False)
class Bounds:
    """Rules as arrays.

    `taking` reduces movement; `holding` reduces the score alone, by units whose appearance includes another
    one (the lips part when the jaw drops); `opposed` is (2, k).
    """

    taking: Terms
    holding: Terms
    opposed: Index

    def moving(self, requested: Float32) -> Float32:
        """Return the part (n_au, n) of requested intensities that moves the face, scored or not."""
        left = requested.copy()
        pairs = requested.take(self.opposed, axis=0)  # (2, k, n)
        pairs -= np.minimum(*pairs)
        left[self.opposed] = pairs
        self.taking.lower(left, requested)
        return left

    def scored(self, requested: Float32, moving: Float32) -> Float32:
        """Return the part (n_au, n) of `moving` (n_au, n) that a FACS coder would score."""
        left = moving.copy()
        self.holding.lower(left, requested)
        return left


@lru_cache(maxsize=8)
def bounds(rules: Rules) -> Bounds:
    opposed = [
        (row, _rows(rule.stronger[0].au, side)[0])
        for rule in rules.rules
        if rule.kind == "opposition"
        for row, side in _sides(rule.weaker)
    ]
    return Bounds(
        _terms([rule for rule in rules.rules if rule.kind in ("domination", "exclusion")], rules),
        _terms([rule for rule in rules.rules if rule.kind == "inclusion"], rules),
        np.array(opposed, np.intp).reshape(-1, 2).T,
    )


def _terms(chosen: list[Rule], rules: Rules) -> Terms:
    lines = []
    for rule in chosen:
        for row, side in _sides(rule.weaker):
            units = rule.stronger[0], rule.stronger[-1]
            lines.append((row, [(_rows(u.au, side), _membership(u, rule, rules)) for u in units]))
    lines.sort()
    distinct = list(dict.fromkeys(member for _, pair in lines for member in pair))
    terms = {
        row: [tuple(map(distinct.index, pair)) for _, pair in own]
        for row, own in groupby(lines, itemgetter(0))
    }
    most = max(map(len, terms.values()), default=0)
    stronger = [own + own[:1] * (most - len(own)) for own in terms.values()]
    sets = np.array([degrees for _, degrees in distinct], np.float32).reshape(-1, 3)
    at_0, at_half, at_1 = (sets[:, i : i + 1] for i in range(3))
    return Terms(
        np.array(list(terms), np.intp),
        np.array(stronger, np.intp).reshape(len(terms), most, 2).T,
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
    return [(target.column, target.name.lstrip("0123456789")) for target in au(number)]


def _rows(number: int, side: str) -> tuple[int, int]:
    """Return the rows of a stronger unit that act on a weaker one on `side`: of the same side, or both."""
    rows = _sides(number)
    own = [row for row, other in rows if not side or not other or other == side]
    return own[0], own[-1]
