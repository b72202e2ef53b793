"""Grouping of clusters that must be solved together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from realizer.scheduling.longest_paths import components
from realizer.scheduling.model import Model
from realizer.scheduling.problem import Relation
from realizer.scheduling.rigid_clusters import RigidClusters


@dataclass(frozen=True, slots=True)
class Group:
    """Clusters that cannot slide apart, with the orders that connect them.

    `held`: they cannot slide without limit, because some of them are tied to fixed times.
    """

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
