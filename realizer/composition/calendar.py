"""What is due when: the events of all blocks, in the order of report."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterator

from realizer.composition.playing import Playing
from realizer.composition.reporting import Event, Phase, State, events

__all__ = ["Calendar"]


class Calendar:
    """Events that have not happened."""

    def __init__(self) -> None:
        self._events: list[Event] = []

    @property
    def next(self) -> float | None:
        """When the first is due; None where there is none."""
        return self._events[0].time if self._events else None

    def due(self, now: float) -> Iterator[Event]:
        """Take what is due out, in order; what is put in meanwhile comes in its turn."""
        while self._events and self._events[0].time <= now:
            yield heapq.heappop(self._events)

    def put(self, playing: Playing, only: Collection[tuple[str, str]] | None = None) -> None:
        """Put in what is still to happen in a block; of its sync points all, or `only` (behaviour, sync)."""
        number = playing.number
        due = events(playing.block, playing.schedule, number)
        due = [e for e in due if only is None or (e.name, e.sync) in only]
        if playing.waiting:
            due.append(Event(playing.start, number, Phase.START))
        if playing.state is not State.SUBSIDING and playing.subsides < playing.end:
            due.append(Event(playing.subsides, number, Phase.SUBSIDES))
        due.append(Event(playing.end, number, Phase.END))
        for event in due:
            heapq.heappush(self._events, event)

    def take(self, playing: Playing) -> list[Event]:
        """Take out all that is still to happen in a block."""
        gone = [e for e in self._events if e.block == playing.number]
        self._events = [e for e in self._events if e.block != playing.number]
        heapq.heapify(self._events)
        return gone
