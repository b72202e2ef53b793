"""The scheduling problem of a block: numbered sync points and the relations between them, with reasons."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from bml_schema import After, Before, Behaviour, Block, Constraint, Synchronize, SyncRef
from realizer.core import work
from realizer.scheduling.timing import Timing

# The point of the block's start; it is at 0 and every number is tied to it.
ORIGIN = 0


@dataclass(slots=True, eq=False)
class Part:
    """A part of a document that can be dropped: a behaviour or a constraint."""

    # for warnings, "block:behaviour" or "block:constraint"; of a constraint without an id, its block's
    id: str
    name: str  # for sentences, "nod1"; "" for a constraint without an id
    required: bool = False
    priority: float = 0.0
    order: int = 0  # position in the document, among its own kind
    line: int | None = None  # the line in the document, or None if unknown
    is_constraint: bool = False
    # the behaviours that a constraint names, as "block:behaviour"; it is dropped with any of them
    names: frozenset[str] = frozenset()
    # it is speech: in a conflict it loses references of its own instead of being dropped
    is_spoken: bool = False


class Relation(NamedTuple):
    """A relation between two points.

    As an equality: time[u] = time[v] + seconds. As an order: time[v] >= time[u] + seconds. `part` stated it;
    `words` are the left side, sign and right side for messages, which are formatted when needed.
    """

    u: int
    v: int
    seconds: float
    part: Part
    words: tuple[object, str, object]

    @property
    def statement(self) -> str:
        """The relation in words, such as "s:end = 0.2"."""
        left, sign, right = self.words
        return f"{left} {'is ' if sign != '=' else ''}{sign} {right}"


@dataclass(frozen=True, slots=True)
class Member:
    """A block that is solved together with others, in seconds from the new block's start."""

    block: Block
    # behaviour id -> preferred timing; a behaviour without one is absent, and references to it are ignored
    timings: Mapping[str, Timing]
    start: float = 0.0  # of the block
    earliest: float = 0.0  # the earliest start of its behaviours
    # behaviour id -> sync point -> its past time, which is fixed. Later points are not before `earliest`.
    passed_times: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    is_fixed: bool = False  # its behaviours are never dropped, because it plays already
    # behaviour id -> priority, 0 if absent; in a conflict the lowest is dropped
    priorities: Mapping[str, float] = field(default_factory=dict)
    # behaviour id -> seconds by which it is later than its references into other blocks say
    late: Mapping[str, float] = field(default_factory=dict)
    # pairs of which the first ends before the second starts; behaviour ids, or fixed times
    sequences: Sequence[tuple[str | float, str | float]] = ()


@dataclass(slots=True)
class Problem:
    """The scheduling problem of one or more blocks.

    Point 0 is the block's start; behaviour b owns the k points from first[b] on, in document order. The gaps
    of a behaviour that is not rigid cost stiffness * (gap - preferred)^2 and are at least `least`.
    """

    behaviours: list[Part] = field(default_factory=list)
    timings: list[Timing] = field(default_factory=list)
    first: list[int] = field(default_factory=list)
    earliest: list[float] = field(default_factory=list)  # (behaviours,) seconds, the earliest start of each
    # (points,) behaviour number of each point; -1 for the block's start
    owner: list[int] = field(default_factory=lambda: [-1])
    equalities: list[Relation] = field(default_factory=list)
    orders: list[Relation] = field(default_factory=list)
    # invalid parts with the reason: a reference to a sync point that does not exist
    faults: list[tuple[Part, str]] = field(default_factory=list)
    # the parts that refer to other blocks, of the new block
    external: list[Part] = field(default_factory=list)
    # statements that were given up, so that the behaviours that make them stay
    released: list[Relation] = field(default_factory=list)
    # (behaviour, its sync point, why the reference of that point was given up at once)
    unknown: list[tuple[Part, str, str]] = field(default_factory=list)

    def add(self, part: Part, timing: Timing, earliest: float = 0.0) -> int:
        """Add a behaviour; return the number of its first point."""
        first, k = len(self.owner), len(timing.points)
        self.owner += [len(self.behaviours)] * k
        self.behaviours.append(part)
        self.timings.append(timing)
        self.first.append(first)
        self.earliest.append(earliest)
        if timing.rigid:
            at = np.cumsum(timing.preferred).tolist()
            for i, seconds in enumerate(at, 1):
                words = (part.name, "rigid", timing.points[i])
                self.equalities.append(Relation(first + i, first, seconds, part, words))
        return first

    def name_of(self, point: int) -> str:
        """Return the point as in documents: "nod1:start"; "bml:start" for the block's start."""
        if point == ORIGIN:
            return "bml:start"
        b = self.owner[point]
        return f"{self.behaviours[b].name}:{self.timings[b].points[point - self.first[b]]}"

    def without(self, dropped: Iterable[Part]) -> Problem:
        """Return the problem without some parts and the references to them."""
        gone = {id(part): part.id for part in dropped}
        lost = {part.id for part in self.behaviours if id(part) in gone}
        gone.update((id(r.part), "") for r in (*self.equalities, *self.orders) if r.part.names & lost)
        number = {ORIGIN: ORIGIN}
        smaller = Problem()
        for b, part in enumerate(work.counted(self.behaviours, 2)):
            if id(part) not in gone:
                old, new = self.first[b], smaller.add(part, self.timings[b], self.earliest[b])
                number.update((old + i, new + i) for i in range(len(self.timings[b].points)))
        for u, v, seconds, part, words in work.counted(self.equalities):
            # `add` has already made the equalities of a rigid behaviour.
            if id(part) not in gone and u in number and v in number and words[1] != "rigid":
                smaller.equalities.append(Relation(number[u], number[v], seconds, part, words))
        for u, v, seconds, part, words in work.counted(self.orders):
            if id(part) not in gone and u in number and v in number:
                smaller.orders.append(Relation(number[u], number[v], seconds, part, words))
        for u, v, seconds, part, words in self.released:
            if id(part) not in gone and u in number and v in number:
                smaller.released.append(Relation(number[u], number[v], seconds, part, words))
        smaller.faults = [fault for fault in self.faults if id(fault[0]) not in gone]
        smaller.unknown = [lost for lost in self.unknown if id(lost[0]) not in gone]
        return smaller

    def released_from(self, statements: Iterable[Relation]) -> Problem:
        """Return the problem without some equalities, whose behaviours stay."""
        gone = {id(relation): relation for relation in statements}
        kept = [relation for relation in self.equalities if id(relation) not in gone]
        return replace(self, equalities=kept, released=[*self.released, *gone.values()])


