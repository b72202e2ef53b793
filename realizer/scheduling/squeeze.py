"""Shapes that break an inequality in, the convex optimum that keeps all of them out; or why there is none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from realizer.arrays import Bool, Float64
from realizer.scheduling.clash import Clash, Link, cycle_clash
from realizer.scheduling.model import LOOSE, TIGHT, Index, Model
from realizer.scheduling.paths import raise_levels
from realizer.scheduling.problem import ORIGIN, Relation
from realizer.scheduling.shapes import settle
from realizer.scheduling.ties import Ties

__all__ = ["squeeze"]

# Rounds of taking in what exact arithmetic shows to be broken after the interior point; one is the rule.
ROUNDS = 8


@dataclass(slots=True, eq=False)
class _Quadratic:
    """Minimise the sum of stiffness * (x[gj] - x[gi] - wanted)^2 where x[v] - x[u] >= w; x[0] is 0."""

    nodes: Index
    gi: Index
    gj: Index
    wanted: Float64
    stiffness: Float64
    u: Index
    v: Index
    w: Float64


def squeeze(
    model: Model, chosen: Bool, orders: Sequence[Relation], at: Float64, *, held: bool
) -> Clash | None:
    """Put the points of some shapes, in place, at the least cost that keeps gaps and orders.

    Args:
        chosen: (B + 1,) bool, the behaviours; the last entry is False.
        orders: the orders among them and, if held, to the block's start.
        at: (n,) where the points are now; only those of the behaviours chosen change.
        held: they cannot slide, so that nothing of them may be sooner than their earliest start.

    Returns:
        None, or what makes it impossible; `at` is untouched then.
    """
    gaps = np.flatnonzero(chosen[model.owner[model.gap]])
    starts = model.first[np.flatnonzero(chosen[:-1])] if held else np.zeros(0, np.intp)
    points = model.points_of(chosen)
    quadratic = _quadratic(model, points, gaps, orders, starts, held)
    start = at[quadratic.nodes] - at[quadratic.nodes[0]]
    level, cycle = _feasible(quadratic, start)
    if cycle and _yield_to_stated(model, gaps):
        quadratic = _quadratic(model, points, gaps, orders, starts, held)
        level, cycle = _feasible(quadratic, start)
    if cycle:
        return cycle_clash(model.problem, [_link(model, k, gaps, orders, starts) for k in cycle])
    x = _optimum(quadratic, level)
    at[points] = x[np.searchsorted(quadratic.nodes, model.root[points])] + model.shift[points]
    return None


def _quadratic(
    model: Model, points: Index, gaps: Index, orders: Sequence[Relation], starts: Index, held: bool
) -> _Quadratic:
    nodes = np.unique(model.root[points])
    if held and nodes[0] != ORIGIN:
        nodes = np.insert(nodes, 0, ORIGIN)
    begin = model.gap[gaps]
    tail = np.concatenate([begin, [r.u for r in orders], np.full(len(starts), ORIGIN)]).astype(np.intp)
    head = np.concatenate([begin + 1, [r.v for r in orders], starts]).astype(np.intp)
    bounds = model.earliest[model.owner[starts]]
    seconds = np.concatenate([model.least[gaps], [r.seconds for r in orders], bounds])
    u, v = (np.searchsorted(nodes, model.root[p]) for p in (tail, head))
    between = model.shift[tail] - model.shift[head]
    g = len(gaps)
    return _Quadratic(
        nodes, u[:g], v[:g], model.wanted[gaps] + between[:g], model.stiffness[gaps], u, v, seconds + between
    )


def _feasible(quadratic: _Quadratic, start: Float64) -> tuple[Float64, list[int] | None]:
    """Levels that keep every inequality to LOOSE, or the numbers of those that form a positive cycle."""
    order = np.argsort(start[quadratic.u], kind="stable")
    edges = list(
        zip(
            quadratic.u[order].tolist(), quadratic.v[order].tolist(), quadratic.w[order].tolist(), strict=True
        )
    )
    level = start.tolist()
    cycle = raise_levels(level, edges, LOOSE)
    if cycle:
        return start, order[cycle].tolist()
    found = np.array(level)
    return found - found[0], None


def _yield_to_stated(model: Model, gaps: Index) -> bool:
    """Where the document itself states how long a stretch is, that length wins over the least gaps in it."""
    changed = False
    owners, firsts = np.unique(model.owner[model.gap[gaps]], return_index=True)
    for b, k in zip(owners.tolist(), gaps[firsts].tolist(), strict=True):
        first = int(model.first[b])
        seen: dict[int, int] = {}
        for p in range(first, int(model.last[b]) + 1):
            begin = seen.get(int(model.root[p]))
            if begin is not None:
                stretch = slice(k + begin - first, k + p - first)
                if 0 <= model.shift[p] - model.shift[begin] < model.least[stretch].sum() - TIGHT:
                    model.least[stretch] = 0.0
                    changed = True
            seen[int(model.root[p])] = p
    return changed


def _link(model: Model, k: int, gaps: Index, orders: Sequence[Relation], starts: Index) -> Link:
    """The inequality that has number k in `_quadratic`."""
    if k < len(gaps):
        p = int(model.gap[gaps[k]])
        return Link(p, p + 1, float(model.least[gaps[k]]))
    k -= len(gaps)
    if k < len(orders):
        return Link(orders[k].u, orders[k].v, orders[k].seconds, orders[k])
    point = int(starts[k - len(orders)])
    return Link(ORIGIN, point, float(model.earliest[model.owner[point]]))


def _optimum(quadratic: _Quadratic, level: Float64) -> Float64:
    """The optimum: exact where the inequalities that bind are found, else moved until all are kept."""
    u, v, w = quadratic.u, quadratic.v, quadratic.w
    found = _interior_point(quadratic)
    if found is None:
        return level
    x, force, room = found
    binding = (force > room) & (u != v)
    for _ in range(ROUNDS):
        exact = _pinned(quadratic, binding, x)
        broken = (exact[v] - exact[u] < w - TIGHT) & (u != v)
        if not (broken & ~binding).any():
            break
        binding |= broken
    if not broken.any() and _cost(quadratic, exact) <= _cost(quadratic, x) + LOOSE:
        return exact
    order = np.argsort(x[u], kind="stable")
    edges = list(zip(u[order].tolist(), v[order].tolist(), w[order].tolist(), strict=True))
    raised = x.tolist()
    if raise_levels(raised, edges, TIGHT) is not None:
        return level
    return np.array([time - raised[0] for time in raised])


def _cost(quadratic: _Quadratic, x: Float64) -> float:
    strain = x[quadratic.gj] - x[quadratic.gi] - quadratic.wanted
    return float(np.sum(quadratic.stiffness * strain * strain))


def _pinned(quadratic: _Quadratic, binding: Bool, x: Float64) -> Float64:
    """The least squares with some inequalities held as equalities; what these leave free stays near x."""
    m = len(x)
    ties = Ties(m)
    for u, v, w in zip(
        quadratic.u[binding].tolist(),
        quadratic.v[binding].tolist(),
        quadratic.w[binding].tolist(),
        strict=True,
    ):
        ties.tie(v, u, w)
    root = np.array([ties.find(k) for k in range(m)])
    shift = np.array(ties.shift)
    i, j = root[quadratic.gi], root[quadratic.gj]
    loose = i != j
    i, j = i[loose], j[loose]
    wanted = (quadratic.wanted + shift[quadratic.gi] - shift[quadratic.gj])[loose]
    pieces = Ties(m)
    for a, b in zip(i.tolist(), j.tolist(), strict=True):
        pieces.tie(a, b, 0.0)
    # The smallest node of each connected piece stands still, and so does what is no root of a class.
    fixed = np.array([pieces.find(k) == k for k in range(m)])
    y: Float64 = settle(i, j, wanted, quadratic.stiffness[loose], fixed, x)[root] + shift
    return y


def _interior_point(quadratic: _Quadratic) -> tuple[Float64, Float64, Float64] | None:
    """Clarabel's answer: x (m,), and of each inequality its force and its room; None where it gives up."""
    import clarabel

    m = len(quadratic.nodes)
    # What lies within one class cannot change.
    elastic = quadratic.gi != quadratic.gj
    gi, gj = quadratic.gi[elastic], quadratic.gj[elastic]
    a, d = quadratic.stiffness[elastic], quadratic.wanted[elastic]
    rows = np.flatnonzero(quadratic.u != quadratic.v)
    u, v, w = quadratic.u[rows], quadratic.v[rows], quadratic.w[rows]
    # Node 0 stands at 0 and is no unknown, so every column is one lower; the upper triangle is wanted.
    low, high = np.minimum(gi, gj), np.maximum(gi, gj)
    upper = _Sparse(
        np.concatenate([low, gi, gj]) - 1,
        np.concatenate([high, gi, gj]) - 1,
        np.concatenate([-a, a, a]) * 2.0,
        m - 1,
        m - 1,
    )
    linear = 2.0 * (np.bincount(gi, a * d, m) - np.bincount(gj, a * d, m))[1:]
    count = np.arange(len(rows))
    matrix = _Sparse(
        np.concatenate([count, count]),
        np.concatenate([u, v]) - 1,
        np.concatenate([np.ones(len(rows)), -np.ones(len(rows))]),
        len(rows),
        m - 1,
    )
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    # Close enough to tell what binds from what merely comes near.
    settings.tol_gap_abs = settings.tol_gap_rel = 1e-11
    solver = clarabel.DefaultSolver(
        upper, linear, matrix, -w, [clarabel.NonnegativeConeT(len(rows))], settings
    )
    solution = solver.solve()
    if str(solution.status) not in ("Solved", "AlmostSolved"):
        return None
    x = np.concatenate([[0.0], solution.x])
    force, room = np.zeros(len(quadratic.u)), np.ones(len(quadratic.u))
    force[rows], room[rows] = solution.z, solution.s
    return x, force, room


class _Sparse:
    """A matrix by compressed columns, as Clarabel reads it; spares importing SciPy's, a third of a second.

    Entries with a negative row or column are left out, those at the same place are added.
    """

    has_canonical_format = True

    def __init__(self, row: Index, column: Index, value: Float64, rows: int, columns: int) -> None:
        keep = (row >= 0) & (column >= 0)
        place, number = np.unique(column[keep] * rows + row[keep], return_inverse=True)
        self.data = np.bincount(number, value[keep], len(place)).tolist()
        self.indices = (place % rows).tolist() if rows else []
        self.indptr = np.searchsorted(place, np.arange(columns + 1) * rows).tolist()
        self.shape = (rows, columns)
        self.nnz = len(place)
