"""Scheduling of blocks: solve, drop parts in conflicts, and solve the rest again."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from math import inf
from typing import NamedTuple

from bml_schema import SyncRef
from realizer.core import work
from realizer.core.array_types import Float64
from realizer.scheduling.conflict import choose, fault_warning, refusal, warning_of
from realizer.scheduling.graphs import UnionFind
from realizer.scheduling.model import TIGHT
from realizer.scheduling.problem import ORIGIN, Member, Part, Problem, problem_of
from realizer.scheduling.solve import Solution, solve
from realizer.scheduling.timing import Schedule, Warning

# Behaviours may begin so much earlier where it is asked how late they are.
LONG_AGO = 1e6  # s


def schedule_together(
    members: Sequence[Member],
    *,
    outside: Callable[[SyncRef], float | None] = lambda ref: None,
    grace: float = 0.0,
) -> list[Schedule]:
    """Return the sync times of a new block and of playing blocks, solved together, each from its own start.

    Constraints hold, gaps are as near as possible to their preference, free behaviours start as early as they
    can. In a conflict, an optional constraint is dropped, or else the behaviour of the lowest priority that
    is not required (of equals the later one), with one warning each.

    Behaviours that would have to start before their block, because a point of another block that they refer
    to has just passed, start as soon as they can and keep their lengths, if that is within `grace`. If not,
    they are late by `grace` and shorter, or dropped if that is not enough. If the new block fails, only its
    own schedule is returned.

    Args:
        members: the new block first; past points of the others are fixed, all else may move.
        outside: a reference into a block that is no member, with its offset -> seconds on the members' clock;
            None if it is unknown, which drops the referring part.
    """
    new = members[0].block
    problem = problem_of(members, outside)
    outcome = in_time = _settle(problem, new.id)
    late: dict[str, float] = {}
    if grace > 0 and outcome.warnings and problem.external:
        late = _lateness(problem, new.id)
        shifts = {behaviour: min(seconds, grace) for behaviour, seconds in late.items()}
        while shifts:
            shifted = [replace(members[0], late=shifts), *members[1:]]
            outcome = _settle(problem_of(shifted, outside), new.id)
            lost = {id.removeprefix(f"{new.id}:") for part in outcome.lost for id in (part.id, *part.names)}
            # Behaviours that are tied to each other are equally late.
            too_late = {late[behaviour] for behaviour in lost & shifts.keys() if late[behaviour] > grace}
            if not too_late:
                members = shifted
                break
            shifts = {behaviour: by for behaviour, by in shifts.items() if late[behaviour] not in too_late}
            outcome = in_time
    warnings = tuple(outcome.warnings)
    if late:
        warnings = tuple(
            _with_lateness(w, late.get(w.id.removeprefix(f"{new.id}:"), 0.0), grace) for w in warnings
        )
    if outcome.solution is None:
        return [Schedule(new.id, {}, {}, warnings=warnings[-1:], failed=True, character=new.character_id)]
    problem, found = outcome.problem, outcome.solution
    lost_constraints = tuple(part.order for part in outcome.lost if part.is_constraint)
    number = {part.id: n for n, part in enumerate(problem.behaviours)}
    schedules = []
    for member in members:
        times: dict[str, Float64] = {}
        whole = found.time - member.start
        whole.setflags(write=False)
        for node in work.counted(member.block.behaviours):
            n = number.get(f"{member.block.id}:{node.id}")
            if n is not None and node.id not in times:
                first, k = problem.first[n], len(problem.timings[n].points)
                times[node.id] = whole[first : first + k]
        schedules.append(
            Schedule(
                member.block.id,
                {name: member.timings[name].points for name in times},
                times,
                start=member.start,
                warnings=warnings if member is members[0] else (),
                cost=found.cost,
                late={name: seconds for name, seconds in member.late.items() if name in times},
                lost_constraints=lost_constraints if member is members[0] else (),
                character=member.block.character_id,
            )
        )
    return schedules


class _Outcome(NamedTuple):
    """The solution of a problem without the parts that were dropped, or None if all of it is refused."""

    solution: Solution | None
    problem: Problem
    warnings: Sequence[Warning]
    lost: Sequence[Part] = ()


def _settle(problem: Problem, block: str) -> _Outcome:
    """Solve a problem, again without the parts that cannot be placed, until all that is left fits."""
    warnings: list[Warning] = []
    lost: list[Part] = []
    while True:
        found = _attempt(problem, block)
        if isinstance(found, Solution):
            return _Outcome(found, problem, warnings, lost)
        if isinstance(found, Warning):
            return _Outcome(None, problem, [*warnings, found], lost)
        warnings += (warning for _, warning in found)
        lost += (part for part, _ in found)
        problem = problem.without(part for part, _ in found)


def _lateness(problem: Problem, block: str) -> dict[str, float]:
    """Return behaviour -> seconds by which it starts too early if its references into other blocks hold.

    Behaviours that are tied to each other are late together, so that they keep their distances.
    """
    own = {n: part for n, part in enumerate(problem.behaviours) if part.id.startswith(f"{block}:")}
    groups = UnionFind(len(problem.behaviours))
    for relation in problem.equalities:
        u, v = problem.owner[relation.u], problem.owner[relation.v]
        if u in own and v in own:
            groups.tie(u, v, 0.0)
    number = {part.id: n for n, part in own.items()}
    for part in problem.external:
        members = [number[id] for id in part.names if id in number]
        for n in members[1:]:
            groups.tie(members[0], n, 0.0)
    named = {part.id for part in problem.external}.union(*(part.names for part in problem.external))
    tied = {groups.find(n) for n, part in own.items() if part.id in named}
    own = {n: part for n, part in own.items() if groups.find(n) in tied}
    earliest = [t - LONG_AGO if n in own else t for n, t in enumerate(problem.earliest)]
    outcome = _settle(replace(problem, earliest=earliest), block)
    if outcome.solution is None:
        return {}
    starts = {
        part.id: float(outcome.solution.time[first])
        for part, first in zip(outcome.problem.behaviours, outcome.problem.first, strict=True)
    }
    late: dict[int, float] = {}
    for n, part in own.items():
        too_early = problem.earliest[n] - starts.get(part.id, inf)
        late[groups.find(n)] = max(late.get(groups.find(n), 0.0), too_early)
    group = [groups.find(number[b.id]) if b.id in number else None for b in outcome.problem.behaviours]
    for free, later in _room(outcome, group, {g for g, by in late.items() if by > LONG_AGO / 2}).items():
        late[free] -= later
    return {
        part.id.removeprefix(f"{block}:"): seconds
        for n, part in own.items()
        if (seconds := late[groups.find(n)]) > TIGHT
    }


def _room(outcome: _Outcome, group: Sequence[int | None], free: Collection[int]) -> dict[int, float]:
    """Return by how many seconds each free group, which nothing keeps from starting earlier, can be later.

    `group` has the group of each behaviour of the outcome, or None.
    """
    assert outcome.solution is not None
    time, orders = outcome.solution.time, list[tuple[int, int | None, float]]()
    for u, v, seconds, *_ in outcome.problem.orders if free else ():
        before, after = (None if point == ORIGIN else group[outcome.problem.owner[point]] for point in (u, v))
        if before in free and before is not None and before != after:
            orders.append((before, after if after in free else None, float(time[v] - time[u]) - seconds))
    room = dict.fromkeys(free, inf)
    for _ in work.counted(free):  # each round reaches the groups before those of the last one
        known = dict(room)
        for before, after, gap in work.counted(orders):
            room[before] = min(room[before], gap + (0.0 if after is None else room[after]))
        if room == known:
            break
    return room


def _with_lateness(warning: Warning, late: float, grace: float) -> Warning:
    """Return the warning about a dropped behaviour with how late it was, if it was too late."""
    if late <= grace:
        return warning
    return replace(
        warning, text=f"{warning.text}; it comes {late:.3g} s too late, and the grace is {grace:g} s"
    )


def _attempt(problem: Problem, block: str) -> Solution | list[tuple[Part, Warning]] | Warning:
    if problem.faults:
        required = next((fault for fault in problem.faults if fault[0].required), None)
        if required is not None:
            warning = fault_warning(*required)
            return Warning(block, warning.type, f"required: {warning.text}")
        return [(part, fault_warning(part, text)) for part, text in problem.faults]
    clashes = solve(problem)
    if isinstance(clashes, Solution):
        return clashes
    drops: dict[Part, Warning] = {}
    for clash in work.counted(clashes, 20):
        # A conflict that a drop of this round may have settled is examined again in the next.
        if not (drops.keys().isdisjoint(clash.parts) and drops.keys().isdisjoint(clash.named)):
            continue
        part = choose(clash)
        if part is None:
            return refusal(block, clash)
        drops[part] = warning_of(clash, part)
    return list(drops.items())
