"""Clusters of behaviours that are tied together, each at the least squares solution of its gaps.

Behaviours tied without a contradiction keep their preferred gaps; only the rest needs a solver.
"""

from dataclasses import dataclass

import numpy as np

from realizer.core import work
from realizer.core.array_types import Bool, Float64
from realizer.scheduling.graphs import UnionFind
from realizer.scheduling.model import Index, Model
from realizer.scheduling.problem import ORIGIN
from realizer.scheduling.quadratic_program import symmetric_solution

# Lengths that differ by less than this count as equal.
FITS = 1e-9  # s
# From this many unknowns on a sparse factorisation is as fast; and OpenBLAS starts threads for a dense one of
# 90, which costs hundreds of milliseconds if the cores are busy.
SPARSE_FROM = 64
# From this many unknowns on Clarabel is faster than SuperLU, and other work goes on meanwhile.
MANY = 2_000


@dataclass(slots=True, eq=False)
class RigidClusters:
    """The clusters of tied behaviours, and the positions of their points."""

    label: Index  # (B + 1,) the cluster of each behaviour, named by one of them; B is the block's start
    held: Bool  # (B + 1,) bool by label: the cluster is tied to a fixed time and cannot slide
    at: Float64  # (n,) seconds: from the block's start for fixed clusters, relative for others


def clusters_of(model: Model) -> RigidClusters:
    """Return the clusters of all behaviours, each at its least squares solution without inequalities."""
    size = len(model.first)
    tied = model.tied
    # The seconds from the root of a point's class to the first point of its behaviour.
    ahead = (model.shift[tied] - model.chain[tied]).tolist()
    ties = UnionFind(
        size
    )  # of first points; behaviours are attached to each other at their preferred lengths
    strained: list[int] = []  # those that do not fit
    held_at: list[tuple[int, float]] = []  # of each point at a fixed time: the seconds of its first point
    hook: dict[int, tuple[int, float]] = {}
    knots = zip(model.owner[tied].tolist(), model.root[tied].tolist(), ahead, strict=True)
    for b, root, start in work.counted(knots):
        if root == ORIGIN:
            held_at.append((b, start))
            continue
        other, other_start = hook.setdefault(root, (b, start))
        if abs(ties.tie(b, other, start - other_start)) > FITS:
            strained.append(b)
    label = np.array([*map(ties.find, range(size)), size])
    base = np.array([*ties.shift, 0.0])
    held = np.zeros(size + 1, np.bool_)
    held[size] = True
    fixed: dict[int, float] = {}
    for b, time in held_at:
        shape = ties.find(b)
        start = time - ties.shift[b]
        if abs(fixed.setdefault(shape, start) - start) > FITS:
            strained.append(b)
    if fixed:
        names = list(fixed)
        held[names] = True
        moved = np.zeros(size + 1)
        moved[names] = list(fixed.values())
        base += moved[label]
    at = base[model.owner] + model.chain
    clusters = RigidClusters(label, held, at)
    if strained:
        bent = np.zeros(size + 1, np.bool_)
        bent[[ties.find(b) for b in strained]] = True
        _relax(model, clusters, bent[label])
    return clusters


