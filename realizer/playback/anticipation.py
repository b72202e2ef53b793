"""Anticipated points: times that clients announce, and how soon they can be for what is tied to them."""

from collections.abc import Collection, Iterable, Iterator, Mapping
from itertools import repeat
from math import inf

import numpy as np

from bml_schema import Block, Synchronize, SyncRef
from realizer.core import work
from realizer.playback.active_block import ActiveBlock
from realizer.playback.block_store import ANTICIPATORS
from realizer.playback.references import references

Point = tuple[str, str, str]  # block, behaviour, sync point


def anticipators_of(block: Block) -> set[str]:
    return {ref.behaviour or "" for ref in references(block) if ref.block == ANTICIPATORS}


def lead_times(group: Collection[ActiveBlock], id: str, syncs: Iterable[str], now: float) -> dict[str, float]:
    """Return the earliest possible time of each point `anticipators:id:sync`, seconds on the session clock.

    Points of the group that are tied to one, directly or through others, come after the least times behind
    those that have passed.
    """
    tied: dict[Point, list[tuple[Point, float]]] = {}
    for playing in group:
        for point, other, seconds in _ties(playing.block):
            tied.setdefault(other, []).append((point, seconds))
    by_id = {playing.block.id: playing for playing in group}
    return {sync: _lead_time(tied, by_id, (ANTICIPATORS, id, sync), now) for sync in syncs}


def _lead_time(
    tied: Mapping[Point, list[tuple[Point, float]]],
    by_id: Mapping[str, ActiveBlock],
    anticipated: Point,
    now: float,
) -> float:
    delays = {anticipated: 0.0}  # how much later than the anticipated one points are
    soonest, todo = now, list(delays)
    for target in todo:
        for point, seconds in tied.get(target, ()):
            if point not in delays:
                delays[point] = delays[target] + seconds
                todo.append(point)
                block, behaviour, name = point
                if block in by_id:
                    soonest = max(soonest, _earliest(by_id[block], behaviour, name, now) - delays[point])
    return soonest


def _ties(block: Block) -> Iterator[tuple[Point, Point, float]]:
    """Yield (point, point, by how many seconds the first is later) of what must be at one time."""

    def place(ref: SyncRef) -> Point:
        return ref.block or block.id, ref.behaviour or "", ref.point

    for node in work.counted(block.behaviours):
        for name, ref in node.references:
            yield (block.id, node.id, name), place(ref), ref.offset
    for constraint in work.counted(block.constraints):
        for part in constraint.parts:
            if isinstance(part, Synchronize):
                for one, other in zip(repeat(part.refs[0]), part.refs[1:], strict=False):
                    yield place(one), place(other), other.offset - one.offset
                    yield place(other), place(one), one.offset - other.offset


def _earliest(playing: ActiveBlock, behaviour: str, point: str, now: float) -> float:
    """Return the earliest possible time of a point; negative infinity if it has passed."""
    timing = playing.plan.timings.get(behaviour)
    if timing is None or point not in timing.points:
        return -inf
    times, last = playing.start + playing.schedule.times[behaviour], timing.points.index(point)
    if times[last] <= now:
        return -inf
    gaps = timing.preferred if timing.rigid else timing.least
    first = int(np.searchsorted(times, now, side="right"))  # the first point that has not passed
    soonest = max(now, playing.start) + float(gaps[first:last].sum())
    return max(soonest, float(times[first - 1] + gaps[first - 1 : last].sum())) if first else soonest