def problem_of(
    members: Sequence[Member], outside: Callable[[SyncRef], float | None] = lambda ref: None
) -> Problem:
    """Return the problem of one or more blocks.

    `members` has the new block first; messages name the behaviours of the others with their block. `outside`
    maps a reference into a block that is no member, with its offset, to seconds on the members' clock, or
    None.
    """
    problem, own = Problem(), members[0].block.id
    first: dict[tuple[str, str], int] = {}
    present: list[tuple[Member, Behaviour, Part, int, tuple[str, ...]]] = []
    for member in members:
        block, required, places = member.block, member.block.required, member.block.places
        for order, node in enumerate(work.counted(block.behaviours, 3)):
            id = node.id
            timing = member.timings.get(id)
            if timing is None or (block.id, id) in first:
                continue
            place = places.get(id)
            full = f"{block.id}:{id}"
            part = Part(
                full,
                id if block.id == own else full,
                member.is_fixed or id in required,
                member.priorities.get(id, 0.0),
                order,
                place.line if place is not None else None,
                is_spoken=node.marks,
            )
            # `_pass` bounds the future points of a block that has begun.
            earliest = -np.inf if id in member.passed_times else member.earliest
            start = first[block.id, id] = problem.add(part, timing, earliest)
            present.append((member, node, part, start, timing.points))
    resolvers = {
        m.block.id: _ReferenceResolver(m, {o.block.id: o for o in members}, first, outside) for m in members
    }
    for member, node, part, start, points in work.counted(present, 3):
        passed = member.passed_times.get(node.id, {})
        if node.id in member.passed_times:
            _pass(problem, member, part, start, points, passed)
        resolver = resolvers[member.block.id]
        late = member.late.get(node.id, 0.0)
        for sync, ref in node.references:
            try:
                if (target := resolver.point(ref, late)) is None:
                    continue
                if sync not in points:
                    raise LookupError(f"{node.id} has no {sync}, only {', '.join(points)}")
            except LookupError as fault:
                if member.is_fixed:
                    continue  # it plays already, and the point has been forgotten since
                if part.is_spoken and not part.required:
                    problem.unknown.append((part, sync, str(fault)))
                    continue
                problem.faults.append((part, str(fault)))
                break
            if not member.is_fixed and _is_backwards(node.id, sync, ref):
                why = f"{ref} would leave it no length"
                problem.unknown.append((part, sync, why))
                continue
            if target[0] == ORIGIN and sync in passed:
                continue  # the other end may have moved since
            words = (f"{part.name}:{sync}", "=", ref)
            problem.equalities.append(Relation(start + points.index(sync), *target, part, words))
            if not resolver.is_own(ref) and member is members[0]:
                problem.external.append(part)
    for member in members:
        _add_sequences(problem, member, first)
        for order, constraint in enumerate(work.counted(member.block.constraints, 10)):
            _add_constraint(problem, resolvers[member.block.id], constraint, order)
    return problem


def _is_backwards(id: str, sync: str, ref: SyncRef) -> bool:
    """Return whether a behaviour begins at its own end, or ends at its own start."""
    own = ref.behaviour == id and ref.block is None
    return own and (
        (sync == "start" and ref.sync == "end" and ref.offset >= 0)
        or (sync == "end" and ref.sync == "start" and ref.offset <= 0)
    )


def _pass(
    problem: Problem,
    member: Member,
    part: Part,
    first: int,
    points: tuple[str, ...],
    when: Mapping[str, float],
) -> None:
    later = False
    for i, sync in enumerate(points):
        if sync in when:
            words = (f"{part.name}:{sync}", "=", f"the time at which it passed, {when[sync]:.3f}")
            problem.equalities.append(Relation(first + i, ORIGIN, when[sync], part, words))
        elif not later:
            later = True
            words = (f"{part.name}:{sync}", "not before", "now")
            problem.orders.append(Relation(ORIGIN, first + i, member.earliest, part, words))


