"""Links between a block and the active ones: what it waits for, replaces and refers to."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import replace

import numpy as np

from bml_schema import Block, SyncRef
from realizer.playback.active_block import ActiveBlock, Dependency
from realizer.playback.resources import ResourceClaim
from realizer.scheduling.timing import Schedule

FOREVER = float("inf")


def dependencies(block: Block, character: int, alive: Collection[ActiveBlock]) -> list[Dependency]:
    """What a block waits for: BML 1.0's APPEND, all of its character that is known now; BMLA's lists.

    Of blocks that wait for each other only the last is named: it ends when all of them have.
    """
    named = [
        p
        for p in alive
        if p.block.id in block.append_after
        or (block.composition == "APPEND" and p.character == character and p.start < FOREVER)
    ]
    before = {id(wait.block) for p in named for wait in p.dependencies if not wait.subsiding}
    waits = [Dependency(p) for p in named if id(p) not in before]
    return waits + [Dependency(p, subsiding=True) for p in alive if p.block.id in block.chunk_after]


def followers(block: Block) -> list[tuple[str, bool]]:
    """The ids of the blocks that are to wait for this one, and whether for its subsiding only."""
    return [(id, False) for id in block.prepend_before] + [(id, True) for id in block.chunk_before]


def blocks_to_end(block: Block, character: int, alive: Iterable[ActiveBlock]) -> list[ActiveBlock]:
    """The blocks that this one ends when it is taken in: those it interrupts, or replaces."""
    replaces = block.composition == "REPLACE"
    return [p for p in alive if p.block.id in block.interrupt or (replaces and p.character == character)]


def existing_claims(
    character: int, alive: Iterable[ActiveBlock], without: Iterable[ActiveBlock] = ()
) -> list[ResourceClaim]:
    """What the blocks of a character need for themselves, on the session clock."""
    gone = {id(p) for p in without}
    return [
        claim
        for p in alive
        if p.plan.claims and p.character == character and p.start < FOREVER and id(p) not in gone
        for claim in p.plan.claims
    ]


def all_dependencies(waits: Iterable[Dependency]) -> set[int]:
    """The id() of every block that is waited for, by any chain."""
    todo = [wait.block for wait in waits]
    found = {id(p) for p in todo}
    while todo:
        more = [w.block for w in todo.pop().dependencies if id(w.block) not in found]
        found.update(map(id, more))
        todo += more
    return found


def external_times(
    schedule_of: Callable[[str], Schedule | None],
    start: float,
    fallback: Callable[[str], Schedule | None] = lambda id: None,
) -> Callable[[SyncRef], float | None]:
    """Sync points of other blocks: a reference -> seconds from `start`, None where that is not known.

    Args:
        schedule_of: block id -> its schedule, `start` on the session clock; None where there is none.
        fallback: where the points are looked for that the schedule does not have any more.
    """

    def instant(ref: SyncRef) -> float | None:
        for look in (schedule_of, fallback):
            schedule = look(ref.block or "")
            if schedule is None or schedule.start == FOREVER:
                return None
            if (time := _time(ref, schedule)) is not None:
                return schedule.start + time + ref.offset - start
        return None

    return instant


def _time(ref: SyncRef, schedule: Schedule) -> float | None:
    """Seconds from the start of a block."""
    if ref.behaviour == "bml":
        return {"start": 0.0, "end": schedule.duration}.get(ref.sync or "")
    sync = ref.sync if ref.index is None else f"{ref.sync}:{ref.index}"
    try:
        return schedule.at(ref.behaviour or "", sync or "")
    except KeyError:
        return None


def with_stops(
    schedule_of: Callable[[str], Schedule | None], blocks: Iterable[ActiveBlock], now: float
) -> Callable[[str], Schedule | None]:
    """`schedule_of` as it is when some blocks are stopped at `now`: nothing of them is later."""
    gone = {p.block.id for p in blocks}

    def of(id: str) -> Schedule | None:
        schedule = schedule_of(id)
        if schedule is None or id not in gone:
            return schedule
        local = max(0.0, now - schedule.start)
        return replace(schedule, times={b: np.minimum(t, local) for b, t in schedule.times.items()})

    return of
