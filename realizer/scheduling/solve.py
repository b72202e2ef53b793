"""A problem in, the time of every point out; or the clashes that leave it without a solution.

Two stages (Paul 2010, 3.3.3, says only the first): behaviours that hold each other take the least squares of
their gaps, then every such shape that nothing holds slides to the earliest place that its orders allow. Only
shapes whose least squares break an inequality go to the convex solver.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from realizer.arrays import Float64
from realizer.scheduling.clash import Clash, Link, cycle_clash
from realizer.scheduling.model import LOOSE, TIGHT, Model, model_of
from realizer.scheduling.paths import components, raise_levels
from realizer.scheduling.problem import ORIGIN, Problem, Relation
from realizer.scheduling.shapes import Shapes, shapes_of
from realizer.scheduling.squeeze import squeeze

__all__ = ["Solution", "solve"]


@dataclass(frozen=True, slots=True)
class Solution:
    """time: (points,) seconds from block start. cost: the sum of stiffness * (gap - preferred)^2."""

    time: Float64
    cost: float


def solve(problem: Problem) -> Solution | list[Clash]:
    """The least-cost times of a problem, everything as early as it can be; or its clashes, at least one.

    The clashes that are returned have to be resolved; there may be more behind them.
    """
    model = model_of(problem)
    if isinstance(model, list):
        return model
    shapes = shapes_of(model)
    clashes = _keep_inequalities(model, shapes)
    if clashes:
        return clashes
    time = _slide(model, shapes)
    # Exactly equal where the document says so, exactly in order, exactly not too soon, whatever rounding did.
    time = time[model.root] + model.shift
    for p in model.gap[time[model.gap + 1] < time[model.gap]].tolist():
        time[p + 1] = max(time[p], time[p + 1])
    time[model.first] = np.maximum(time[model.first], model.earliest)
    strain = time[model.gap + 1] - time[model.gap] - model.wanted
    return Solution(time, float(np.sum(model.stiffness * strain * strain)))


@dataclass(frozen=True, slots=True)
class _Group:
    """Shapes that cannot slide apart, with the orders that hold them together."""

    shapes: list[int]
    orders: list[Relation]
    held: bool


def _keep_inequalities(model: Model, shapes: Shapes) -> list[Clash]:
    """Squeeze, in place, the groups of shapes that break a gap or an order which sliding cannot mend."""
    at, label = shapes.at, shapes.label
    short = at[model.gap + 1] - at[model.gap] < model.least - TIGHT
    bad = {int(s) for s in np.unique(label[model.owner[model.gap[short]]])}
    soon = shapes.held[label[:-1]] & (at[model.first] < model.earliest - TIGHT)
    bad |= {int(s) for s in np.unique(label[:-1][soon])}
    clashes = []
    in_order: set[int] = set()
    for group in _groups(model, shapes):
        in_order.update(group.shapes)
        if bad.isdisjoint(group.shapes) and _slides(model, shapes, group):
            continue
        if clash := _squeeze(model, shapes, group):
            clashes.append(clash)
    for shape in sorted(bad - in_order):
        if clash := _squeeze(model, shapes, _Group([shape], [], bool(shapes.held[shape]))):
            clashes.append(clash)
    for order in model.problem.orders:
        if order.u == order.v == ORIGIN and order.seconds > LOOSE:
            clashes.append(cycle_clash(model.problem, [Link(ORIGIN, ORIGIN, order.seconds, order)]))
    return clashes


def _squeeze(model: Model, shapes: Shapes, group: _Group) -> Clash | None:
    chosen = np.zeros(len(shapes.label), np.bool_)
    chosen[group.shapes] = True
    chosen = chosen[shapes.label]
    return squeeze(model, chosen, group.orders, shapes.at, held=group.held)


def _slides(model: Model, shapes: Shapes, group: _Group) -> bool:
    """Whether the group's shapes, as they are, can slide so that the orders among them hold."""
    number = {shape: k for k, shape in enumerate(group.shapes, 1) if not shapes.held[shape]}
    levels = [0.0] * (len(group.shapes) + 1)
    if group.held:
        begin = _earliest(model, shapes)
        for shape, k in number.items():
            levels[k] = float(begin[shape])
    edges = [(number.get(s, 0), number.get(t, 0), gain) for s, t, gain in _edges(model, shapes, group.orders)]
    return raise_levels(levels, edges, TIGHT) is None and levels[0] == 0.0