def _relax(model: Model, clusters: RigidClusters, chosen: Bool) -> None:
    """Move the points of whole clusters, in place, to the least sum of a (gap - preferred)^2.

    A stretch between two tied points is one spring, whatever is between; so only tied points are unknowns.
    """
    owner, chain, slack = model.owner, model.chain, model.slack
    knots = model.tied[chosen[owner[model.tied]]]
    same = owner[knots[:-1]] == owner[knots[1:]]
    p, q = knots[:-1][same], knots[1:][same]
    length, give = chain[q] - chain[p], slack[q] - slack[p]
    roots = model.root[knots]
    nodes = _each(roots, len(owner))
    number = np.empty(len(owner), np.intp)
    number[nodes] = np.arange(len(nodes))
    number = number[roots]
    i, j = number[:-1][same], number[1:][same]
    loose = i != j
    # The block's start is at 0. A free cluster can have any point at 0: it slides to its place later.
    fixed = nodes == ORIGIN
    labels = clusters.label[owner[knots]]
    first = np.empty(len(clusters.label), np.intp)
    first[labels[::-1]] = number[::-1]
    fixed[first[labels[~clusters.held[labels]]]] = True
    wanted = length - model.shift[q] + model.shift[p]
    x = least_squares(i[loose], j[loose], wanted[loose], 1.0 / give[loose], fixed, np.zeros(len(nodes)))
    time = x[number] + model.shift[knots]
    # Lengthening per unit of slack after each knot; 0 after a behaviour's last one.
    strain = np.zeros(len(knots))
    strain[:-1][same] = (time[1:][same] - time[:-1][same] - length) / give
    points = model.points_of(chosen)
    place = np.searchsorted(knots, points, side="right") - 1
    before = (place >= 0) & (owner[knots[place]] == owner[points])
    place = np.where(before, place, np.minimum(place + 1, len(knots) - 1))
    knot = knots[place]
    pull = np.where(before, strain[place], 0.0)
    clusters.at[points] = time[place] + (chain[points] - chain[knot]) + pull * (slack[points] - slack[knot])


def warm_up() -> None:
    """Import the modules for large blocks, which takes a third of a second."""
    chain = np.arange(SPARSE_FROM)
    ones, fixed = np.ones(SPARSE_FROM), np.zeros(SPARSE_FROM + 1, np.bool_)
    fixed[0] = True
    least_squares(chain, chain + 1, ones, ones, fixed, np.zeros(SPARSE_FROM + 1))


def _each(numbers: Index, size: int) -> Index:
    """Return some numbers below a size once each, ascending; faster than np.unique for few numbers."""
    present = np.zeros(size, np.bool_)
    present[numbers] = True
    return np.flatnonzero(present)


def least_squares(
    i: Index, j: Index, wanted: Float64, stiffness: Float64, fixed: Bool, x: Float64
) -> Float64:
    """Return x, (m,), that minimises the sum of stiffness * (x[j] - x[i] - wanted)^2 over s springs.

    Args:
        i, j, wanted, stiffness: (s,) the two nodes of each spring, its length and stiffness.
        fixed: (m,) bool; at least one node of each set that springs connect.
        x: (m,) the positions of the fixed nodes.
    """
    free = np.flatnonzero(~fixed)
    n = len(free)
    if not n:
        return x
    work.count(5 * n)
    # Node n represents all fixed points, and is removed.
    number = np.full(len(x), n)
    all_free = np.arange(n)
    number[free] = all_free
    pull = stiffness * (wanted - (x[j] * fixed[j] - x[i] * fixed[i]))
    i, j = number[i], number[j]
    right = (np.bincount(j, pull, n + 1) - np.bincount(i, pull, n + 1))[:n]
    between = (i < n) & (j < n)
    one, other, stiff = i[between], j[between], -stiffness[between]
    whole = (np.bincount(i, stiffness, n + 1) + np.bincount(j, stiffness, n + 1))[:n]
    if n > MANY:
        low, high = np.minimum(one, other), np.maximum(one, other)
        triangle = np.concatenate([low, all_free]), np.concatenate([high, all_free])
        found = symmetric_solution(triangle, np.concatenate([stiff, whole]), right.astype(float))
    else:
        rows, columns = np.concatenate([one, other, all_free]), np.concatenate([other, one, all_free])
        values = np.concatenate([stiff, stiff, whole])
        if n < SPARSE_FROM:
            matrix = np.bincount(rows * n + columns, values, n * n).reshape(n, n)
            found = np.linalg.solve(matrix, right)
        else:
            from scipy.sparse import csc_array
            from scipy.sparse.linalg import splu

            sparse = csc_array((values, (rows, columns)), shape=(n, n))
            found = splu(sparse, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(right)
    y = x.copy()
    y[free] = found
    return y
