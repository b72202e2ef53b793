"""Scheduling of blocks: solve, let something give way, and solve again, until all that is left fits."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import replace
from math import inf
from typing import TypeAlias

import numpy as np

from bml_schema import SyncRef
from realizer.core import work
from realizer.core.array_types import Float64
from realizer.scheduling.conflict import (
    Conflict,
    choose,
    choose_statement,
    fault_warning,
    refusal,
    release_warning,
    unknown_warning,
    warning_of,
)
from realizer.scheduling.graphs import UnionFind
from realizer.scheduling.model import TIGHT
from realizer.scheduling.problem import ORIGIN, Member, Part, Problem, Relation, problem_of
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
    can. `RULES` say what gives way where not all of this can hold, with one warning for each dropped part. If
    the new block fails, only its own schedule is returned.

    Args:
        members: the new block first; past points of the others are fixed, all else may move.
        outside: a reference into a block that is no member, with its offset -> seconds on the members' clock;
            None if it is unknown, which drops the referring part.
        grace: seconds by which a behaviour may be later than its references into other blocks say.
    """
    trial = Trial(members, outside, grace)
    settle(trial, RULES)
    return trial.schedules()


class Trial:
    """Blocks that are solved together, and what they have lost so far.

    Attributes:
        members: the new block first.
        problem: what is left of `whole`, the problem of all members.
        solution: of `problem`; None before it is solved, or if the new block is refused.
        lost, warnings: the dropped parts, and why.
        released: statements that were given up, with their conflicts.
        late: behaviour of the new block -> seconds by which it starts too early if its references into other
            blocks hold; None if that was not asked.
    """

    def __init__(
        self, members: Sequence[Member], outside: Callable[[SyncRef], float | None], grace: float
    ) -> None:
        self.outside = outside
        self.grace = grace
        self.begin_again(members)

    def begin_again(self, members: Sequence[Member]) -> None:
        """Take other members, of which nothing is lost yet."""
        self.late: Mapping[str, float] | None = None
        self.in_time: Trial | None = None
        self._set(members, problem_of(members, self.outside))

    def _set(self, members: Sequence[Member], whole: Problem) -> None:
        self.members = members
        self.problem = self.whole = whole
        self.solution: Solution | None = None
        self.failed = False
        self.lost: list[Part] = []
        self.released: list[tuple[Relation, Conflict]] = []
        self.warnings = [unknown_warning(*reference) for reference in whole.unknown]

    @property
    def block(self) -> str:
        """The id of the new block."""
        return self.members[0].block.id

    def drop(self, dropped: Mapping[Part, Warning]) -> None:
        self.lost += dropped
        self.warnings += dropped.values()
        self.problem = self.problem.without(dropped)

    def release(self, statements: Sequence[tuple[Relation, Conflict]]) -> None:
        """Give up statements, whose behaviours stay."""
        self.released += statements
        self.problem = self.problem.released_from(relation for relation, _ in statements)

    def refuse(self, warning: Warning) -> None:
        """Refuse the new block."""
        self.warnings.append(warning)
        self.failed = True

    def delay(self, late: Mapping[str, float]) -> None:
        """Begin again with behaviours of the new block later than their references into other blocks say."""
        members = [replace(self.members[0], late=late), *self.members[1:]]
        self._set(members, problem_of(members, self.outside))

    def schedules(self) -> list[Schedule]:
        """Return the schedules of the members, or only that of the new block if it is refused."""
        warnings, new = (*self.warnings, *self._release_warnings()), self.members[0].block
        if self.late:
            lateness = (self.late.get(w.id.removeprefix(f"{new.id}:"), 0.0) for w in warnings)
            warnings = tuple(
                _with_lateness(w, late, self.grace) for w, late in zip(warnings, lateness, strict=True)
            )
        if self.solution is None:
            return [Schedule(new.id, {}, {}, warnings=warnings[-1:], failed=True, character=new.character_id)]
        problem, found = self.problem, self.solution
        number = {part.id: n for n, part in enumerate(problem.behaviours)}
        released = [str(relation.words[0]) for relation in problem.released]
        released += [f"{part.name}:{sync}" for part, sync, _ in problem.unknown]
        schedules = []
        for member in self.members:
            times: dict[str, Float64] = {}
            whole = found.time - member.start
            whole.setflags(write=False)
            for node in work.counted(member.block.behaviours):
                n = number.get(f"{member.block.id}:{node.id}")
                if n is not None and node.id not in times:
                    first, k = problem.first[n], len(problem.timings[n].points)
                    times[node.id] = whole[first : first + k]
            is_new = member is self.members[0]
            lost_constraints = tuple(part.order for part in self.lost if part.is_constraint and is_new)
            schedules.append(
                Schedule(
                    member.block.id,
                    {name: member.timings[name].points for name in times},
                    times,
                    start=member.start,
                    warnings=warnings if is_new else (),
                    cost=found.cost,
                    late={name: seconds for name, seconds in member.late.items() if name in times},
                    lost_constraints=lost_constraints,
                    released=tuple(released) if is_new else (),
                    character=member.block.character_id,
                )
            )
        return schedules

    def _release_warnings(self) -> Iterator[Warning]:
        """Yield a warning for each statement that was given up, with how wrong it is."""
        clashes = {relation.statement: clash for relation, clash in self.released}
        at = np.zeros(0) if self.solution is None else self.solution.time
        for relation in self.problem.released if len(at) else ():
            later = float(at[relation.u] - at[relation.v]) - relation.seconds
            yield release_warning(relation, clashes[relation.statement], later)


