"""The store of a session's blocks, and of the times of their sync points."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from math import inf

import numpy as np

from realizer.core import work
from realizer.playback.active_block import ActiveBlock
from realizer.playback.references import ANTICIPATORS
from realizer.scheduling.timing import Schedule

# Maximum number of schedules of ended blocks, which references may name.
PAST = 50  # 2 kB each
PAST_POINTS = 50_000  # in all of them; the last schedule is kept in any case


class BlockStore:
    """The blocks of a session while they are active or visible, and the schedules of past ones.

    Attributes:
        last_number: the number of the block that arrived last.
        first_invisible: when the first ended block becomes invisible; infinite if there is none.
    """

    def __init__(self) -> None:
        self.last_number = 0
        self.first_invisible = inf
        self._blocks: dict[int, ActiveBlock] = {}  # by number, in order of acceptance
        self._active: dict[str, ActiveBlock] = {}  # by id; those that are not done
        self._ended: list[ActiveBlock] = []  # those of `_blocks` that are done
        self._past: dict[str, Schedule] = {}
        self._points = 0  # of `_past`
        self._anticipated = Schedule(ANTICIPATORS, {}, {})

    def new_number(self) -> int:
        """Return the number of a block that has just arrived."""
        self.last_number += 1
        return self.last_number

    def add(self, playing: ActiveBlock) -> None:
        self._blocks[playing.number] = self._active[playing.block.id] = playing

    def end(self, playing: ActiveBlock) -> None:
        """End a block, so that its id can be used again."""
        del self._active[playing.block.id]
        self._ended.append(playing)
        self.first_invisible = min(self.first_invisible, playing.invisible_after)

    def forget(self, before: float) -> list[ActiveBlock]:
        """Drop and return the ended blocks that are invisible from a time on."""
        if self.first_invisible >= before:
            return []
        gone = [p for p in self._ended if p.invisible_after < before]
        self._ended = [p for p in self._ended if p.invisible_after >= before]
        self.first_invisible = min((p.invisible_after for p in self._ended), default=inf)
        for playing in gone:
            self._remember(_with_lost_points(playing))
            del self._blocks[playing.number]
        return gone

    def clear(self) -> None:
        """Forget all blocks and schedules."""
        self._blocks.clear()
        self._active.clear()
        self._ended.clear()
        self._past.clear()

    def note_revoked(self, id: str) -> None:
        if not self.has_seen(id):
            self._remember(_revoked(id))

    def _remember(self, past: Schedule) -> None:
        if (old := self._past.pop(past.block, None)) is not None:
            self._points -= _points(old)
        self._past[past.block] = past
        self._points += _points(past)
        while len(self._past) > PAST or (self._points > PAST_POINTS and len(self._past) > 1):
            self._points -= _points(self._past.pop(next(iter(self._past))))

    def __getitem__(self, number: int) -> ActiveBlock:
        return self._blocks[number]

    def all(self) -> list[ActiveBlock]:
        """Return every block that can still be seen or heard, in order of acceptance."""
        return list(self._blocks.values())

    def of_character(self, character: int) -> list[ActiveBlock]:
        return [p for p in self._blocks.values() if p.character == character]

    def active(self) -> list[ActiveBlock]:
        """Return the playing and waiting blocks, in order of acceptance."""
        return list(self._active.values())

    def find(self, id: str) -> ActiveBlock | None:
        """Return the playing or waiting block with an id, or None."""
        return self._active.get(id)

    def has_seen(self, id: str) -> bool:
        return self.schedule_of(id) is not None

    def schedule_of(self, id: str) -> Schedule | None:
        """Return the schedule of the newest block with an id, or of the anticipators."""
        if id == ANTICIPATORS:
            return self._anticipated
        newest = next((p for p in reversed(self._blocks.values()) if p.block.id == id), None)
        if newest is None:
            return self._past.get(id)
        return _revoked(id) if newest.is_revoked else newest.schedule

    def first_schedule_of(self, id: str) -> Schedule | None:
        """Return the first schedule of the newest block with an id, moved to its present start."""
        newest = next((p for p in reversed(self._blocks.values()) if p.block.id == id), None)
        return None if newest is None or newest.is_revoked else _first_schedule(newest)

    def snapshot(self) -> tuple[list[Schedule], Schedule]:
        """Return the schedules of ended blocks, the oldest first, and of the anticipators."""
        ended = {playing.block.id: _with_lost_points(playing) for playing in self._ended}
        past = {id: schedule for id, schedule in self._past.items() if id not in ended} | ended
        return list(past.values())[-PAST:], self._anticipated

    def restore(self, past: Iterable[Schedule], anticipated: Schedule) -> None:
        self._past = {schedule.block: schedule for schedule in past}
        self._points = sum(map(_points, self._past.values()))
        self._anticipated = anticipated

    def anticipate(self, id: str, syncs: Mapping[str, float]) -> None:
        """Set the expected times of points of an anticipator, seconds on the session clock."""
        known = {**self._anticipated.behaviours.get(id, {}), **syncs}
        points = {**self._anticipated.points, id: tuple(known)}
        times = {**self._anticipated.times, id: np.array(list(known.values()))}
        self._anticipated = replace(self._anticipated, points=points, times=times)

    @property
    def anticipators(self) -> Collection[str]:
        return self._anticipated.points.keys()

    def drop_anticipators(self, ids: Collection[str]) -> None:
        points = {id: names for id, names in self._anticipated.points.items() if id not in ids}
        times = {id: self._anticipated.times[id] for id in points}
        self._anticipated = replace(self._anticipated, points=points, times=times)

    def latest(self, schedule: Schedule, *, whole: bool = False) -> Schedule:
        """Return the present schedule of a block, given its first one; `whole` as if nothing was cut off."""
        playing = next((p for p in self._blocks.values() if p.first_schedule is schedule), None)
        if playing is None:
            return schedule
        return playing.whole if whole else playing.latest


def _revoked(id: str) -> Schedule:
    """Return the schedule of a block that ended before it started: it has no points, and never starts."""
    return Schedule(id, {}, {}, start=inf)


def _points(schedule: Schedule) -> int:
    return sum(map(len, schedule.times.values()))


def _first_schedule(playing: ActiveBlock) -> Schedule:
    first = replace(playing.first_schedule, start=playing.start)
    if playing.stopped_at is None:
        return first
    last = max(0.0, playing.stopped_at - playing.start)  # points after its stop are never reached
    return replace(first, times={b: np.minimum(t, last) for b, t in first.times.items()})


def _with_lost_points(playing: ActiveBlock) -> Schedule:
    """Return the schedule of a block, with the points that it has lost, which references may still name."""
    if playing.is_revoked:
        return _revoked(playing.block.id)
    schedule, first = playing.schedule, _first_schedule(playing)
    points, times = dict(schedule.points), dict(schedule.times)
    for behaviour, names in work.counted(first.points.items() if playing.start < inf else ()):
        known = points.get(behaviour, ())
        lost = [n for n, name in enumerate(names) if name not in known]
        if lost:
            at = np.minimum(first.times[behaviour][lost], playing.end - playing.start)
            # The last point of a behaviour stays its end.
            points[behaviour] = (*(names[n] for n in lost), *known)
            times[behaviour] = np.append(at, times.get(behaviour, []))
    return replace(schedule, points=points, times=times)
