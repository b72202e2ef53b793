"""Active blocks as members of the scheduling problem of a new block."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf

import numpy as np

from bml_schema import Block, SyncRef
from realizer.playback.active_block import ActiveBlock, Dependency
from realizer.playback.block_links import all_dependencies
from realizer.playback.block_store import ANTICIPATORS
from realizer.playback.references import external_refs, references
from realizer.scheduling import Member


def affected_blocks(
    block: Block, alive: Iterable[ActiveBlock], now: float, waits: Iterable[Dependency] = ()
) -> list[ActiveBlock]:
    """Return the blocks that are solved together with one, by references to sync points that have not passed.

    A block is not solved together with one that it waits for, because both would move later for ever.

    Args:
        block: a new block, or one whose times have changed.
        alive: the other playing and waiting blocks.
        waits: the dependencies of the block.

    Returns:
        Those of `alive` that are linked to the block, directly or through other blocks, in order.
    """
    by_id = {p.block.id: p for p in alive if p.start < inf}
    refs_by_block = [
        (block.id, external_refs(block)),
        *((id, p.external_refs) for id, p in by_id.items() if p.external_refs),
    ]
    neighbours: dict[str, set[str]] = {}
    for own, refs in refs_by_block:
        for ref in refs:
            other = by_id.get(ref.block or "")
            if other is not None and not _has_passed(ref, other, now):
                neighbours.setdefault(own, set()).add(other.block.id)
                neighbours.setdefault(other.block.id, set()).add(own)
    connected: set[str] = set()
    names = [block.id]
    while names:
        for name in neighbours.get(names.pop(), ()):
            if name not in connected:
                connected.add(name)
                names.append(name)
    if not connected:
        return []
    dependencies = all_dependencies(waits)
    together: list[ActiveBlock] = []
    for name, p in by_id.items():
        if name in connected and name != block.id and id(p) not in dependencies:
            own_dependencies = all_dependencies(p.dependencies)
            if not any(
                id(other) in own_dependencies or id(p) in all_dependencies(other.dependencies)
                for other in together
            ):
                together.append(p)
    return together


def _has_passed(ref: SyncRef, playing: ActiveBlock, now: float) -> bool:
    """Return whether a point has passed or does not exist."""
    sync = ref.sync if ref.index is None else f"{ref.sync}:{ref.index}"
    try:
        time = playing.schedule.at(ref.behaviour or "", sync or "")
    except KeyError:
        return True
    return playing.start + time <= now


def member(playing: ActiveBlock, origin: float, now: float, *, is_moved: bool = False) -> Member:
    """Return a playing block on the clock of a block that starts at `origin`, with fixed past points.

    Args:
        is_moved: whether points at `now` may still move if the block has not started. A new block does not
            move them: what it refers to starts in time.
    """
    delay = playing.start - origin
    passed_times: dict[str, dict[str, float]] = {}
    for behaviour in playing.plan.timings if playing.has_begun or not is_moved else ():
        points, times = playing.schedule.points[behaviour], playing.schedule.times[behaviour]
        passed = {
            point: float(time) + delay
            for point, time in zip(points, times, strict=True)
            if playing.start + float(time) <= now
        }
        if passed:
            passed_times[behaviour] = passed
    return Member(
        playing.block,
        playing.plan.timings,
        start=delay,
        earliest=max(delay, now - origin),
        passed_times=passed_times,
        is_fixed=True,
        late=playing.schedule.late,
    )


def anticipators_of(block: Block) -> set[str]:
    """Return the anticipators that a block refers to."""
    return {ref.behaviour or "" for ref in references(block) if ref.block == ANTICIPATORS}


def lead_time(playing: ActiveBlock, id: str, sync: str, now: float) -> float:
    """Return the earliest possible time of an anticipated point, after the least times before it.

    Returns:
        Seconds on the session clock; `now` if no later sync point refers to the point.
    """
    soonest = now
    for node in playing.block.behaviours:
        timing = playing.plan.timings.get(node.id)
        for point, ref in node.syncs.items():
            if timing is None or (ref.block, ref.behaviour, ref.sync) != (ANTICIPATORS, id, sync):
                continue
            times = playing.start + playing.schedule.times[node.id]
            gaps = timing.preferred if timing.rigid else timing.least
            last = timing.points.index(point)
            if times[last] > now:
                first = int(np.searchsorted(times, now, side="right"))  # the first point that has not passed
                soonest = max(soonest, now + float(gaps[first:last].sum()) - ref.offset)
    return soonest
