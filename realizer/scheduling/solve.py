"""The solver: a time for every point of a problem, or the conflicts that prevent a solution.

It has two stages (Paul 2010, 3.3.3, has only the first): clusters of tied behaviours get the least squares
solution of their gaps, then every free cluster slides to the earliest place that its orders allow. Only
clusters whose least squares violate an inequality go to the convex solver.
"""

from dataclasses import dataclass

import numpy as np

from realizer.core import work
from realizer.core.array_types import Float64
from realizer.scheduling.conflict import Conflict, ConstraintGraph, Link
from realizer.scheduling.graphs import components, longest_path_levels
from realizer.scheduling.groups import Group, groups_of, slides, solve_groups
from realizer.scheduling.model import LOOSE, TIGHT, Model, model_of
from realizer.scheduling.problem import ORIGIN, Problem
from realizer.scheduling.rigid_clusters import RigidClusters, clusters_of

# Up to this many points the conflicts of fewest statements are searched.
FEW = 128


@dataclass(frozen=True, slots=True)
class Solution:
    """time: (points,) seconds from block start. cost: the sum of stiffness * (gap - preferred)^2."""

    time: Float64
    cost: float


def solve(problem: Problem) -> Solution | list[Conflict]:
    """Return the least-cost times of a problem, as early as possible; or some of its conflicts.

    There may be more conflicts after the returned ones are resolved. Those of a small problem have the fewest
    statements; those of a large one are found in one pass.
    """
    is_small = len(problem.owner) <= FEW
    model = model_of(problem)
    if isinstance(model, list) and is_small:
        graph = ConstraintGraph(problem, model)
        return [graph.loop(k) for k in model]
    # What is impossible by itself is found before anything is solved together.
    if isinstance(model, list) or (not is_small and (model.stated_lengths()[2] < -LOOSE).any()):
        return _all_conflicts(problem)
    work.count(len(problem.owner) // 4)
    clusters = clusters_of(model)
    work.count(len(problem.owner) // 4)
    cycles = _keep_inequalities(model, clusters, is_small)
    if cycles and is_small:
        from realizer.scheduling.minimal_cycles import minimal_cycles  # only for contradicting documents

        return minimal_cycles(model, ConstraintGraph(problem), cycles)
    if cycles:
        return _all_conflicts(problem)
    work.count(len(problem.owner) // 4)
    time = _slide(model, clusters)
    # Remove rounding errors from equalities, orders and earliest starts.
    time = time[model.root] + model.shift
    time[model.first] = np.maximum(time[model.first], model.earliest)
    length = time[model.gap + 1] - time[model.gap]
    if (length < 0).any():
        for b in np.unique(model.owner[model.gap[length < 0]]).tolist():
            points = slice(model.first[b], model.last[b] + 1)
            time[points] = np.maximum.accumulate(time[points])
        length = time[model.gap + 1] - time[model.gap]
    strain = length - model.wanted
    return Solution(time, float(np.sum(model.stiffness * strain * strain)))


def _all_conflicts(problem: Problem) -> list[Conflict]:
    from realizer.scheduling.feasibility import conflicts_of  # only for large contradicting documents

    return conflicts_of(problem)


def _keep_inequalities(model: Model, clusters: RigidClusters, find_all: bool) -> list[list[Link]]:
    """Solve, in place, the groups of clusters that violate an inequality which sliding cannot satisfy.

    If there is no solution, return cycles of inequalities: of each group, or without `find_all` a single one.
    """
    at, label = clusters.at, clusters.label
    length = at[model.gap + 1] - at[model.gap]
    misfit = (length < model.least - TIGHT) | (length > model.most + TIGHT)
    soon = clusters.held[label[:-1]] & (at[model.first] < model.earliest - TIGHT)
    bad = {*label[model.owner[model.gap[misfit]]].tolist(), *label[:-1][soon].tolist()}
    work.count(len(model.problem.orders))
    groups = groups_of(model, clusters)
    alone = bad.difference(*(group.clusters for group in groups))
    begin = _earliest(model, clusters)
    groups = [g for g in groups if not bad.isdisjoint(g.clusters) or not _fits(model, clusters, g, begin)]
    groups += [Group([shape], [], bool(clusters.held[shape])) for shape in sorted(alone)]
    cycles = solve_groups(model, clusters, groups, find_all) if groups else []
    for order in model.problem.orders:
        if order.u == order.v == ORIGIN and order.seconds > LOOSE:
            cycles.append([Link(ORIGIN, ORIGIN, order.seconds, order)])
    return cycles


def _fits(model: Model, clusters: RigidClusters, group: Group, begin: Float64) -> bool:
    """Return whether the group's clusters, unchanged, can slide so that the orders among them hold."""
    if not group.orders:
        return True
    number = {shape: k for k, shape in enumerate(group.clusters, 1) if not clusters.held[shape]}
    levels = [0.0] * (len(group.clusters) + 1)
    if group.held:
        for shape, k in number.items():
            levels[k] = float(begin[shape])
    edges = [
        (number.get(s, 0), number.get(t, 0), gain) for s, t, gain in slides(model, clusters, group.orders)
    ]
    return longest_path_levels(levels, edges, TIGHT) is None and levels[0] == 0.0


def _earliest(model: Model, clusters: RigidClusters) -> Float64:
    """Return (B + 1,) by label: the least slide of a cluster with which no behaviour is too early."""
    level = np.full(len(clusters.label), -np.inf)
    np.maximum.at(level, clusters.label[:-1], model.earliest - clusters.at[model.first])
    return level


def _slide(model: Model, clusters: RigidClusters) -> Float64:
    """Place every free cluster as early as possible; return (n,) times."""
    ground = len(model.first)
    free = ~clusters.held
    level = np.where(free, _earliest(model, clusters), 0.0)
    orders = model.problem.orders
    if orders:
        edges = [
            (s if free[s] else ground, t if free[t] else ground, gain)
            for s, t, gain in slides(model, clusters, orders)
        ]
        # Clusters before a fixed one have been solved or fit; only rounding could move them.
        edges = [edge for edge in edges if edge[1] != ground]
        number = {shape: k for k, shape in enumerate({shape for edge in edges for shape in edge[:2]})}
        component = components(len(number), [(number[s], number[t], gain) for s, t, gain in edges])
        edges.sort(key=lambda edge: component[number[edge[0]]])
        levels = level.tolist()
        if longest_path_levels(levels, edges, TIGHT):
            levels = level.tolist()
            longest_path_levels(levels, edges, LOOSE)
        level = np.array(levels)
    return clusters.at + level[clusters.label[model.owner]]
