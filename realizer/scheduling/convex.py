"""An active-set solver for convex problems of differences; it returns a cycle if there is no solution."""

from dataclasses import dataclass

import numpy as np

from realizer.core import work
from realizer.core.array_types import Bool, Float64
from realizer.scheduling.graphs import UnionFind, components, longest_path_levels
from realizer.scheduling.model import LOOSE, TIGHT, Index
from realizer.scheduling.quadratic_program import minimum
from realizer.scheduling.rigid_clusters import least_squares

# Active sets tried before the interior point method, which is rarely needed.
GUESSES = 12
# A guess that is wrong about more inequalities than this, and about half as many as the one before or more,
# rarely leads to the right one.
WRONG = 24
# Corrections of the active set after the interior point method; mostly one is enough.
ROUNDS = 20
# Up to this many unknowns a thread costs more time than it leaves to others.
SMALL = 100
# A force counts as none below this part of the greatest stiffness.
RESTS = 1e-11


@dataclass(slots=True, eq=False)
class Quadratic:
    """Minimise the sum of stiffness * (x[j] - x[i] - wanted)^2 where x[v] - x[u] >= w; x[0] is 0."""

    size: int
    i: Index
    j: Index
    wanted: Float64
    stiffness: Float64
    u: Index
    v: Index
    w: Float64
    piece: Index  # (size,) a number below size for each set of nodes that springs connect


