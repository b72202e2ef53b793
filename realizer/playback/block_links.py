"""Links between a block and the active ones: dependencies, replaced blocks and references."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import replace
from math import inf

import numpy as np

from bml_schema import Block, SyncRef
from realizer.playback.active_block import ActiveBlock, Dependency
from realizer.playback.resources import ResourceClaim
from realizer.scheduling.timing import Schedule


def dependencies(
    block: Block, character: int, number: int, alive: Collection[ActiveBlock]
) -> list[Dependency]:
    """Return the blocks that a block waits for: for APPEND all earlier of its character, and BMLA's lists.

    Of blocks that wait for each other only the last is returned, because it ends when all of them have. Those
    that were put before an earlier block are returned too: if that one is revoked, nobody waits for them.
    """
    named = [
        p
        for p in alive
        if p.number < number
        and (
            p.block.id in block.append_after
            or (block.composition == "APPEND" and p.character == character and p.start < inf)
        )
    ]
    links = ((p, wait) for p in named for wait in p.dependencies)
    before = {id(w.block) for p, w in links if not w.subsiding and w.block.number < p.number}
    waits = [Dependency(p) for p in named if id(p) not in before]
    chunks = (p for p in alive if p.number < number and p.block.id in block.chunk_after)
    return waits + [Dependency(p, subsiding=True) for p in chunks]


def followers(block: Block) -> list[tuple[str, bool]]:
    """Return (id, subsiding) of the blocks that have to wait for this one, or only for its subsiding."""
    return [(id, False) for id in block.prepend_before] + [(id, True) for id in block.chunk_before]


def existing_claims(
    character: int, number: float, alive: Iterable[ActiveBlock], without: Iterable[ActiveBlock] = ()
) -> list[ResourceClaim]:
    """Return the claims that a block of a character gives way to, on the session clock.

    They are those of blocks that play, and of earlier ones that wait and whose start is known.

    Args:
        number: of the block, by order of arrival.
    """
    gone = {id(p) for p in without}
    return [
        claim
        for p in alive
        if p.plan.claims
        and p.character == character
        and (p.has_begun or (p.number < number and p.start < inf))
        and id(p) not in gone
        for claim in p.plan.claims
    ]


def all_dependencies(waits: Iterable[Dependency]) -> set[int]:
    """Return the id() of every direct and indirect dependency."""
    todo = [wait.block for wait in waits]
    visited = {id(p) for p in todo}
    while todo:
        more = [w.block for w in todo.pop().dependencies if id(w.block) not in visited]
        visited.update(map(id, more))
        todo += more
    return visited


def external_times(
    schedule_of: Callable[[str], Schedule | None],
    start: float,
    fallback: Callable[[str], Schedule | None] = lambda id: None,
) -> Callable[[SyncRef], float | None]:
    """Return a function that maps references into other blocks to seconds from `start`, or None if unknown.

    Args:
        schedule_of: block id -> its schedule, with `start` on the session clock, or None.
        fallback: the same for points that the schedule no longer has.
    """

    def instant(ref: SyncRef) -> float | None:
        for look in (schedule_of, fallback):
            schedule = look(ref.block or "")
            if schedule is None or schedule.start == inf:
                return None
            if (time := _time(ref, schedule)) is not None:
                return schedule.start + time + ref.offset - start
        return None

    return instant


def _time(ref: SyncRef, schedule: Schedule) -> float | None:
    """Return the seconds from block start of a reference, or None."""
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
    """Return `schedule_of` as if some blocks were stopped at `now`: nothing of them is later.

    Of those that have not started nothing is known.
    """
    gone = {p.block.id: p for p in blocks}

    def of(id: str) -> Schedule | None:
        schedule = schedule_of(id)
        if schedule is None or id not in gone:
            return schedule
        if not gone[id].has_begun:
            return None
        local = max(0.0, now - schedule.start)
        return replace(schedule, times={b: np.minimum(t, local) for b, t in schedule.times.items()})

    return of
