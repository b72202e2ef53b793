"""Groups of clusters that must be solved together, and their convex problems."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from realizer.core import work
from realizer.core.array_types import Float64
from realizer.scheduling.conflict import Link
from realizer.scheduling.convex import Quadratic, active_set, feasible_start, optimum
from realizer.scheduling.graphs import components
from realizer.scheduling.model import LOOSE, Index, Model, drop_least_gaps
from realizer.scheduling.problem import ORIGIN, Relation
from realizer.scheduling.rigid_clusters import RigidClusters


@dataclass(frozen=True, slots=True)
class Group:
    """Clusters that cannot slide apart, with the orders that connect them."""

    clusters: list[int]
    orders: list[Relation]
    held: bool


def groups_of(model: Model, clusters: RigidClusters) -> list[Group]:
    """Return the groups among the clusters that orders name.

    A cluster from which orders lead, directly or not, to a fixed one cannot slide without limit; a group has
    all such clusters that orders connect. Of the rest, only clusters in a circle of orders form a group; any
    other order can be satisfied by sliding the later cluster, at no cost.
    """
    orders = model.problem.orders
    if not orders:
        return []
    ground = len(model.first)
    pairs = [(s, t) for s, t, _ in slides(model, clusters, orders)]
    before: dict[int, list[int]] = {}
    for s, t in pairs:
        before.setdefault(t, []).append(s)
    named = sorted({s for pair in pairs for s in pair} - {ground})
    number = {shape: k for k, shape in enumerate(named)}
    bound = {ground, *(s for s in named if clusters.held[s])}
    work = list(bound)
    while work:
        for s in before.get(work.pop(), ()):
            if s not in bound:
                bound.add(s)
                work.append(s)
    joined = []
    for s, t in pairs:
        if s == ground or t == ground:
            continue
        if s in bound and t in bound:
            joined += [(number[s], number[t], 0.0), (number[t], number[s], 0.0)]
        elif s not in bound and t not in bound:
            joined.append((number[s], number[t], 0.0))
    groups: dict[int, Group] = {}
    component = components(len(named), joined)
    for shape, c in zip(named, component, strict=True):
        groups.setdefault(c, Group([], [], shape in bound)).clusters.append(shape)
    for (s, t), order in zip(pairs, orders, strict=True):
        ends = {component[number[shape]] for shape in (s, t) if shape != ground}
        if len(ends) == 1 and (ground not in (s, t) or (t if s == ground else s) in bound):
            groups[ends.pop()].orders.append(order)
    return list(groups.values())


def slides(
    model: Model, clusters: RigidClusters, orders: Sequence[Relation]
) -> Iterator[tuple[int, int, float]]:
    """Return each order as (cluster, cluster, by how much more than the first the second has to slide)."""
    if not orders:
        return iter(())
    u, v = [r.u for r in orders], [r.v for r in orders]
    gain = clusters.at[u] + [r.seconds for r in orders] - clusters.at[v]
    owner, label = model.owner, clusters.label
    return zip(label[owner[u]].tolist(), label[owner[v]].tolist(), gain.tolist(), strict=True)


@dataclass(slots=True, eq=False)
class _GroupProblem:
    """Groups as a convex problem; node 0 is the block's start and a class of every group that can slide."""

    quadratic: Quadratic
    points: Index  # the points to solve. number: (n,) the node of each point's class.
    number: Index
    # gaps, bounded, orders, starts: the sources of the inequalities, in this order: least lengths of gaps,
    # greatest lengths, orders, and earliest starts of behaviours
    gaps: Index
    bounded: Index
    orders: list[Relation]
    starts: Index

    def start(self, clusters: RigidClusters) -> Float64:
        start = np.zeros(self.quadratic.size)
        nodes = np.flatnonzero(self.number)
        start[self.number[nodes]] = clusters.at[nodes]
        return start

    def link(self, model: Model, k: int) -> Link:
        if k < len(self.gaps):
            p = int(model.gap[self.gaps[k]])
            return Link(p, p + 1, float(model.least[self.gaps[k]]))
        k -= len(self.gaps)
        if k < len(self.bounded):
            p = int(model.gap[self.bounded[k]])
            return Link(p + 1, p, -float(model.most[self.bounded[k]]))
        k -= len(self.bounded)
        if k < len(self.orders):
            order = self.orders[k]
            return Link(order.u, order.v, order.seconds, order)
        point = int(self.starts[k - len(self.orders)])
        return Link(ORIGIN, point, float(model.earliest[model.owner[point]]))


