"""All conflicts of a large problem in one pass: its relations are added one by one."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import count
from math import inf

from realizer.core import work
from realizer.scheduling.conflict import Conflict, Link, choose, conflict_of
from realizer.scheduling.graphs import UnionFind
from realizer.scheduling.model import LOOSE, drop_least_gaps
from realizer.scheduling.problem import ORIGIN, Part, Problem, Relation


@dataclass(slots=True, eq=False)
class Edge:
    """An inequality, time[v] >= time[u] + seconds, and what states it."""

    u: int
    v: int
    seconds: float
    reason: Relation | Link


class ConstraintNetwork:
    """Inequalities between points, with the least time of each point that satisfies all of them.

    Inequalities are added and removed one by one, and only the times that depend on them are found again: a
    simple temporal network (Dechter, Meiri and Pearl 1991) kept consistent incrementally (Cotton and Maler
    2006). Point 0 is fixed at 0.
    """

    def __init__(self, points: int) -> None:
        self._level = [0.0, *[-inf] * (points - 1)]
        self._cause: list[Edge | None] = [None] * points
        self._out: list[dict[Edge, None]] = [{} for _ in range(points)]
        self._in: list[dict[Edge, None]] = [{} for _ in range(points)]

    def add(self, edge: Edge) -> list[Edge]:
        """Add an inequality, or return the cycle of inequalities with which it cannot hold."""
        level, cause, order = self._level, self._cause, count()
        before: dict[int, tuple[float, Edge | None]] = {}
        # The point that rises most comes first; so each rises once, as in Dijkstra's algorithm.
        queue = [(0.0, next(order), edge)]
        while queue:
            work.count()
            _, _, step = heappop(queue)
            v, time = step.v, level[step.u] + step.seconds
            if time <= level[v] + LOOSE:
                continue
            if v == ORIGIN or v == edge.u:
                cycle = self._cycle(step)
                for point, (old, reason) in before.items():
                    level[point], cause[point] = old, reason
                return cycle
            work.count(2 + len(self._out[v]) // 2)
            before.setdefault(v, (level[v], cause[v]))
            level[v], cause[v] = time, step
            for following in self._out[v]:
                rise = time + following.seconds - level[following.v]
                if rise > LOOSE:
                    heappush(queue, (-rise, next(order), following))
        self._out[edge.u][edge] = self._in[edge.v][edge] = None
        return []

    def remove(self, edges: Iterable[Edge]) -> None:
        """Remove inequalities that are there, and lower the times that followed from them."""
        lowered = []
        for edge in edges:
            if edge in self._out[edge.u]:
                del self._out[edge.u][edge], self._in[edge.v][edge]
                if self._cause[edge.v] is edge:
                    lowered.append(edge.v)
        for point in lowered:
            work.count()
            self._level[point], self._cause[point] = -inf, None
            lowered += [step.v for step in self._out[point] if self._cause[step.v] is step]
        queue = deque(step for point in dict.fromkeys(lowered) for step in self._in[point])
        while queue:
            work.count()
            step = queue.popleft()
            time = self._level[step.u] + step.seconds
            if time > self._level[step.v] + LOOSE:
                self._level[step.v], self._cause[step.v] = time, step
                queue.extend(self._out[step.v])

    def edges_of(self, points: Iterable[int]) -> list[Edge]:
        return list(dict.fromkeys(edge for p in points for edge in (*self._out[p], *self._in[p])))

    def _cycle(self, last: Edge) -> list[Edge]:
        """Return the cycle that an inequality closes with those from which the time of its tail follows."""
        chain, place = [last], {last.v: 0}
        while (point := chain[-1].u) not in place:
            place[point] = len(chain)
            before = self._cause[point]
            assert before is not None, "all times follow from point 0"
            chain.append(before)
        # While times rise, those at the other end of the chain may form a cycle already.
        return chain[place[point] :][::-1]


def conflicts_of(problem: Problem) -> list[Conflict]:
    """Return the conflicts of a problem, each without the parts that earlier ones drop.

    Relations are added in the order of the document. One that contradicts those before is a conflict, and
    the part that `choose` drops is removed with all that refers to it. If it drops nothing, the search ends.
    """
    network = ConstraintNetwork(len(problem.owner))
    for edge in _lengths(problem):
        network.add(edge)
    number = {id(part): n for n, part in enumerate(problem.behaviours)}
    relations = [(r, True) for r in problem.equalities] + [(r, False) for r in problem.orders]
    edges: dict[int, list[Edge]] = {id(r.part): [] for r, _ in relations}
    constraints: dict[str, list[Part]] = {}  # that name a behaviour
    for part in {id(r.part): r.part for r, _ in relations if r.part.is_constraint}.values():
        for name in part.names:
            constraints.setdefault(name, []).append(part)
    gone: set[int] = set()  # parts
    absent: set[int] = set()  # numbers of behaviours
    conflicts: list[Conflict] = []

    def drop(part: Part) -> None:
        gone.add(id(part))
        network.remove(edges.get(id(part), ()))
        if (n := number.get(id(part))) is not None:
            absent.add(n)
            first = problem.first[n]
            network.remove(network.edges_of(range(first, first + len(problem.timings[n].points))))
            for constraint in constraints.get(part.id, ()):
                gone.add(id(constraint))
                network.remove(edges[id(constraint)])

    for relation, is_equality in work.counted(relations, 2):
        u, v, seconds, part, _ = relation
        reason = relation if is_equality else Link(u, v, seconds, relation)
        if is_equality:  # time[u] = time[v] + seconds
            inequalities = [Edge(v, u, seconds, reason), Edge(u, v, -seconds, reason)]
        else:
            inequalities = [Edge(u, v, seconds, reason)]
        for edge in inequalities:
            while id(part) not in gone and absent.isdisjoint((problem.owner[u], problem.owner[v])):
                cycle = network.add(edge)
                if not cycle:
                    edges[id(part)].append(edge)
                    break
                conflict = conflict_of(problem, (step.reason for step in cycle))
                conflicts.append(conflict)
                dropped = choose(conflict)
                if dropped is None:
                    return conflicts
                drop(dropped)
    return conflicts


def _lengths(problem: Problem) -> Iterator[Edge]:
    """Return the inequalities that behaviours state by themselves: their lengths and earliest starts."""
    ties, tied = UnionFind(len(problem.owner)), dict[int, set[int]]()
    for u, v, seconds, _, _ in work.counted(problem.equalities):
        ties.tie(u, v, seconds)
        for p in (u, v):
            tied.setdefault(problem.owner[p], set()).add(p)
    for b, (timing, first) in enumerate(work.counted(zip(problem.timings, problem.first, strict=True), 5)):
        if (earliest := problem.earliest[b]) > -inf:
            yield Edge(ORIGIN, first, earliest, Link(ORIGIN, first, earliest))
        if timing.rigid:
            continue
        least, most = list(timing.arrays.least), timing.arrays.most
        if most is None:
            points = sorted(tied.get(b, ()))
            drop_least_gaps(least, [(p - first, (ties.find(p), ties.shift[p])) for p in points])
        for p, seconds in enumerate(least, first):
            yield Edge(p, p + 1, seconds, Link(p, p + 1, seconds))
        for p, seconds in enumerate(most or (), first):
            if seconds < inf:
                yield Edge(p + 1, p, -seconds, Link(p + 1, p, -seconds))
