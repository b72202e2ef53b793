"""Action units that were asked for -> those that a face can show together (Wojdel 2005, 5.2)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from realizer.animation.targets import AU_NAMES
from realizer.arrays import Bool, Float32
from realizer.tables.cooccurrence import Rule, Rules, Unit

__all__ = ["Shown", "cooccur"]

Index = npt.NDArray[np.intp]


class Shown(NamedTuple):
    """What is left of the units that were asked for.

    Attributes:
        aus: (n_au, n) float32, 0..1: what a coder of the face would score.
        held: (n_au, n) float32: what another unit's own appearance holds (the parting of the lips in a jaw
            that drops). It is not scored, but it does not leave the face.
    """

    aus: Float32
    held: Float32


def cooccur(aus: Float32, rules: Rules) -> Shown:
    """Apply all rules at once: each reads what came in, and a unit keeps the least that any rule leaves it.

    So the order of rules does not matter, a second pass changes nothing, and a small change of what comes in
    is a small change of what comes out (at most twice as large).

    Args:
        aus: (n_au, n) float32 intensities 0..1, rows named by `AU_NAMES()`.
        rules: the rules; domination eq. 5.2, 5.5, 5.7, 5.8; exclusion eq. 5.9; opposition eq. 5.10.
    """
    compiled = _compile(_Key(rules))
    left = _least(aus, compiled.taking)
    first, second = compiled.opposed
    if aus[first].any() and aus[second].any():
        left[first] = np.minimum(left[first], np.maximum(aus[first] - aus[second], 0))
        left[second] = np.minimum(left[second], np.maximum(aus[second] - aus[first], 0))
    shown = np.minimum(left, _least(aus, compiled.holding))
    return Shown(shown, left - shown)


@dataclass(frozen=True, eq=False)
class Terms:
    """Rules that bound a unit by 1 - min(m(a), m(b)), m being membership in a fuzzy set.

    Attributes:
        weaker: (m,) the row of the unit, rising.
        stronger: (2, m) of `rows`: a and b, twice the same where there is one.
        rows: (2, k) the rows of a unit that is stronger somewhere, of two sides; twice the same where one.
        start, low, high: (k, 1) its membership at 0, and the slopes below and above 0.5.
    """

    weaker: Index
    stronger: Index
    rows: Index
    start: Float32
    low: Float32
    high: Float32


@dataclass(frozen=True, eq=False)
class Compiled:
    """`taking` takes from the face, `holding` from the score alone; `opposed` (2, k) rows face each other."""

    taking: Terms
    holding: Terms
    opposed: Index


def _least(aus: Float32, terms: Terms) -> Float32:
    """(n_au, n): what the terms leave of each unit."""
    left = aus.copy()
    up: Bool = np.asarray(aus.any(axis=1), bool)
    strong: Bool = np.asarray(up[terms.rows].any(axis=0), bool)
    live = np.flatnonzero(up[terms.weaker] & strong[terms.stronger].all(axis=0))
    if not len(live):
        return left
    value = np.maximum(aus[terms.rows[0]], aus[terms.rows[1]])  # (k, n): of two sides the stronger
    half = np.minimum(value, np.float32(0.5))
    degree = terms.start + terms.low * half + terms.high * (value - half)
    first, second = terms.stronger[:, live]
    bound = 1 - np.minimum(degree[first], degree[second])
    weaker = terms.weaker[live]
    begin = np.flatnonzero(np.diff(weaker, prepend=-1))
    which = weaker[begin]
    left[which] = np.minimum(left[which], np.minimum.reduceat(bound, begin, axis=0))
    return left


class _Key:
    """A file of rules by identity, so that it is compiled once."""

    def __init__(self, rules: Rules) -> None:
        self.rules = rules

    def __hash__(self) -> int:
        return id(self.rules)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and other.rules is self.rules


@lru_cache(maxsize=8)
def _compile(key: _Key) -> Compiled:
    rules = key.rules
    opposed = [
        (row, _rows(rule.stronger[0].au, side)[0])
        for rule in rules.rules
        if rule.kind == "opposition"
        for row, side in _sides(rule.weaker)
    ]
    return Compiled(
        _terms([rule for rule in rules.rules if rule.kind in ("domination", "exclusion")], rules),
        _terms([rule for rule in rules.rules if rule.kind == "inclusion"], rules),
        np.array(opposed, np.intp).reshape(-1, 2).T,
    )


def _terms(chosen: list[Rule], rules: Rules) -> Terms:
    lines = sorted(
        (row, [(_rows(unit.au, side), _membership(unit, rule, rules)) for unit in _pair(rule)])
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


def _pair(rule: Rule) -> tuple[Unit, Unit]:
    return rule.stronger[0], rule.stronger[-1]


def _membership(unit: Unit, rule: Rule, rules: Rules) -> tuple[float, float, float]:
    """Of the stronger unit at 0, 0.5 and 1; an excluding one counts as far as it is not small."""
    if rule.kind in ("exclusion", "inclusion"):
        small = rules.sets["X"]
        return 1 - small[0], 1 - small[1], 1 - small[2]
    return rules.sets[unit.set] if unit.set else (0.0, 0.5, 1.0)


def _sides(number: int) -> list[tuple[int, str]]:
    """(row, side) of each side of an AU; side "" where it has one row."""
    names = AU_NAMES()
    if str(number) in names:
        return [(names.index(str(number)), "")]
    return [(names.index(f"{number}{side}"), side) for side in "LR"]


def _rows(number: int, side: str) -> tuple[int, int]:
    """The rows of a stronger unit that count for a weaker one on `side`: its own side, or both."""
    rows = _sides(number)
    own = [row for row, other in rows if not side or not other or other == side]
    return own[0], own[-1]
