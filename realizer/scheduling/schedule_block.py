"""Scheduling of blocks: solve, drop parts in conflicts, and solve the rest again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from realizer.core.array_types import Float64
from realizer.scheduling.explain import choose, fault_warning, refusal, warning_of
from realizer.scheduling.problem import Member, Part, Problem, problem_of
from realizer.scheduling.solve import Solution, solve
from realizer.scheduling.timing import Schedule, Timing, Warning

if TYPE_CHECKING:
    from bml_schema import Block, SyncRef


def schedule_block(
    block: Block,
    timings: Mapping[str, Timing],
    *,
    earliest: float = 0.0,
    outside: Callable[[SyncRef], float | None] = lambda ref: None,
    priorities: Mapping[str, float] | None = None,
) -> Schedule:
    """Return the sync times of a block: constraints hold, gaps are as near as possible to their preference.

    Free behaviours start as early as they can. In a conflict, an optional constraint is dropped, or else the
    behaviour of the lowest priority that is not required (of equals the later one), with one warning each.

    Args:
        timings: behaviour id -> preferred timing. A behaviour without one counts as absent, and references to
            it are ignored.
        earliest: the earliest start of any behaviour, seconds from block start.
        outside: a reference into another block, with its offset -> seconds from this block's start; None if
            it is unknown, which drops the referring part.
        priorities: behaviour id -> priority, 0 if absent.

    Returns:
        The schedule; `failed`, without times, if required parts are in conflict.
    """
    member = Member(block, timings, earliest=earliest, priorities=priorities or {})
    return schedule_together([member], outside=outside)[0]


def schedule_together(
    members: Sequence[Member], *, outside: Callable[[SyncRef], float | None] = lambda ref: None
) -> list[Schedule]:
    """Return the sync times of a new block and of playing blocks, solved together.

    Args:
        members: the new block first; past points of the others are fixed, all else may move.
        outside: a reference into a block that is no member -> seconds on the members' clock.

    Returns:
        A schedule for each member, from its own start. If the new block fails, only its own.
    """
    new = members[0].block
    problem = problem_of(members, outside)
    warnings: list[Warning] = []
    while True:
        found = _attempt(problem, new.id)
        if isinstance(found, Solution):
            break
        if isinstance(found, Warning):
            return [Schedule(new.id, {}, {}, warnings=(found,), failed=True, character=new.character_id)]
        warnings += (warning for _, warning in found)
        problem = problem.without(part for part, _ in found)
    number = {part.id: n for n, part in enumerate(problem.behaviours)}
    schedules = []
    for member in members:
        times: dict[str, Float64] = {}
        whole = found.time - member.start
        whole.setflags(write=False)
        for node in member.block.behaviours:
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
                warnings=tuple(warnings) if member is members[0] else (),
                cost=found.cost,
                character=member.block.character_id,
            )
        )
    return schedules


def _attempt(problem: Problem, block: str) -> Solution | list[tuple[Part, Warning]] | Warning:
    """Return the solution, or the parts to drop with their warnings, or the warning of a failed block."""
    if problem.faults:
        required = next((fault for fault in problem.faults if fault[0].required), None)
        if required is not None:
            warning = fault_warning(*required)
            return Warning(block, warning.type, f"required: {warning.text}")
        return [(part, fault_warning(part, text)) for part, text in problem.faults]
    clashes = solve(problem)
    if isinstance(clashes, Solution):
        return clashes
    drops: list[tuple[Part, Warning]] = []
    dropped: set[int] = set()
    for clash in clashes:
        # A conflict that a drop of this round may have settled is examined again in the next.
        if any(id(part) in dropped for part in (*clash.parts, *clash.named)):
            continue
        part = choose(clash)
        if part is None:
            return refusal(block, clash)
        dropped.add(id(part))
        drops.append((part, warning_of(clash, part)))
    return drops