def _add_sequences(problem: Problem, member: Member, first: Mapping[tuple[str, str], int]) -> None:
    """Add an order for each pair of `member.sequences`; it goes with the later behaviour of the two."""
    for pair in member.sequences:
        behaviours = [(member.block.id, name) for name in pair if isinstance(name, str)]
        if any(name not in first for name in behaviours):
            continue
        numbers = [problem.owner[first[name]] for name in behaviours]
        earlier, later = pair
        u = v = ORIGIN
        seconds = 0.0
        if isinstance(earlier, str):
            n = numbers[0]
            u = problem.first[n] + len(problem.timings[n].points) - 1
            left = f"{earlier}:end"
        else:
            seconds, left = earlier, f"{earlier:.3f}"
        if isinstance(later, str):
            v = problem.first[numbers[-1]]
            right = f"{later}:start"
        else:
            seconds, right = -later, f"{later:.3f}"
        problem.orders.append(
            Relation(u, v, seconds, problem.behaviours[max(numbers)], (right, "not before", left))
        )


def _add_constraint(
    problem: Problem, resolver: _ReferenceResolver, constraint: Constraint, order: int
) -> None:
    member = resolver.member
    block = member.block
    named = {ref.behaviour for ref in constraint.references if resolver.is_own(ref)} - {None, "bml"}
    if not all((block.id, name) in resolver.first for name in named):
        return
    place = block.places.get(constraint.id) if constraint.id else constraint.place
    part = Part(
        f"{block.id}:{constraint.id}" if constraint.id else block.id,
        constraint.id or "",
        constraint.required or member.is_fixed,
        order=order,
        line=place.line if place is not None else None,
        is_constraint=True,
        names=frozenset(f"{block.id}:{name}" for name in named),
    )
    late = max((member.late.get(name, 0.0) for name in named if name is not None), default=0.0)
    if not member.is_fixed and not all(map(resolver.is_own, constraint.references)):
        problem.external.append(part)
    try:
        for piece in constraint.parts:
            members = [(*resolver.required_point(ref, late), ref) for ref in piece.refs]
            target = piece.refs[0] if isinstance(piece, Synchronize) else piece.ref
            r, target_offset = resolver.required_point(target, late)
            for x, offset, ref in members:
                if isinstance(piece, Before):
                    words = (ref, "not after", target)
                    problem.orders.append(Relation(x, r, offset - target_offset, part, words))
                elif isinstance(piece, After):
                    words = (ref, "not before", target)
                    problem.orders.append(Relation(r, x, target_offset - offset, part, words))
                elif ref is not target:
                    problem.equalities.append(
                        Relation(x, r, target_offset - offset, part, (target, "=", ref))
                    )
    except LookupError as fault:
        if not member.is_fixed:  # else the point has been forgotten since
            problem.faults.append((part, str(fault)))


@dataclass(slots=True, eq=False)
class _ReferenceResolver:
    """Maps sync references of one member to (point, seconds after it)."""

    member: Member
    members: Mapping[str, Member]
    first: Mapping[tuple[str, str], int]
    outside: Callable[[SyncRef], float | None]

    def is_own(self, ref: SyncRef) -> bool:
        return ref.block is None or ref.block == self.member.block.id

    def required_point(self, ref: SyncRef, late: float = 0.0) -> tuple[int, float]:
        """Return the point of a reference, as `point`; raise LookupError if its behaviour is absent."""
        point = self.point(ref, late)
        if point is None:
            raise LookupError(f"{ref} is not known")
        return point

    def external_time(self, ref: SyncRef) -> float:
        """Return the seconds, on the members' clock, of a point outside this problem."""
        time = self.outside(ref)
        if time is None:
            raise LookupError(f"{ref} is not known here, or its time is not known yet")
        return float(time)

    def point(self, ref: SyncRef, late: float = 0.0) -> tuple[int, float] | None:
        """Return the point of a reference, those of other blocks `late` seconds later; None if it is absent.

        Raises:
            LookupError: there is no such sync point; the message has the existing ones.
        """
        member = self.member if ref.block is None else self.members.get(ref.block)
        name = ref.behaviour
        is_own = self.is_own(ref)
        if member is None or (name == "bml" and not is_own):
            return ORIGIN, self.external_time(ref) + late
        if name == "bml" and ref.sync != "start":
            raise LookupError(f"{ref}: of its own block only bml:start can be referred to")
        if name is None or name == "bml":
            return ORIGIN, member.start + ref.offset
        first = self.first.get((member.block.id, name))
        if first is None:
            return None if is_own else (ORIGIN, self.external_time(ref) + late)
        points = member.timings[name].points
        if ref.point not in points:
            raise LookupError(f"{ref}: {name} has no {ref.point}, only {', '.join(points)}")
        return first + points.index(ref.point), ref.offset + (0.0 if is_own else late)
