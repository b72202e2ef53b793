"""Search for the cycle of fewest statements through the points of a given cycle."""

from collections.abc import Iterator, Sequence
from typing import TypeAlias

import numpy as np

from realizer.core import work
from realizer.scheduling.conflict import Conflict, ConstraintGraph, Link, conflict_of
from realizer.scheduling.model import LOOSE, Model
from realizer.scheduling.problem import ORIGIN, Relation

# Steps tried for the conflicts of one solution, some tens of milliseconds.
MAX_STEPS = 50_000

# The next point, the seconds to it, and the reason.
Step: TypeAlias = tuple[int, float, Relation | Link]


def minimal_cycles(model: Model, web: ConstraintGraph, cycles: Sequence[Sequence[Link]]) -> list[Conflict]:
    """Return a conflict for each cycle of inequalities, with the fewest statements of all cycles through it.

    Such a cycle visits no point twice; so without any one statement the others are a path, and can hold. No
    shorter cycle passes through any of its points.
    """
    ways = _StepGraph(model)
    conflicts, left = [], MAX_STEPS
    for cycle in cycles:
        clash = web.cycle(cycle)
        points = {end for r in clash.relations for end in (r.u, r.v)}
        # Statements meet at points that relations name, or at the first point of what starts too soon.
        points |= {end for link in cycle if link.u == ORIGIN or not points for end in (link.u, link.v)}
        todo = sorted(points)
        while todo and left > 0:
            start = todo.pop()
            steps, tried = ways.back_to(start, clash.statements - 1, left)
            left -= tried
            if steps:
                steps = _simple(start, steps)
                clash = conflict_of(model.problem, (reason for *_, reason in steps))
                todo = sorted(point for point, _, _ in steps)
        conflicts.append(clash)
    return conflicts


class _StepGraph:
    """A graph of statements: the steps from point to point that constraints, gaps and bounds are."""

    def __init__(self, model: Model) -> None:
        self.model = model
        problem = model.problem
        self._stated: dict[int, list[Step]] = {}
        for relation in problem.equalities:
            self._stated.setdefault(relation.v, []).append((relation.u, relation.seconds, relation))
            self._stated.setdefault(relation.u, []).append((relation.v, -relation.seconds, relation))
        for order in problem.orders:
            link = Link(order.u, order.v, order.seconds, order)
            self._stated.setdefault(order.u, []).append((order.v, order.seconds, link))
        n = len(problem.owner)
        self._least, self._most = np.zeros(n), np.zeros(n)
        self._least[model.gap + 1], self._most[model.gap + 1] = model.least, model.most
        self._rigid = [timing.rigid for timing in problem.timings]
        self._known: list[list[Step] | None] = [None] * n

    def back_to(self, start: int, statements: int, steps: int) -> tuple[list[Step], int]:
        """Return the positive cycle through a point with the fewest statements, and the number of trials.

        It is [] if there is none of so few statements, or if the search takes too many steps.
        """
        best, layer = [-np.inf] * len(self._least), {start: 0.0}
        best[start] = 0.0
        previous: list[dict[int, tuple[int, Step]]] = []
        tried = counted = 0
        for _ in range(statements):
            after: dict[int, float] = {}
            previous.append({})
            for u, so_far in layer.items():
                if (ways := self._known[u]) is None:
                    ways = self._known[u] = list(self._from(u))
                tried += len(ways)
                for step in ways:
                    v, seconds, _ = step
                    total = so_far + seconds
                    if v == start:
                        if total > LOOSE:
                            return _walk(previous, u, step), tried
                    elif total > best[v] + LOOSE / 100:
                        best[v] = after[v] = total
                        previous[-1][v] = (u, step)
            work.count(tried - counted)
            if tried > steps:
                break
            layer, counted = after, tried
        return [], tried

    def _from(self, u: int) -> Iterator[Step]:
        yield from self._stated.get(u, ())
        model = self.model
        if u == ORIGIN:
            for first, earliest in zip(model.first.tolist(), model.earliest.tolist(), strict=True):
                if earliest > -np.inf:
                    yield first, earliest, Link(ORIGIN, first, earliest)
            return
        b = int(model.owner[u])
        if self._rigid[b]:
            return
        seconds = 0.0
        for v in range(u + 1, int(model.last[b]) + 1):
            seconds += float(self._least[v])
            yield v, seconds, Link(u, v, seconds)
        seconds = 0.0
        for v in range(u - 1, int(model.first[b]) - 1, -1):
            seconds -= float(self._most[v + 1])
            if seconds == -np.inf:
                break
            yield v, seconds, Link(u, v, seconds)


def _simple(start: int, steps: list[Step]) -> list[Step]:
    """Return a positive cycle without repeated points, from a positive closed walk.

    The shortest walk through a point may go round a cycle elsewhere and come back.
    """
    points, trail = [start], list[Step]()
    for step in steps:
        trail.append(step)
        if step[0] in points:
            begin = points.index(step[0])
            ring = trail[begin:]
            if sum(seconds for _, seconds, _ in ring) > LOOSE:
                return ring
            del trail[begin:], points[begin + 1 :]
        else:
            points.append(step[0])
    return steps


def _walk(previous: list[dict[int, tuple[int, Step]]], at: int, last: Step) -> list[Step]:
    """Return the steps that led to a point, layer by layer, and the one that closes the cycle."""
    steps = [last]
    for layer in reversed(previous[:-1]):
        at, step = layer[at]
        steps.append(step)
    return steps[::-1]
