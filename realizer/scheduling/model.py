"""The numeric form of a problem: tied points as classes, gaps and orders as arrays."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import accumulate, chain
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from realizer.core import work
from realizer.core.array_types import Bool, Float64
from realizer.scheduling.graphs import UnionFind
from realizer.scheduling.problem import ORIGIN, Problem

Index: TypeAlias = npt.NDArray[np.intp]

# Two ways to the same point may differ by this much, by the rounding of sums.
LOOSE = 1e-7  # s
# Tolerance of an order: the rounding of double precision.
TIGHT = 1e-10  # s


@dataclass(slots=True, eq=False)
class Model:
    """n points (0 is the block's start), B behaviours, g gaps of behaviours that are not rigid."""

    problem: Problem
    # first, last: (B,) each behaviour's first and last point
    first: Index
    last: Index
    owner: Index  # (n,) behaviour of each point; B for the block's start
    # root, shift: (n,) time[p] = time[root[p]] + shift[p]; untied points are their own root
    root: Index
    shift: Float64
    tied: Index  # points other than the block's start that some equality names, ascending
    chain: Float64  # (n,) seconds after the behaviour's first point if every gap has its preferred length
    # (n,) the same for 1 / stiffness: how much a unit of force lengthens the gaps before a point
    slack: Float64
    gap: Index  # (g,) the point where each gap starts; it ends at the next point
    # wanted, least, most, stiffness: (g,) of each gap; most is inf if there is no upper bound
    wanted: Float64
    least: Float64
    most: Float64
    stiffness: Float64
    earliest: Float64  # (B,) the earliest time of each first point

    def points_of(self, chosen: Bool) -> Index:
        """Return the points of chosen behaviours; chosen is (B + 1,) bool, with its last entry False."""
        return np.flatnonzero(chosen[self.owner])

    def stated_lengths(self) -> tuple[Index, Index, Float64]:
        """Return successive tied points of behaviours that have one root, and the seconds between them."""
        of_one = self.owner[self.tied] * len(self.owner) + self.root[self.tied]
        tied = self.tied[np.argsort(of_one, kind="stable")]
        p, q = tied[:-1], tied[1:]
        same = (self.owner[p] == self.owner[q]) & (self.root[p] == self.root[q])
        p, q = p[same], q[same]
        return p, q, self.shift[q] - self.shift[p]


def model_of(problem: Problem) -> Model | list[int]:
    """Return the problem as arrays, or the numbers of the equalities that contradict those before them."""
    n = len(problem.owner)
    ties = UnionFind(n)
    contradicting = [
        k
        for k, (u, v, seconds, _, _) in enumerate(work.counted(problem.equalities))
        if abs(ties.tie(u, v, seconds)) > LOOSE
    ]
    if contradicting:
        return contradicting
    work.count(n // 4)
    named = {p for relation in problem.equalities for p in relation[:2]}
    named.discard(ORIGIN)
    tied = sorted(named)
    root, shift = np.arange(n), np.zeros(n)
    root[tied] = [ties.find(p) for p in tied]
    shift[tied] = [ties.shift[p] for p in tied]

    work.count(n // 4)
    timings = problem.timings
    first = np.array(problem.first, np.intp)
    owner = np.array(problem.owner, np.intp)
    owner[ORIGIN] = len(timings)
    flexible = [(p, timing) for p, timing in zip(problem.first, timings, strict=True) if not timing.rigid]
    gap = [k for p, timing in flexible for k in range(p, p + len(timing.preferred))]
    work.count(n // 4)
    wanted, stiffness, least = (
        np.concatenate([np.zeros(0), *(getattr(timing, name) for _, timing in flexible)])
        for name in ("preferred", "stiffness", "least")
    )
    most = [np.full(t.preferred.shape, np.inf) if t.most is None else t.most for _, t in flexible]
    work.count(n // 4)
    return Model(
        problem,
        first,
        np.append(first[1:], n) - 1,
        owner,
        root,
        shift,
        np.array(tied, np.intp),
        _along(t.preferred for t in timings),
        _along(np.ones(len(t.preferred)) if t.rigid else 1.0 / t.stiffness for t in timings),
        np.array(gap, np.intp),
        wanted,
        least,
        np.concatenate([np.zeros(0), *most]),
        stiffness,
        np.array(problem.earliest),
    )


def drop_least_gaps(least: list[float], points: Iterable[tuple[int, tuple[int, float]]]) -> None:
    """Drop least gaps of a behaviour, in place, within a shorter stated length.

    `points` are (place in the behaviour, (root, shift)) in order; those that no equality names may be absent.
    """
    seen: dict[int, tuple[int, float]] = {}
    for place, (root, shift) in points:
        if root in seen:
            begin, before = seen[root]
            if -LOOSE <= shift - before < sum(least[begin:place]) - TIGHT:
                least[begin:place] = [0.0] * (place - begin)
        seen[root] = place, shift


def _along(lengths: Iterable[Float64]) -> Float64:
    """Return (n,) the sum of a behaviour's lengths before each of its points; 0 for the block's start."""
    sums = (accumulate(own.tolist(), initial=0.0) for own in lengths)
    return np.array([0.0, *chain.from_iterable(sums)])