def solve_groups(
    model: Model, clusters: RigidClusters, groups: Sequence[Group], find_all: bool = True
) -> list[list[Link]]:
    """Move the points of some groups, in place, to the least cost within gaps and orders.

    If there is no solution, no point is moved. Return cycles of inequalities then: one for each infeasible
    group, or without `find_all` a single one.
    """
    # A group that can slide is moved so that its class of node 0 is at 0.
    begin = np.zeros(len(clusters.label))
    for group in groups:
        if not group.held:
            begin[group.clusters] = clusters.at[_anchor(model, group)]
    clusters.at -= begin[clusters.label[model.owner]]
    # This is much faster than the search for the optimum, which would not find one.
    problem, level, cycle = _feasible(model, clusters, groups)
    if cycle and find_all:
        return [cycle for group in groups if (cycle := _feasible(model, clusters, [group])[2])]
    if cycle:
        return [cycle]
    x = active_set(problem.quadratic, problem.start(clusters))
    if x is None:
        x = optimum(problem.quadratic, level)
    clusters.at[problem.points] = x[problem.number[model.root[problem.points]]] + model.shift[problem.points]
    return []


def _feasible(
    model: Model, clusters: RigidClusters, groups: Sequence[Group]
) -> tuple[_GroupProblem, Float64, list[Link]]:
    """Return the problem of some groups, with positions that satisfy its inequalities, or a cycle."""
    problem = _group_problem(model, clusters, groups)
    level, cycle = feasible_start(problem.quadratic, problem.start(clusters))
    return problem, level, [problem.link(model, k) for k in cycle or ()]


def _group_problem(model: Model, clusters: RigidClusters, groups: Sequence[Group]) -> _GroupProblem:
    work.count(len(model.owner) // 4)
    owner, root, shift = model.owner, model.root, model.shift
    chosen, held = np.zeros(len(clusters.label), np.bool_), np.zeros(len(clusters.label), np.bool_)
    for group in work.counted(groups):
        chosen[group.clusters] = True
        held[group.clusters] = group.held
    chosen, held = chosen[clusters.label], held[clusters.label]
    points = model.points_of(chosen)
    at_start = [ORIGIN, *(_anchor(model, group) for group in groups if not group.held)]
    nodes = np.setdiff1d(root[points], at_start)
    number = np.zeros(len(owner), np.intp)
    number[nodes] = np.arange(1, len(nodes) + 1)

    gaps = np.flatnonzero(chosen[owner[model.gap]])
    _yield_to_stated(model, gaps)
    orders = [order for group in groups for order in group.orders]
    starts = model.first[held[:-1]]
    begin, g = model.gap[gaps], len(gaps)
    ends = gaps[model.most[gaps] < np.inf]
    end = model.gap[ends] + 1
    tail = np.concatenate([begin, end, [r.u for r in orders], np.zeros(len(starts))]).astype(np.intp)
    head = np.concatenate([begin + 1, end - 1, [r.v for r in orders], starts]).astype(np.intp)
    seconds = np.concatenate(
        [model.least[gaps], -model.most[ends], [r.seconds for r in orders], model.earliest[owner[starts]]]
    )
    u, v, between = number[root[tail]], number[root[head]], shift[tail] - shift[head]
    # Nodes that springs connect form a cluster, or belong to node 0, which stands for everything fixed.
    piece = np.zeros(len(nodes) + 1, np.intp)
    labels = clusters.label[owner[nodes]]
    still = clusters.held.copy()
    still[[clusters.label[owner[p]] for p in at_start[1:]]] = True
    free = ~still[labels]
    piece[1:][free] = np.unique(labels[free], return_inverse=True)[1] + 1
    quadratic = Quadratic(
        len(nodes) + 1,
        u[:g],
        v[:g],
        model.wanted[gaps] + between[:g],
        model.stiffness[gaps],
        u,
        v,
        seconds + between,
        piece,
    )
    return _GroupProblem(quadratic, points, number, gaps, ends, orders, starts)


def _anchor(model: Model, group: Group) -> int:
    """Return the class that represents the block's start in a group that can slide."""
    return int(model.root[model.first[group.clusters[0]]])


def _yield_to_stated(model: Model, gaps: Index) -> None:
    """Drop the least gaps within a length that the document states, except in bounded behaviours."""
    owner = model.owner
    p, q, length = model.stated_lengths()
    least = np.zeros(len(owner))
    least[model.gap + 1] = model.least
    room = np.cumsum(least)[[p, q]]
    short = (length >= -LOOSE) & (length < room[1] - room[0])
    if not short.any():
        return
    owners, firsts = np.unique(owner[model.gap[gaps]], return_index=True)
    named = np.isin(owners, owner[p[short]])
    begins = zip(owners[named].tolist(), gaps[firsts[named]].tolist(), strict=True)
    for b, k in work.counted(begins, 10):
        first, last = int(model.first[b]), int(model.last[b])
        if (model.most[k : k + last - first] < np.inf).any():
            continue
        own = model.least[k : k + last - first].tolist()
        classes = zip(
            model.root[first : last + 1].tolist(), model.shift[first : last + 1].tolist(), strict=True
        )
        drop_least_gaps(own, enumerate(classes))
        model.least[k : k + last - first] = own
