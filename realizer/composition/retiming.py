"""Blocks that play in, as the scheduler sees them beside a new one: what refers to what, what has passed."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

import numpy as np

from bml_schema import Block, SyncRef
from realizer.composition.cast import ANTICIPATORS
from realizer.composition.playing import Playing
from realizer.composition.references import references
from realizer.scheduling import Member

__all__ = ["anticipated", "lead", "member", "touched"]

FOREVER = float("inf")


def touched(blocks: Iterable[Block], alive: Collection[Playing], now: float) -> list[Playing]:
    """The blocks that are solved together with these, by references to sync points that have not passed.

    Args:
        blocks: new ones, or blocks whose times have changed.
        alive: the blocks that play or wait.

    Returns:
        Those of `alive` that are connected to `blocks` by any chain, themselves included, in order.
    """
    by_id = {p.block.id: p for p in alive if p.start < FOREVER}
    beside: dict[str, set[str]] = {}
    todo = list(blocks)
    everyone = {block.id: block for block in todo} | {id: p.block for id, p in by_id.items()}
    for block in everyone.values():
        for other in _open(block, by_id, now):
            beside.setdefault(block.id, set()).add(other)
            beside.setdefault(other, set()).add(block.id)
    found: set[str] = set()
    names = [block.id for block in todo]
    while names:
        for name in beside.get(names.pop(), ()):
            if name not in found:
                found.add(name)
                names.append(name)
    return [p for id, p in by_id.items() if id in found]


def _open(block: Block, by_id: dict[str, Playing], now: float) -> Iterator[str]:
    """The blocks of which a block names a point that is still to come."""
    for ref in references(block):
        other = by_id.get(ref.block or "")
        if other is not None and other.block.id != block.id and not _passed(ref, other, now):
            yield other.block.id


def _passed(ref: SyncRef, playing: Playing, now: float) -> bool:
    """Whether a point is past, or nobody's."""
    sync = ref.sync if ref.index is None else f"{ref.sync}:{ref.index}"
    try:
        time = playing.schedule.at(ref.behaviour or "", sync or "")
    except KeyError:
        return True
    return playing.start + time <= now


def member(playing: Playing, origin: float, now: float) -> Member:
    """A block that plays, on the clock of a block that starts at `origin`; what has passed is held."""
    late = playing.start - origin
    passed: dict[str, dict[str, float]] = {}
    for behaviour in playing.plan.timings:
        points, times = playing.schedule.points[behaviour], playing.schedule.times[behaviour]
        when = {
            point: float(time) + late
            for point, time in zip(points, times, strict=True)
            if playing.start + float(time) <= now
        }
        if when:
            passed[behaviour] = when
    return Member(
        playing.block,
        playing.plan.timings,
        start=late,
        earliest=max(late, now - origin),
        passed=passed,
        firm=True,
    )


def anticipated(block: Block) -> set[str]:
    """The anticipators that a block is tied to."""
    return {ref.behaviour or "" for ref in references(block) if ref.block == ANTICIPATORS}


def lead(playing: Playing, id: str, sync: str, now: float) -> float:
    """The soonest that an anticipated point can be: what leads up to it in a behaviour takes its least time.

    Returns:
        Seconds on the session clock; `now` where nothing of the block is tied to the point, or it has passed.
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
