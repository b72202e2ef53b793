"""All conflicts of a large problem in one pass: its relations are added one by one."""

from collections import defaultdict, deque
from collections.abc import Iterable, Sequence
from heapq import heappop, heappush, heappushpop
from itertools import accumulate, pairwise
from math import inf
from typing import TypeAlias

from realizer.core import work
from realizer.scheduling.conflict import Conflict, Link, choose, conflict_of
from realizer.scheduling.graphs import UnionFind
from realizer.scheduling.model import LOOSE, drop_least_gaps
from realizer.scheduling.problem import ORIGIN, Part, Problem

STEPS = 16  # of a search that are counted at once
# The causes of times that follow from the point before and from the earliest start of a behaviour.
_BEFORE, _EARLIEST = Link(ORIGIN, ORIGIN, 0.0), Link(ORIGIN, ORIGIN, 0.0)

Step: TypeAlias = tuple[int, int, float, Link]  # time[v] >= time[u] + seconds, and its cause


class ConstraintNetwork:
    """Inequalities between points, with the least time of each point that satisfies all of them.

    Inequalities are added and removed one by one, and only the times that depend on them are found again: a
    simple temporal network (Dechter, Meiri and Pearl 1991) kept consistent incrementally (Cotton and Maler
    2006). Point 0 is fixed at 0.
    """

    def __init__(self, points: int) -> None:
        self._level = [0.0, *[-inf] * points]
        self._cause: list[Link | None] = [None] * (points + 1)
        self._out, self._in = (
            defaultdict[int, dict[Link, None]](dict),
            defaultdict[int, dict[Link, None]](dict),
        )
        # The earliest time of each point, and the least seconds to the next one; -inf if there is none.
        self._earliest, self._least = [-inf] * points, [-inf] * points

    def add_chain(self, first: int, earliest: float, least: Sequence[float]) -> None:
        """Add the inequalities of successive points that have none yet."""
        self._earliest[first] = earliest
        self._least[first : first + len(least)] = least
        if earliest > -inf:
            last = first + len(least)
            self._level[first : last + 1] = accumulate(least, initial=earliest)
            self._cause[first : last + 1] = [_EARLIEST, *[_BEFORE] * len(least)]

    def add(self, link: Link) -> list[Link]:
        """Add an inequality, or return the cycle of inequalities with which it cannot hold."""
        if self._level[link.u] + link.seconds > self._level[link.v] + LOOSE and (cycle := self._raise(link)):
            return cycle
        self._out[link.u][link] = self._in[link.v][link] = None
        return []

    def _raise(self, link: Link) -> list[Link]:
        """Raise times so that an inequality holds; or leave them, and return a cycle."""
        level, cause, least, out = self._level, self._cause, self._least, self._out
        before: dict[int, tuple[float, Link | None]] = {}
        # The point that rises most comes first; so each rises once, as in Dijkstra's algorithm.
        queue: list[tuple[float, int, Step]] = []
        latest: tuple[float, int, Step] | None = (0.0, 0, (link.u, link.v, link.seconds, link))
        order = steps = 0
        while latest is not None or queue:
            step = (heappop(queue) if latest is None else heappushpop(queue, latest))[2]
            u, v, seconds, reason = step
            latest, steps, time = None, steps + 1, level[u] + seconds
            if steps > STEPS:
                work.count(3 * steps)
                steps = 0
            if time <= level[v] + LOOSE:
                continue
            if v in (ORIGIN, link.u):
                cycle = self._cycle(step)
                for point, (old, earlier) in before.items():
                    level[point], cause[point] = old, earlier
                return cycle
            if v not in before:
                before[v] = level[v], cause[v]
            level[v], cause[v] = time, reason
            if (rise := time + least[v] - level[v + 1]) > LOOSE:
                order += 1
                latest = -rise, order, (v, v + 1, least[v], _BEFORE)
            for following in out.get(v, ()):
                rise = time + following.seconds - level[following.v]
                if rise > LOOSE:
                    if latest is not None:
                        heappush(queue, latest)
                    order += 1
                    latest = -rise, order, (v, following.v, following.seconds, following)
        work.count(3 * steps)
        return []

    def remove(self, links: Iterable[Link]) -> None:
        """Remove inequalities that are there, and lower the times that followed from them."""
        lowered = []
        for link in links:
            if link in self._out[link.u]:
                del self._out[link.u][link], self._in[link.v][link]
                if self._cause[link.v] is link:
                    lowered.append(link.v)
        for point in lowered:
            work.count()
            self._level[point], self._cause[point] = -inf, None
            lowered += [v for _, v, _, reason in self._steps_from(point) if self._cause[v] is reason]
        queue = deque(step for point in dict.fromkeys(lowered) for step in self._steps_to(point))
        while queue:
            work.count()
            u, v, seconds, reason = queue.popleft()
            time = self._level[u] + seconds
            if time > self._level[v] + LOOSE:
                self._level[v], self._cause[v] = time, reason
                queue.extend(self._steps_from(v))

    def isolate(self, points: range) -> None:
        """Remove all inequalities of successive points of which the others have no chain."""
        links = dict.fromkeys(link for p in points for link in (*self._out.get(p, ()), *self._in.get(p, ())))
        for p in points:
            self._level[p] = self._earliest[p] = self._least[p] = -inf
            self._cause[p] = None
        self.remove(links)
        for p in points:
            self._out.pop(p, None)
            self._in.pop(p, None)

    def _steps_from(self, point: int) -> list[Step]:
        steps = [(point, link.v, link.seconds, link) for link in self._out.get(point, ())]
        if self._least[point] > -inf:
            steps.insert(0, (point, point + 1, self._least[point], _BEFORE))
        return steps

    def _steps_to(self, point: int) -> list[Step]:
        steps = [(link.u, point, link.seconds, link) for link in self._in.get(point, ())]
        if self._earliest[point] > -inf:
            steps.insert(0, (ORIGIN, point, self._earliest[point], _EARLIEST))
        elif self._least[point - 1] > -inf:
            steps.insert(0, (point - 1, point, self._least[point - 1], _BEFORE))
        return steps

    def _cycle(self, last: Step) -> list[Link]:
        """Return the cycle that a step closes with those from which the time of its tail follows."""
        u, v, seconds, reason = last
        chain, place = [Link(u, v, seconds) if reason is _BEFORE else reason], {v: 0}
        while (point := chain[-1].u) not in place:
            place[point] = len(chain)
            before = self._cause[point]
            assert before is not None, "all times follow from point 0"
            if before is _BEFORE:
                before = Link(point - 1, point, self._least[point - 1])
            elif before is _EARLIEST:
                before = Link(ORIGIN, point, self._earliest[point])
            chain.append(before)
        # While times rise, those at the other end of the chain may form a cycle already.
        return chain[place[point] :][::-1]


