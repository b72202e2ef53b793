"""Links between a block and the active ones: dependencies, references, and what is solved together."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice, repeat
from math import inf

import numpy as np

from bml_schema import Block, Synchronize, SyncRef
from realizer.core import work
from realizer.core.similar import did_you_mean, similar
from realizer.playback.active_block import ActiveBlock, BlockMoment, Dependency
from realizer.playback.references import ANTICIPATORS, anticipators_of, external_refs, speaks_after
from realizer.playback.resources import ResourceClaim
from realizer.scheduling import Member
from realizer.scheduling.timing import UNKNOWN, Schedule

Point = tuple[str, str, str]  # block, behaviour, sync point


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
    before = {id(w.block) for p, w in links if w.moment == "end" and w.block.number < p.number}
    waits = [Dependency(p) for p in named if id(p) not in before]
    chunks = (p for p in alive if p.number < number and p.block.id in block.chunk_after)
    return [
        *waits,
        *(Dependency(p, "subsides_at") for p in chunks),
        *(Dependency(p, "speaks_until") for p in spoken_before(block, alive)),
    ]


def spoken_before(block: Block, alive: Iterable[ActiveBlock]) -> list[ActiveBlock]:
    """Return the blocks whose speech a block continues."""
    return [p for p in alive if p.block.id in speaks_after(block)]


def followers(block: Block) -> list[tuple[str, BlockMoment]]:
    """Return the ids of the blocks that have to wait for this one, with its moment that they wait for."""
    return [
        *((id, "end") for id in block.prepend_before),
        *((id, "subsides_at") for id in block.chunk_before),
    ]


def existing_claims(
    character: int, number: float, alive: Iterable[ActiveBlock], without: Iterable[ActiveBlock] = ()
) -> list[ResourceClaim]:
    """Return the claims that a block of a character gives way to, on the session clock.

    They are those of blocks that play, and of those before `number` that wait and whose start is known.
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
    todo = [wait.block for wait in waits]
    visited = {id(p) for p in todo}
    while todo:
        more = [w.block for w in todo.pop().dependencies if id(w.block) not in visited]
        visited.update(map(id, more))
        todo += more
    return visited


@dataclass
class ExternalTimes:
    """Maps references into other blocks to seconds from `start`.

    Attributes:
        schedule_of: block id -> its schedule, with `start` on the session clock.
        start: seconds on the session clock.
        fallback: as `schedule_of`, for points that the schedule no longer has.
        suggestions: how many more errors may name similar behaviours, because to find them is slow.
    """

    schedule_of: Callable[[str], Schedule | None]
    start: float
    fallback: Callable[[str], Schedule | None] = lambda id: None
    suggestions: int = 10

    def __call__(self, ref: SyncRef) -> float | None:
        """Return the seconds of a reference, with its offset, or None if its block has no known times.

        Raises:
            LookupError: the block has no such behaviour or sync point; the message has the existing ones.
        """
        name, planned = ref.behaviour or "", None
        for look in (self.schedule_of, self.fallback):
            schedule = look(ref.block or "")
            if schedule is None or schedule.start == inf:
                break
            points: Sequence[str] = schedule.points[name] if name in schedule.times else ()
            if name == "bml":
                points = ("start", "end")
            if ref.point in points:
                if name != "bml":
                    time = schedule.at(name, ref.point)
                else:
                    time = 0.0 if ref.point == "start" else schedule.duration
                return schedule.start + time + ref.offset - self.start
            planned = planned or (schedule, points)
        if planned is not None:
            raise LookupError(self._why_unknown(ref, *planned))
        return None

    def _why_unknown(self, ref: SyncRef, schedule: Schedule, points: Sequence[str]) -> str:
        if points:
            return f"{ref}: {ref.behaviour} has no {ref.point}, only {', '.join(points)}"
        self.suggestions -= 1
        known = islice(schedule.times, 100) if self.suggestions >= 0 else ()
        near = did_you_mean(similar(ref.behaviour or "", known))
        return f"{ref}: block {ref.block} has no behaviour {ref.behaviour}{near}"


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


def affected_blocks(
    block: Block, alive: Iterable[ActiveBlock], now: float, waits: Iterable[Dependency] = ()
) -> list[ActiveBlock]:
    """Return the blocks that are solved together with one, by references to sync points that have not passed.

    They are those of `alive` that are linked to the block, directly or through other blocks, in order. A
    block is not solved together with one that it waits for, because both would move later for ever.
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
    try:
        time = playing.schedule.at(ref.behaviour or "", ref.point)
    except KeyError:
        return True
    return playing.start + time <= now


def members(
    blocks: Collection[ActiveBlock],
    origin: float,
    now: float,
    *,
    is_moved: bool = False,
    new: Block | None = None,
) -> list[Member]:
    """Return playing blocks on the clock of a block that starts at `origin`, with fixed past points.

    If one of them, or the `new` block, refers to an anticipator, the others do not move towards it: an open
    speech would delay its own sentences, and so its end, for ever.

    With `is_moved`, points at `now` may still move if the block has not started. A new block does not move
    them: what it refers to starts in time.
    """
    anticipating = [bool(anticipators_of(p.block)) for p in blocks]
    is_held = any(anticipating) or (new is not None and bool(anticipators_of(new)))
    return [
        _member(p, origin, now, is_moved, is_held and not own)
        for p, own in zip(blocks, anticipating, strict=True)
    ]


def _member(playing: ActiveBlock, origin: float, now: float, is_moved: bool, is_held: bool) -> Member:
    """Return one member; if it `is_held`, its behaviours that refer to nothing keep their starts."""
    delay = playing.start - origin
    before = now if playing.has_begun or not is_moved else -inf
    passed_times: dict[str, dict[str, float]] = {}
    for behaviour in playing.plan.timings if is_held or before > -inf else ():
        points, times = playing.schedule.points[behaviour], playing.schedule.times[behaviour]
        passed = {
            point: float(time) + delay
            for point, time in zip(points, times, strict=True)
            if playing.start + float(time) <= before
        }
        has_known_start = playing.start + float(times[0]) < now + UNKNOWN
        if is_held and has_known_start and not playing.block[behaviour].references:
            passed[points[0]] = float(times[0]) + delay
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

    for own in work.counted(block.behaviours):
        for name, ref in own.references:
            yield (block.id, own.id, name), place(ref), ref.offset
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