Rule: TypeAlias = Callable[[Trial], bool]


def settle(trial: Trial, rules: Sequence[Rule]) -> None:
    """Let things give way by the first rule that applies, again and again, until none does.

    A rule changes the trial and returns True, or it returns False.
    """
    while any(rule(trial) for rule in rules):
        pass


def drop_faults(trial: Trial) -> bool:
    """A part that refers to what does not exist goes; the block, if the part is required."""
    faults = () if trial.failed else trial.problem.faults
    for part, text in faults:
        if part.required:
            warning = fault_warning(part, text)
            trial.refuse(replace(warning, id=trial.block, text=f"required: {warning.text}"))
            return False
    trial.drop({part: fault_warning(part, text) for part, text in faults})
    return bool(faults)


def drop_clashes(trial: Trial) -> bool:
    """Of relations that cannot hold together, an optional constraint goes, or else a behaviour.

    It is the one of the lowest priority, of equals the later one; the block, if all are required. Speech
    stays and gives up a reference, and any behaviour gives up a start before its block.
    """
    if trial.failed:
        return False
    clashes = solve(trial.problem)
    if isinstance(clashes, Solution):
        trial.solution = clashes
        return False
    drops: dict[Part, Warning] = {}
    releases: list[tuple[Relation, Conflict]] = []
    changed: set[Part] = set()
    for clash in work.counted(clashes, 20):
        # A conflict that a loss of this round may have settled is examined again in the next.
        if not (changed.isdisjoint(clash.parts) and changed.isdisjoint(clash.named)):
            continue
        statement = choose_statement(clash)
        part = choose(clash) if statement is None else statement.part
        if part is None:
            trial.refuse(refusal(trial.block, clash))
            return False
        if statement is not None:
            releases.append((statement, clash))
        else:
            drops[part] = warning_of(clash, part)
        changed.add(part)
    trial.release(releases)
    trial.drop(drops)
    return True


def come_late(trial: Trial) -> bool:
    """Punctuality goes, if something would be lost that refers to points of other blocks.

    Behaviours that would have to start before their block, because such a point has just passed, start as
    soon as they can and keep their lengths, if that is within `grace`. If not, they are late by `grace` and
    shorter, or dropped if that is not enough.
    """
    if trial.late is None:
        if not (trial.grace > 0 and (trial.warnings or trial.released) and trial.whole.external):
            return False
        trial.in_time = copy(trial)
        trial.late = _lateness(trial)
        shifts = {behaviour: min(seconds, trial.grace) for behaviour, seconds in trial.late.items()}
    else:
        parts = (*trial.lost, *(relation.part for relation, _ in trial.released))
        lost = {id.removeprefix(f"{trial.block}:") for part in parts for id in (part.id, *part.names)}
        shifts = dict(trial.members[0].late)
        # Behaviours that are tied to each other are equally late.
        too_late = {trial.late[b] for b in lost & shifts.keys() if trial.late[b] > trial.grace}
        if not too_late:
            return False
        shifts = {b: by for b, by in shifts.items() if trial.late[b] not in too_late}
    if shifts:
        trial.delay(shifts)
        return True
    assert trial.in_time is not None
    vars(trial).update(vars(trial.in_time) | {"late": trial.late})
    return False


# What gives way in blocks that are solved together, in this order.
RULES: tuple[Rule, ...] = (drop_faults, drop_clashes, come_late)


def _lateness(trial: Trial) -> dict[str, float]:
    """Return behaviour -> seconds by which it starts too early if its references into other blocks hold.

    Behaviours that are tied to each other are late together, so that they keep their distances.
    """
    problem, block = trial.whole, trial.block
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
    outcome = copy(trial)
    outcome._set(trial.members, replace(problem, earliest=earliest))
    settle(outcome, (drop_faults, drop_clashes))
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


def _room(outcome: Trial, group: Sequence[int | None], free: Collection[int]) -> dict[int, float]:
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
