"""Conflicts: cycles of relations between sync points that cannot hold together, and their words."""

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from bml_schema import SyncRef
from realizer.core import work
from realizer.scheduling.problem import ORIGIN, Part, Problem, Relation
from realizer.scheduling.timing import Clause, Warning


class LengthBound(NamedTuple):
    """The least length of a behaviour between two of its points, or the greatest if `most`."""

    part: Part
    begin: str
    end: str
    seconds: float
    most: bool = False


@dataclass(slots=True, eq=False)
class Link:
    """One inequality of a cycle: time[v] >= time[u] + seconds; a bound (the earliest start) has u = ORIGIN.

    `order` is its relation, None for a gap or a bound.
    """

    u: int
    v: int
    seconds: float
    order: Relation | None = None


@dataclass(slots=True, eq=False)
class Conflict:
    """A minimal set of relations that cannot hold together."""

    relations: tuple[Relation, ...]  # the equalities and orders, in the order of their chain
    gaps: tuple[LengthBound, ...] = ()  # least and greatest lengths, one for each section of a behaviour
    # the point that would come before its earliest time, and that in seconds, or None
    earliest: tuple[Part, str, float] | None = None
    named: tuple[Part, ...] = ()  # the behaviours of the points, also those that state none of the relations

    parts: list[Part] = field(init=False)  # that state the relations and gaps, each once

    def __post_init__(self) -> None:
        self.parts = list(dict.fromkeys([*(r.part for r in self.relations), *(g.part for g in self.gaps)]))

    @property
    def candidates(self) -> list[Part]:
        """The parts of which one can be dropped, by kind; none if everything is required."""
        optional = [part for part in self.parts if not part.required]
        constraints = [part for part in optional if part.is_constraint]
        return constraints or optional or [part for part in self.named if not part.required]

    @property
    def clauses(self) -> dict[Clause, Part]:
        """What the conflict consists of, in the order of its chain, and which part states it."""
        found = {Clause(r.part.id, r.part.line, _relation(r)): r.part for r in self.relations}
        found |= {Clause(g.part.id, g.part.line, _gap(g)): g.part for g in self.gaps}
        if self.earliest is not None:
            part, point, seconds = self.earliest
            found[Clause(part.id, None, f"{point} is not before {_seconds(seconds)}")] = part
        return found

    @property
    def statements(self) -> int:
        return len(self.relations) + len(self.gaps) + (self.earliest is not None)


class ConstraintGraph:
    """A graph of equalities, apart from some (by number), for searching the shortest chains."""

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
    return Conflict(tuple(unique.values()), tuple(gaps), earliest, tuple(dict.fromkeys(owners)))


def _joined(first: LengthBound, second: LengthBound) -> list[LengthBound]:
    """Join two successive lengths of a cycle, if they are of one kind and meet."""
    if first.part is second.part and first.most is second.most:
        seconds = first.seconds + second.seconds
        if first.most and first.begin == second.end:
            return [LengthBound(first.part, second.begin, first.end, seconds, True)]
        if not first.most and first.end == second.begin:
            return [LengthBound(first.part, first.begin, second.end, seconds)]
    return [first, second]


IMPOSSIBLE = "IMPOSSIBLE_TO_SCHEDULE"
# In a sentence; `Warning.clash` has all.
MAX_CLAUSES = 30


def choose(clash: Conflict) -> Part | None:
    """Return the part to drop: an optional constraint before any behaviour, then the lowest priority.

    Of equal ones it is the later in the document; speech is the last. A behaviour that is only referred to
    stays if another one states a relation or gap. Return None if everything is required.
    """
    return max(
        clash.candidates, key=lambda part: (not part.is_spoken, -part.priority, part.order), default=None
    )


def choose_statement(clash: Conflict) -> Relation | None:
    """Return the statement to give up so that no behaviour is dropped, or None.

    Speech gives up the reference of its last point that has one; that of its start only if it is to another
    behaviour, or if nothing else can go. Any behaviour gives up a start before the start of its block.
    Optional constraints go first.
    """
    if any(part.is_constraint for part in clash.candidates):
        return None
    stated = [r for r in clash.relations if r.words[1] == "=" and r.u != ORIGIN and not r.part.required]
    spoken = [r for r in stated if r.part.is_spoken and not r.part.is_constraint]
    if later := [r for r in spoken if not _is_start(r)]:
        return later[-1]
    if starts := [r for r in spoken if r.v != ORIGIN or all(p.is_spoken for p in clash.candidates)]:
        return starts[-1]
    if clash.earliest is not None:
        early = [r for r in stated if r.part is clash.earliest[0] and _is_start(r) and not _is_foreign(r)]
        return early[-1] if early else None
    return None