def feasible_start(
    quadratic: Quadratic, start: Float64, slack: float = LOOSE
) -> tuple[Float64, list[int] | None]:
    """Return the least x from a start on that satisfies every inequality within the slack, and None.

    If there is none, return an arbitrary x, and the numbers of inequalities that form a cycle of positive
    length.
    """
    work.count(len(quadratic.u) // 4)
    order = np.argsort(start[quadratic.u], kind="stable")
    columns = [ends[order].tolist() for ends in (quadratic.u, quadratic.v, quadratic.w)]
    work.count(len(order) // 4)
    edges = list(zip(*columns, strict=True))
    level = start.tolist()
    if cycle := longest_path_levels(level, edges, slack):
        return start, order[cycle].tolist()
    found = np.array(level)
    return found - found[0], None


def active_set(quadratic: Quadratic, x: Float64) -> Float64 | None:
    """Return the optimal x (size,) by an active-set method, or None if it does not converge.

    Violated inequalities become active, those with negative force inactive, until there are neither. Mostly
    that takes two or three rounds from the unconstrained least squares.
    """
    u, v, w = quadratic.u, quadratic.v, quadratic.w
    differ = u != v
    if (w[~differ] > LOOSE).any():
        return None
    binding = (x[v] - x[u] < w - TIGHT) & differ
    seen: list[bytes] = []
    wrong = len(u)
    for _ in range(GUESSES):
        exact, force = _bound(quadratic, binding, x)
        broken = (exact[v] - exact[u] < w - TIGHT) & differ
        misplaced = broken | (force < -RESTS * quadratic.stiffness.max(initial=0.0))
        before, wrong = wrong, int(misplaced.sum())
        if not wrong:
            return exact
        if wrong > max(WRONG, before // 2):
            return None
        binding = (binding & ~misplaced) | broken
        # The same guess may be worth a second try, because it starts from another x.
        seen.append(binding.tobytes())
        if seen.count(seen[-1]) > 2:
            return None
        x = exact
    return None


def optimum(quadratic: Quadratic, level: Float64) -> Float64:
    """Return the optimal x (size,) by the interior point method; level satisfies every inequality.

    Inequalities that a closed cycle makes tight are tied first: interior points need an interior.
    """
    u, v = quadratic.u, quadratic.v
    tight = np.flatnonzero(level[v] - level[u] - quadratic.w <= 2 * LOOSE)
    circle = np.array(components(quadratic.size, [(int(u[k]), int(v[k]), 0.0) for k in tight]))
    _, first, number = np.unique(circle, return_index=True, return_inverse=True)
    # Circles are numbered by their first nodes, so that node 0 stays node 0.
    first, number = np.sort(first), np.argsort(np.argsort(first))[number]
    if len(first) == quadratic.size:
        return _optimum(quadratic, level)
    shift = level - level[first][number]
    ties = UnionFind(quadratic.size)
    for a, b in zip(quadratic.piece.tolist(), quadratic.piece[first][number].tolist(), strict=True):
        ties.tie(a, b, 0.0)
    smaller = Quadratic(
        len(first),
        number[quadratic.i],
        number[quadratic.j],
        quadratic.wanted + shift[quadratic.i] - shift[quadratic.j],
        quadratic.stiffness,
        number[u],
        number[v],
        quadratic.w + shift[u] - shift[v],
        np.unique([ties.find(p) for p in quadratic.piece[first].tolist()], return_inverse=True)[1],
    )
    if smaller.size == 1:
        return level
    x: Float64 = _optimum(smaller, level[first])[number] + shift
    return x


def _optimum(quadratic: Quadratic, level: Float64) -> Float64:
    """Correct the result of the interior point method: solve with its active set until no force is wrong."""
    u, v, w = quadratic.u, quadratic.v, quadratic.w
    found = _interior_point(quadratic)
    if found is None:
        return level
    x, force, room = found
    binding = (force > room) & (u != v)
    best, least = None, np.inf
    for _ in range(ROUNDS):
        exact, force = _bound(quadratic, binding, x)
        broken = (exact[v] - exact[u] < w - TIGHT) & (u != v)
        if broken.any():
            if (binding | broken).sum() == binding.sum():
                break
            binding |= broken
            continue
        cost = _cost(quadratic, exact)
        if cost < least:
            best, least = exact, cost
        pulling = force < -RESTS * quadratic.stiffness.max(initial=0.0)
        if not pulling.any():
            return exact
        binding &= ~pulling
    raised, cycle = feasible_start(quadratic, x, TIGHT)
    if not cycle and _cost(quadratic, raised) < least:
        return raised
    return level if best is None else best


def _cost(quadratic: Quadratic, x: Float64) -> float:
    strain = x[quadratic.j] - x[quadratic.i] - quadratic.wanted
    return float(np.sum(quadratic.stiffness * strain * strain))


def _bound(quadratic: Quadratic, binding: Bool, x: Float64) -> tuple[Float64, Float64]:
    """Solve least squares with the active inequalities as equalities; free directions stay near x.

    Return x, and the force of each inequality: positive if it pushes, negative if it should be inactive.
    """
    m = quadratic.size
    work.count(m)
    root, shift, whole = np.arange(m), np.zeros(m), quadratic.piece
    beside: dict[int, list[tuple[int, int]]] = {}
    active = np.flatnonzero(binding)
    # The most violated comes first: of several that tie the same nodes, the first counts.
    active = active[np.argsort((x[quadratic.v] - x[quadratic.u] - quadratic.w)[active], kind="stable")]
    if len(active):
        ties, pieces = UnionFind(m), UnionFind(m)
        ends = [end[active].tolist() for end in (quadratic.u, quadratic.v, quadratic.w)]
        for k, u, v, w in work.counted(zip(active.tolist(), *ends, strict=True)):
            if ties.find(u) != ties.find(v):
                ties.tie(v, u, w)
                beside.setdefault(u, []).append((v, k))
                beside.setdefault(v, []).append((u, k))
        touched = list(beside)
        root[touched] = [ties.find(k) for k in touched]
        shift[touched] = [ties.shift[k] for k in touched]
        tails, heads = whole[quadratic.u[active]], whole[quadratic.v[active]]
        apart = np.flatnonzero(tails != heads)
        if len(apart):
            for a, b in zip(tails[apart].tolist(), heads[apart].tolist(), strict=True):
                pieces.tie(a, b, 0.0)
            whole = np.array([pieces.find(p) for p in range(m)])[whole]
    i, j = root[quadratic.i], root[quadratic.j]
    loose = i != j
    wanted = quadratic.wanted + shift[quadratic.i] - shift[quadratic.j]
    # The smallest node of each connected piece is fixed, and so is every node that is no class root.
    fixed = root != np.arange(m)
    fixed[np.unique(whole, return_index=True)[1]] = True
    exact = (
        least_squares(i[loose], j[loose], wanted[loose], quadratic.stiffness[loose], fixed, x)[root] + shift
    )
    strain = 2.0 * quadratic.stiffness * (exact[quadratic.j] - exact[quadratic.i] - quadratic.wanted)
    pull = np.bincount(quadratic.j, strain, m) - np.bincount(quadratic.i, strain, m)
    return exact, _forces(pull.tolist(), beside, quadratic)


def _forces(pull: list[float], beside: dict[int, list[tuple[int, int]]], quadratic: Quadratic) -> Float64:
    """Return (inequalities,) the forces that balance the springs on trees of tied nodes, leaves first."""
    force = np.zeros(len(quadratic.u))
    seen: set[int] = set()
    for root in work.counted(sorted(beside)):
        if root in seen:
            continue
        seen.add(root)
        order = [(root, root, -1)]
        for node, _, _ in order:
            for to, k in beside[node]:
                if to not in seen:
                    seen.add(to)
                    order.append((to, node, k))
        for node, towards, k in reversed(order[1:]):
            force[k] = pull[node] if quadratic.v[k] == node else -pull[node]
            pull[towards] += pull[node]
    return force


def _interior_point(quadratic: Quadratic) -> tuple[Float64, Float64, Float64] | None:
    """Return Clarabel's solution x (m,), with force and slack of each inequality, or None if it fails."""
    work.count(100 * quadratic.size)
    from scipy.sparse import csc_array

    m = quadratic.size
    # Points of one class move together.
    elastic = quadratic.i != quadratic.j
    gi, gj = quadratic.i[elastic], quadratic.j[elastic]
    a, d = quadratic.stiffness[elastic], quadratic.wanted[elastic]
    a = a / a.max(initial=1e-9)
    rows = np.flatnonzero(quadratic.u != quadratic.v)
    u, v, w = quadratic.u[rows], quadratic.v[rows], quadratic.w[rows]
    # Node 0 is fixed at 0, so its row and column are left out; Clarabel takes the upper triangle.
    low, high = np.minimum(gi, gj), np.maximum(gi, gj)
    ends = np.concatenate([low, gi, gj]), np.concatenate([high, gi, gj])
    upper = csc_array((np.concatenate([-a, a, a]) * 2.0, ends), shape=(m, m))[1:, 1:]
    linear = 2.0 * (np.bincount(gi, a * d, m) - np.bincount(gj, a * d, m))[1:]
    ones, count = np.ones(len(rows)), np.arange(len(rows))
    ends = np.concatenate([count, count]), np.concatenate([u, v])
    matrix = csc_array((np.concatenate([ones, -ones]), ends), shape=(len(rows), m))[:, 1:]
    # Matrices of -1, 0 and 1 do not need Clarabel's scaling, which sometimes makes it fail; in rare cases it
    # only succeeds with it.
    for scaled in (False, True):
        solution = minimum(
            upper,
            linear,
            matrix,
            -w,
            in_thread=m > SMALL,
            equilibrate_enable=scaled,
            # It only makes the solution more accurate than is needed.
            iterative_refinement_enable=False,
            # Close enough to tell active inequalities from those that are merely near.
            tol_gap_abs=1e-11,
            tol_gap_rel=1e-11,
        )
        # Rounding limits the accuracy; the active set is solved again exactly.
        if str(solution.status) in ("Solved", "AlmostSolved", "InsufficientProgress"):
            force, room = np.zeros(len(quadratic.u)), np.ones(len(quadratic.u))
            force[rows], room[rows] = solution.z, solution.s
            return np.concatenate([[0.0], solution.x]), force, room
    return None