def _edges(model: Model, shapes: Shapes, orders: list[Relation]) -> Iterator[tuple[int, int, float]]:
    """Each order as (shape, shape, by how much more than the first the second has to slide)."""
    u, v = [r.u for r in orders], [r.v for r in orders]
    gain = shapes.at[u] + [r.seconds for r in orders] - shapes.at[v] if orders else np.zeros(0)
    return zip(
        shapes.label[model.owner[u]].tolist() if orders else [],
        shapes.label[model.owner[v]].tolist() if orders else [],
        gain.tolist(),
        strict=True,
    )


def _earliest(model: Model, shapes: Shapes) -> Float64:
    """(B + 1,) by label: how far a shape has to slide so that nothing of it is too soon."""
    level = np.full(len(shapes.label), -np.inf)
    np.maximum.at(level, shapes.label[:-1], model.earliest - shapes.at[model.first])
    return level


def _groups(model: Model, shapes: Shapes) -> list[_Group]:
    """The groups among the shapes that orders name.

    A shape from which orders lead, over however many others, to a held one cannot slide for ever: those hang
    together as far as orders connect them. Of the rest, only shapes in a circle of orders bind each other;
    any other order is kept by sliding what comes later, at no cost.
    """
    orders = model.problem.orders
    if not orders:
        return []
    ground = len(model.first)
    pairs = [(s, t) for s, t, _ in _edges(model, shapes, orders)]
    before: dict[int, list[int]] = {}
    for s, t in pairs:
        before.setdefault(t, []).append(s)
    named = sorted({s for pair in pairs for s in pair} - {ground})
    number = {shape: k for k, shape in enumerate(named)}
    bound = {ground, *(s for s in named if shapes.held[s])}
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
    groups: dict[int, _Group] = {}
    component = components(len(named), joined)
    for shape, c in zip(named, component, strict=True):
        groups.setdefault(c, _Group([], [], shape in bound)).shapes.append(shape)
    for (s, t), order in zip(pairs, orders, strict=True):
        ends = {component[number[shape]] for shape in (s, t) if shape != ground}
        if len(ends) == 1 and (ground not in (s, t) or (t if s == ground else s) in bound):
            groups[ends.pop()].orders.append(order)
    return list(groups.values())


def _slide(model: Model, shapes: Shapes) -> Float64:
    """(n,) every shape that is not held at its earliest place."""
    ground = len(model.first)
    free = ~shapes.held
    level = np.where(free, _earliest(model, shapes), 0.0)
    level[np.isneginf(level)] = 0.0
    orders = model.problem.orders
    if orders:
        edges = [
            (s if free[s] else ground, t if free[t] else ground, gain)
            for s, t, gain in _edges(model, shapes, orders)
        ]
        # What leads to a held shape has been squeezed or found to fit; only rounding could move it.
        edges = [edge for edge in edges if edge[1] != ground]
        number = {shape: k for k, shape in enumerate({shape for edge in edges for shape in edge[:2]})}
        component = components(len(number), [(number[s], number[t], gain) for s, t, gain in edges])
        edges.sort(key=lambda edge: component[number[edge[0]]])
        levels = level.tolist()
        if raise_levels(levels, edges, TIGHT):
            levels = level.tolist()
            raise_levels(levels, edges, LOOSE)
        level = np.array(levels)
    return shapes.at + level[shapes.label[model.owner]]
