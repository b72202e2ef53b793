"""Conflicts: cycles of relations between sync points that cannot hold together."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from realizer.core import work
from realizer.scheduling.problem import ORIGIN, Part, Problem, Relation


@dataclass(frozen=True, slots=True)
class LengthBound:
    """The least length of a behaviour between two of its points, or the greatest if `most`."""

    part: Part
    begin: str
    end: str
    seconds: float
    most: bool = False


@dataclass(frozen=True, slots=True)
class Link:
    """One inequality of a cycle: time[v] >= time[u] + seconds.

    `order` is its relation, None for a gap or a bound; a bound (the earliest start) has u = ORIGIN.
    """

    u: int
    v: int
    seconds: float
    order: Relation | None = None


@dataclass(frozen=True, slots=True)
class Conflict:
    """A minimal set of relations that cannot hold together.

    Attributes:
        relations: the equalities and orders, in the order of their chain.
        gaps: least and greatest lengths, one for each section of a behaviour.
        earliest: the point that would come before its earliest time, and that in seconds, or None.
        named: the behaviours of the points, also those that state none of the relations.
    """

    relations: tuple[Relation, ...]
    gaps: tuple[LengthBound, ...] = ()
    earliest: tuple[Part, str, float] | None = None
    named: tuple[Part, ...] = ()

    @property
    def parts(self) -> list[Part]:
        """The parts that state the relations and gaps, each once."""
        return _once([r.part for r in self.relations] + [g.part for g in self.gaps])

    @property
    def statements(self) -> int:
        """The number of statements in the conflict."""
        return len(self.relations) + len(self.gaps) + (self.earliest is not None)


class ConstraintGraph:
    """A graph of the equalities of a problem, for searching the shortest chains.

    Args:
        contradicting: numbers of equalities that are left out.
    """

    def __init__(self, problem: Problem, contradicting: Iterable[int] = ()) -> None:
        self.problem = problem
        self._neighbours: dict[int, list[tuple[int, Relation]]] = {}
        left_out = set(contradicting)
        for k, relation in enumerate(problem.equalities):
            if k not in left_out:
                self._neighbours.setdefault(relation.u, []).append((relation.v, relation))
                self._neighbours.setdefault(relation.v, []).append((relation.u, relation))

    def loop(self, contradicting: int) -> Conflict:
        """Return the conflict of an equality, by its number, with those that connect its points."""
        last = self.problem.equalities[contradicting]
        return _conflict(self.problem, [*self._chain(last.u, last.v), last], [])

    def cycle(self, links: Sequence[Link]) -> Conflict:
        """Return the conflict of a cycle of inequalities, whose links are connected by equalities."""
        relations: list[Relation] = []
        for link, after in zip(links, (*links[1:], links[0]), strict=True):
            if link.order is not None:
                relations.append(link.order)
            relations += self._chain(link.v, after.u)
        return _conflict(self.problem, relations, links)

    def _chain(self, begin: int, end: int) -> list[Relation]:
        """Return the fewest equalities that connect one point to another."""
        previous: dict[int, tuple[int, Relation] | None] = {begin: None}
        queue = deque([begin])
        while queue and end not in previous:
            work.count()
            at = queue.popleft()
            for to, relation in self._neighbours.get(at, ()):
                if to not in previous:
                    previous[to] = (at, relation)
                    queue.append(to)
        chain: list[Relation] = []
        step = previous.get(end)
        while step is not None:
            chain.append(step[1])
            step = previous[step[0]]
        return chain[::-1]


def conflict_of(problem: Problem, steps: Iterable[Relation | Link]) -> Conflict:
    """Return the conflict of the steps of a cycle."""
    steps = list(steps)
    links = [step for step in steps if isinstance(step, Link)]
    relations = [step if isinstance(step, Relation) else step.order for step in steps]
    return _conflict(problem, [r for r in relations if r is not None], links)


def _conflict(problem: Problem, relations: Sequence[Relation], links: Sequence[Link]) -> Conflict:
    gaps: list[LengthBound] = []
    earliest = None
    points = {p for r in relations for p in (r.u, r.v)}
    for link in links:
        if link.order is not None:
            continue
        if link.u == ORIGIN:
            b = problem.owner[link.v]
            earliest = (problem.behaviours[b], problem.name_of(link.v), problem.earliest[b])
            continue
        b = problem.owner[link.u]
        part, names, first = problem.behaviours[b], problem.timings[b].points, problem.first[b]
        most = link.u > link.v  # a greatest length leads backwards
        begin, end = sorted((link.u - first, link.v - first))
        gap = LengthBound(part, names[begin], names[end], abs(link.seconds), most)
        gaps[-1:] = _joined(gaps[-1], gap) if gaps else [gap]
    if len(gaps) > 1 and len(ring := _joined(gaps[-1], gaps[0])) == 1:
        gaps[0] = ring[0]
        gaps.pop()
    owners = [problem.behaviours[problem.owner[p]] for p in sorted(points) if p != ORIGIN]
    unique = {id(r): r for r in relations}
    return Conflict(tuple(unique.values()), tuple(gaps), earliest, tuple(_once(owners)))


def _joined(first: LengthBound, second: LengthBound) -> list[LengthBound]:
    """Join two successive lengths of a cycle, if they are of one kind and meet."""
    if first.part is second.part and first.most is second.most:
        seconds = first.seconds + second.seconds
        if first.most and first.begin == second.end:
            return [LengthBound(first.part, second.begin, first.end, seconds, True)]
        if not first.most and first.end == second.begin:
            return [LengthBound(first.part, first.begin, second.end, seconds)]
    return [first, second]


def _once(parts: Iterable[Part]) -> list[Part]:
    return list({id(part): part for part in parts}.values())
