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
        self._events: list[tuple[Event, int]] = []
        # Number of a block -> which of its entries count: dropping them is a new edition, not a search.
        self._edition: dict[int, int] = {}

    @property
    def next(self) -> float | None:
        """When the first is due; None where there is none."""
        self._skip()
        return self._events[0][0].time if self._events else None

    def due(self, now: float) -> Iterator[Event]:
        """Take what is due out, in order; what is put in meanwhile comes in its turn."""
        while (first := self.next) is not None and first <= now:
            yield heapq.heappop(self._events)[0]

    def put(self, playing: Playing, only: Collection[tuple[str, str]] | None = None) -> None:
        """Put in what is still to happen in a block; of its sync points all, or `only` (behaviour, sync)."""
        number, order = playing.number, playing.order
        due = events(playing.block, playing.schedule, order, number)
        due = [e for e in due if only is None or (e.name, e.sync) in only]
        if playing.waiting:
            due.append(Event(playing.start, order, Phase.START, block=number))
        if playing.state is not State.SUBSIDING and playing.subsides < playing.end:
            due.append(Event(playing.subsides, order, Phase.SUBSIDES, block=number))
        due.append(Event(playing.end, order, Phase.END, block=number))
        edition = self._edition.setdefault(number, 0)
        for event in due:
            heapq.heappush(self._events, (event, edition))

    def pending(self, playing: Playing) -> set[tuple[str, str]]:
        """The sync points of a block that have not passed, as (behaviour, sync)."""
        return {
            (event.name, event.sync)
            for event, edition in self._events
            if event.block == playing.number and edition == self._edition[event.block] and event.name
        }

    def drop(self, playing: Playing) -> None:
        """Take out all that is still to happen in a block."""
        if playing.number in self._edition:
            self._edition[playing.number] += 1

    def forget(self, playing: Playing) -> None:
        """Nothing will happen in a block any more."""
        self.drop(playing)
        self._events = [entry for entry in self._events if entry[0].block != playing.number]
        heapq.heapify(self._events)
        self._edition.pop(playing.number, None)

    def _skip(self) -> None:
        """Take what was dropped off the top."""
        while self._events and self._events[0][1] != self._edition[self._events[0][0].block]:
            heapq.heappop(self._events)
