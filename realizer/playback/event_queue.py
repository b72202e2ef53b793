"""The queue of the events of all blocks, in the order of report."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterator
from math import inf

from realizer.playback.active_block import ActiveBlock
from realizer.playback.block_states import State
from realizer.playback.feedback_events import Event, Phase, events

# The heap may have as many obsolete entries as valid ones, and this many more.
SPARE = 16


class EventQueue:
    """A queue of future events."""

    def __init__(self) -> None:
        self._first: Event | None = None
        # Number of a block -> its events, in reverse order.
        self._events: dict[int, list[Event]] = {}
        # A heap of the first event of each block, and of obsolete events.
        self._firsts: list[Event] = []

    @property
    def next(self) -> float | None:
        """The time of the first event, or None."""
        return None if self._first is None else self._first.time

    def due(self, now: float, starts_before: float = inf) -> Iterator[Event]:
        """Remove and yield events that are due, in order, with those that are added meanwhile.

        Args:
            starts_before: blocks that start then or later do not start yet.
        """
        while (first := self._first) is not None and first.time <= now:
            if first.phase is Phase.START and first.time >= starts_before:
                return
            events = self._events[first.block]
            events.pop()
            if events:
                heapq.heapreplace(self._firsts, events[-1])
            else:
                heapq.heappop(self._firsts)
                del self._events[first.block]
            self._find_next()
            yield first

    def add(self, playing: ActiveBlock, only: Collection[tuple[str, str]] | None = None) -> None:
        """Add the future events of a block instead of those it has.

        Args:
            only: (behaviour, sync) of its future sync points; None for all.
        """
        number, order = playing.number, playing.order
        due = events(playing.block, playing.schedule, order, number)
        if only is not None:
            due = [e for e in due if (e.name, e.sync) in only]
        subsides, end = playing.subsides_at, playing.end
        if playing.is_waiting:
            due.append(Event(playing.start, order, Phase.START, block=number))
        if playing.state is not State.SUBSIDING and subsides < end:
            due.append(Event(subsides, order, Phase.SUBSIDES, block=number))
        due.append(Event(end, order, Phase.END, block=number))
        due.sort(reverse=True)
        self._events[number] = due
        heapq.heappush(self._firsts, due[-1])
        if len(self._firsts) > 2 * len(self._events) + SPARE:
            self._firsts = [events[-1] for events in self._events.values()]
            heapq.heapify(self._firsts)
        self._find_next()

    def pending(self, playing: ActiveBlock) -> set[tuple[str, str]]:
        """Return the future sync points of a block, as (behaviour, sync)."""
        return {(e.name, e.sync) for e in self._events.get(playing.number, ()) if e.name}

    def drop(self, playing: ActiveBlock) -> None:
        """Remove all events of a block."""
        if self._events.pop(playing.number, None) is not None:
            self._find_next()

    def _find_next(self) -> None:
        """Find the first event; remove obsolete entries from the top of the heap."""
        self._first = None
        while self._firsts:
            first = self._firsts[0]
            events = self._events.get(first.block)
            if events and events[-1] is first:
                self._first = first
                return
            heapq.heappop(self._firsts)