def conflicts_of(problem: Problem) -> list[Conflict]:
    """Return the conflicts of a problem, each without the parts that earlier ones drop.

    Relations are added in the order of the document. One that contradicts those before is a conflict, and
    the part that `choose` drops is removed with all that refers to it. If it drops nothing, the search ends.
    """
    relations = problem.equalities + problem.orders
    named = {p for relation in relations for p in relation[:2]}
    # Of the others, only those of behaviours with greatest lengths are in the network.
    for timing, first in zip(problem.timings, problem.first, strict=True):
        named.update((first,) if timing.most is None else range(first, first + len(timing.points)))
    points = sorted({ORIGIN, *named})
    place = {p: k for k, p in enumerate(points)}
    begins = [*(place[first] for first in problem.first), len(points)]
    network = ConstraintNetwork(len(points))
    _add_lengths(network, problem, points, begins)
    number = {part: n for n, part in enumerate(problem.behaviours)}
    links: dict[Part, list[Link]] = {}  # of the present constraints
    constraints: dict[str, list[Part]] = {}  # that name a behaviour
    for part in dict.fromkeys(r.part for r in relations if r.part.is_constraint):
        links[part] = []
        for name in part.names:
            constraints.setdefault(name, []).append(part)
    gone: set[Part] = set()
    absent: set[int] = set()  # numbers of behaviours
    conflicts: list[Conflict] = []

    def drop(part: Part) -> None:
        gone.add(part)
        network.remove(links.pop(part, ()))
        if (n := number.get(part)) is not None:
            absent.add(n)
            network.isolate(range(begins[n], begins[n + 1]))
            for constraint in constraints.get(part.id, ()):
                drop(constraint)

    for k, relation in enumerate(work.counted(relations, 2)):
        u, v, seconds, part, _ = relation
        ends = problem.owner[u], problem.owner[v]
        u, v = place[u], place[v]
        if k < len(problem.equalities):  # time[u] = time[v] + seconds
            pair = [Link(v, u, seconds, relation), Link(u, v, -seconds, relation)]
        else:
            pair = [Link(u, v, seconds, relation)]
        for link in pair:
            while part not in gone and absent.isdisjoint(ends):
                cycle = network.add(link)
                if not cycle:
                    if part.is_constraint:
                        links[part].append(link)
                    break
                conflict = conflict_of(
                    problem,
                    [step.order or Link(points[step.u], points[step.v], step.seconds) for step in cycle],
                )
                conflicts.append(conflict)
                dropped = choose(conflict)
                if dropped is None:
                    return conflicts
                drop(dropped)
    return conflicts


def _add_lengths(
    network: ConstraintNetwork, problem: Problem, points: Sequence[int], begins: Sequence[int]
) -> None:
    """Add the inequalities that behaviours state by themselves: their lengths and earliest starts.

    The network has some of the points; those of behaviour b are from number begins[b] on.
    """
    ties = UnionFind(len(problem.owner))
    for u, v, seconds, _, _ in work.counted(problem.equalities):
        ties.tie(u, v, seconds)
    for b, (timing, first) in enumerate(work.counted(zip(problem.timings, problem.first, strict=True), 5)):
        begin, places = begins[b], [p - first for p in points[begins[b] : begins[b + 1]]]
        if timing.rigid:
            network.add_chain(begin, problem.earliest[b], ())
            continue
        least = timing.least.tolist()
        if timing.most is None and len(places) > 1:
            drop_least_gaps(least, [(i, (ties.find(first + i), ties.shift[first + i])) for i in places])
        network.add_chain(begin, problem.earliest[b], [sum(least[i:j]) for i, j in pairwise(places)])
        for k, seconds in enumerate(() if timing.most is None else timing.most.tolist(), begin):
            if seconds < inf:
                network.add(Link(k + 1, k, -seconds))
