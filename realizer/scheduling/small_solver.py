"""A fast solver for small problems without violated inequalities.

Most blocks are such: a handful of behaviours, no orders, and time enough for all. For so few numbers arrays
are slower than floats; so this does the same as `solve` with plain floats, and gives up in harder cases.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from realizer.scheduling.graphs import UnionFind
from realizer.scheduling.model import LOOSE, TIGHT
from realizer.scheduling.problem import ORIGIN, Problem
from realizer.scheduling.rigid_clusters import FITS, SPARSE_FROM, attach
from realizer.scheduling.timing import TimingArrays

NEVER = float("-inf")


class _Knot(NamedTuple):
    """A point of a behaviour that an equality names: its index, and its position: root + shift."""

    place: int
    root: int
    shift: float


def solve_small(problem: Problem) -> tuple[list[float], float] | None:
    """Return (points,) seconds from the block's start, and the cost, as in a Solution.

    Return None if an order, a conflict, the length of a gap or an early start must be handled.
    """
    if problem.orders:
        return None
    ties = UnionFind(len(problem.owner))
    named: set[int] = set()
    for u, v, seconds, _, _ in problem.equalities:
        if abs(ties.tie(u, v, seconds)) > LOOSE:
            return None
        named.add(u)
        named.add(v)
    named.discard(ORIGIN)
    lists = [timing.arrays for timing in problem.timings]
    knots: list[list[_Knot]] = [[] for _ in lists]
    hooks: list[tuple[int, int, float]] = []
    for p in sorted(named):
        b = problem.owner[p]
        place, root, shift = p - problem.first[b], ties.find(p), ties.shift[p]
        knots[b].append(_Knot(place, root, shift))
        hooks.append((b, root, shift - lists[b].chain[place]))

    # Tied behaviours at their preferred lengths; then the clusters that must stretch.
    shapes, strained, held_at = attach(len(lists), hooks)
    labels = [shapes.find(b) for b in range(len(lists))]
    begins: dict[int, float] = {}
    for b, start in held_at:
        begin = start - shapes.shift[b]
        if abs(begins.setdefault(labels[b], begin) - begin) > FITS:
            strained.append(b)
    at: list[list[float]] = []
    for b, own in enumerate(lists):
        start = begins.get(labels[b], 0.0) + shapes.shift[b]
        at.append([start + seconds for seconds in own.chain])
    cost = 0.0
    bent = dict.fromkeys(labels[b] for b in strained)
    for label in bent:
        members = [b for b, other in enumerate(labels) if other == label]
        left = _relax(lists, knots, members, at)
        if left is None:
            return None
        cost += left

    late = dict.fromkeys(labels, NEVER)
    for b, label in enumerate(labels):
        late[label] = max(late[label], problem.earliest[b] - at[b][0])
    if any(late[label] > TIGHT for label in begins):
        return None
    for own, label, times in zip(lists, labels, at, strict=True):
        if not own.rigid and not (own.fits and label not in bent) and not _fits(times, own):
            return None
    time = [0.0]
    for label, times in zip(labels, at, strict=True):
        slide = 0.0 if label in begins or late[label] == NEVER else late[label]
        time += [seconds + slide for seconds in times]
    # Remove rounding errors from equalities, orders and earliest starts.
    for p in named:
        time[p] = time[ties.find(p)] + ties.shift[p]
    for first, own, earliest in zip(problem.first, lists, problem.earliest, strict=True):
        time[first] = max(time[first], earliest)
        for p in range(first + 1, first + len(own.chain)):
            if time[p] < time[p - 1]:
                time[p] = time[p - 1]
    return time, cost


def _fits(at: list[float], own: TimingArrays) -> bool:
    for begin, end, least in zip(at, at[1:], own.least, strict=False):
        if end - begin < least - TIGHT or end < begin:
            return False
    if own.most is None:
        return True
    gaps = zip(at, at[1:], own.most, strict=False)
    return all(end - begin <= most + TIGHT for begin, end, most in gaps)


def _relax(
    lists: list[TimingArrays], knots: list[list[_Knot]], members: Sequence[int], at: list[list[float]]
) -> float | None:
    """Move the points of a cluster, in place, to the least sum of a (gap - preferred)^2; return that sum.

    A stretch between two knots is one spring, whatever is between. Return None for many unknowns.
    """
    # The block's start is at 0; a free cluster has its first knot at 0, and slides to its place later.
    roots = {knot.root for b in members for knot in knots[b]}
    still = ORIGIN if ORIGIN in roots else knots[members[0]][0].root
    number = {root: n for n, root in enumerate(sorted(roots - {still}))}
    size = len(number)
    if size >= SPARSE_FROM:
        return None
    matrix, pull = [[0.0] * size for _ in range(size)], [0.0] * size
    for b in members:
        chain, slack = lists[b].chain, lists[b].slack
        for p, q in pairwise(knots[b]):
            if p.root == q.root:
                continue
            stiff = 1.0 / (slack[q.place] - slack[p.place])
            force = stiff * (chain[q.place] - chain[p.place] - q.shift + p.shift)
            i, j = number.get(p.root), number.get(q.root)
            if i is not None:
                matrix[i][i] += stiff
                pull[i] -= force
            if j is not None:
                matrix[j][j] += stiff
                pull[j] += force
            if i is not None and j is not None:
                matrix[i][j] -= stiff
                matrix[j][i] -= stiff
    found = np.linalg.solve(matrix, pull).tolist() if size else []
    cost = 0.0
    where = {still: 0.0} | {root: found[n] for root, n in number.items()}
    for b in members:
        chain, slack = lists[b].chain, lists[b].slack
        places = [knot.place for knot in knots[b]]
        times = [where[knot.root] + knot.shift for knot in knots[b]]
        # Each stretch from a knot to the next; before the first and after the last there is no strain.
        own = [times[0] + seconds - chain[places[0]] for seconds in chain[: places[0]]]
        for n, (place, time) in enumerate(zip(places, times, strict=True)):
            end, strain = len(chain), 0.0
            if n + 1 < len(places):
                end = places[n + 1]
                give = slack[end] - slack[place]
                strain = (times[n + 1] - time - (chain[end] - chain[place])) / give
                cost += 0.0 if lists[b].rigid else strain * strain * give
            own += [
                time + (chain[k] - chain[place]) + strain * (slack[k] - slack[place])
                for k in range(place, end)
            ]
        at[b] = own
    return cost