def _is_start(relation: Relation) -> bool:
    return relation.words[0] == f"{relation.part.name}:start"


def _is_foreign(relation: Relation) -> bool:
    """Return whether a relation refers to another block."""
    ref = relation.words[2]
    return isinstance(ref, SyncRef) and ref.block is not None


def release_warning(relation: Relation, clash: Conflict, later: float) -> Warning:
    """Return the warning for a statement that was given up; `later` has the seconds by which it is wrong."""
    clauses = clash.clauses
    by = f"{relation.words[0]} is {abs(later):.3g} s {'later' if later > 0 else 'earlier'}"
    text = f"{relation.statement} was given up: {in_words(clauses)}; {by}"
    return Warning(relation.part.id, IMPOSSIBLE, text, tuple(clauses))


def unknown_warning(part: Part, sync: str, text: str) -> Warning:
    """Return the warning for a reference of speech that has no time."""
    return Warning(part.id, IMPOSSIBLE, f"{part.name}:{sync} was given up{_placed(part, part.line)}: {text}")


def warning_of(clash: Conflict, dropped: Part) -> Warning:
    name, clauses = dropped.name, clash.clauses
    words = in_words(clauses)
    if dropped.is_constraint:
        name = f"constraint {name}" if name else "a constraint without an id"
        text = f"{name} cannot be kept: {words}; a constraint that is not required gives way first"
    else:
        text = f"{name} cannot be placed: {words}; {name} was dropped because {_reason(clash, dropped)}"
    return Warning(dropped.id, IMPOSSIBLE, text, tuple(clauses), dropped.is_constraint)


def refusal(block: str, clash: Conflict) -> Warning:
    text = f"{in_words(clash.clauses)}, and all of this is required"
    return Warning(block, IMPOSSIBLE, text, tuple(clash.clauses))


def fault_warning(part: Part, text: str) -> Warning:
    """Return the warning for a reference to something that does not exist."""
    name = part.name or "a constraint"
    said = f"{name} was dropped{_placed(part, part.line)}: {text}"
    return Warning(part.id, IMPOSSIBLE, said, constraint=part.is_constraint)


def in_words(clauses: Mapping[Clause, Part]) -> str:
    """Return a conflict as the clauses of one sentence, in the order of their chain."""
    unique = list(dict.fromkeys([f"{c.text}{_placed(part, c.line)}" for c, part in clauses.items()]))
    quantity = "all " if len(unique) > 2 else "both " if len(unique) > 1 else ""
    if len(unique) > MAX_CLAUSES:
        unique[MAX_CLAUSES - 1 :] = [f"{len(unique) - MAX_CLAUSES + 1} more such things"]
    return f"{_join(unique)} cannot {quantity}hold"


def _reason(clash: Conflict, dropped: Part) -> str:
    others = [part for part in clash.candidates if part is not dropped]
    if not others:
        required = any(part.required for part in (*clash.parts, *clash.named))
        return "everything else in this is required" if required else "nothing else has a part in this"
    if all(part.priority > dropped.priority for part in others):
        return "its priority is the lowest"
    return "it comes later"


def _relation(relation: Relation) -> str:
    left, sign, right = relation.words
    if sign == "rigid":
        return f"{left} takes exactly {_seconds(relation.seconds)} from its start to {right}"
    return relation.statement


def _placed(part: Part, line: int | None) -> str:
    place = "" if line is None else f"line {line}"
    if part.is_constraint:
        place = ", ".join(filter(None, (f"constraint {part.name}".strip(), place)))
    return f" ({place})" if place else ""


def _gap(gap: LengthBound) -> str:
    name = gap.part.name
    if gap.most:
        return f"{name} takes at most {_seconds(gap.seconds)} from {gap.begin} to {gap.end}"
    if gap.seconds > 0:
        return f"{name} takes at least {_seconds(gap.seconds)} from {gap.begin} to {gap.end}"
    return f"{name}:{gap.end} is not before {name}:{gap.begin}"


def _seconds(value: float) -> str:
    return f"{round(value, 3):g} s"


def _join(clauses: Sequence[str]) -> str:
    return clauses[0] if len(clauses) == 1 else f"{', '.join(clauses[:-1])} and {clauses[-1]}"
