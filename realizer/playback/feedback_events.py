"""Events of blocks in the order of report, and the BML feedback about them."""

from collections.abc import Collection, Iterator, Mapping
from enum import IntEnum, auto
from math import inf, isfinite
from typing import NamedTuple

from bml_schema import (
    Block,
    BlockPrediction,
    BlockProgress,
    BMLError,
    Feedback,
    PredictionFeedback,
    SyncPointProgress,
    WarningFeedback,
    prediction_of,
)
from realizer.core import work
from realizer.playback.active_block import ActiveBlock
from realizer.playback.block_states import State
from realizer.scheduling.timing import UNKNOWN, Schedule, Warning


class Phase(IntEnum):
    """The kind of an event, in the order of report at one instant."""

    START = auto()
    SYNC = auto()
    SUBSIDES = auto()
    END = auto()


class Event(NamedTuple):
    """An event of a block; the order of the fields is the order of report.

    At one instant a block reports before its followers, so that the dependencies of an APPEND, and the blocks
    that a REPLACE ended, have ended before it starts; within a block start, sync points by behaviour, end.
    """

    time: float  # seconds on the session clock
    # order of the block among those that report at one instant, as of `ActiveBlock`
    order: tuple[int, int, int]
    phase: Phase
    # behaviour, point: indices of a sync point in the block and in its behaviour
    behaviour: int = 0
    point: int = 0
    block: int = 0  # number of the block
    # name, sync: behaviour id and sync point
    name: str = ""
    sync: str = ""


def parse_warning(error: BMLError) -> Warning:
    """Return the BML warning for a document without a valid block."""
    return Warning(error.block or "<no id>", "PARSING_FAILURE", str(error))


def acknowledgement(block: Block, start: float) -> PredictionFeedback:
    """Return the prediction that acknowledges a block: planning has begun."""
    prediction = BlockPrediction(id=block.id, global_start=start, status=State.IN_PREP)
    return PredictionFeedback(character_id=block.character_id, blocks=(prediction,))


def prediction(
    block: Block,
    schedule: Schedule,
    state: State,
    behaviours: Mapping[str, Mapping[str, float]] | None = None,
) -> PredictionFeedback:
    """Return the prediction of a block's start and end, and of some behaviours' sync points.

    Times that are not known yet are left out.
    """
    end = schedule.known.end
    times = BlockPrediction(
        id=block.id,
        global_start=schedule.start,
        global_end=end if isfinite(end) else None,
        status=state.value,
    )
    nodes = []
    for id, syncs in (behaviours or {}).items():
        work.count(20)
        if known := {sync: time for sync, time in syncs.items() if time < UNKNOWN}:
            nodes.append(prediction_of(block[id], block.id, known, schedule.late.get(id, 0.0)))
    return PredictionFeedback(character_id=block.character_id, blocks=(times,), behaviours=tuple(nodes))


def progress(
    block: Block, point: str, time: float, state: State, said: str | None = None, *, shown: bool = True
) -> BlockProgress:
    """Return the progress of a block that started or ended; `said` if its speech was cut off."""
    return BlockProgress(
        id=f"{block.id}:{point}",
        global_time=time,
        character_id=block.character_id,
        status=state.value,
        said=said,
        shown=shown,
    )


def sync_progress(block: Block, behaviour: str, sync: str, time: float, start: float) -> SyncPointProgress:
    """Return the progress of a sync point that passed at `time` in a block that started at `start`."""
    return SyncPointProgress(
        id=f"{block.id}:{behaviour}:{sync}",
        time=time - start,
        global_time=time,
        character_id=block.character_id,
    )


def events(block: Block, schedule: Schedule, order: tuple[int, int, int], number: int) -> list[Event]:
    """Return an event for every sync point of a block; for `order` and `number` see Event."""
    due: list[Event] = []
    phase = Phase.SYNC
    for place, node in enumerate(work.counted(block.behaviours, 10)):
        id = node.id
        if id not in schedule.times:
            continue
        times = (schedule.start + schedule.times[id]).tolist()
        due += [
            Event(time, order, phase, place, index, number, id, sync)
            for index, (sync, time) in enumerate(zip(schedule.points[id], times, strict=True))
        ]
    return due


class Reports:
    """The pending feedback of a session, in the order of report."""

    def __init__(self) -> None:
        self._feedback: list[Feedback] = []

    def __len__(self) -> int:
        return len(self._feedback)

    def add(self, feedback: Feedback) -> None:
        self._feedback.append(feedback)

    def warn(self, warning: Warning, character: str | None) -> None:
        self.add(
            WarningFeedback(
                id=warning.id,
                type=warning.type,
                text=warning.text,
                character_id=character,
                in_use_for=warning.in_use_for,
            )
        )

    def take_all(self) -> list[Feedback]:
        pending, self._feedback = self._feedback, []
        return pending


class EventQueue:
    """A queue of future events."""

    def __init__(self) -> None:
        self._first: Event | None = None
        # Number of a block -> its events, in reverse order.
        self._events: dict[int, list[Event]] = {}

    @property
    def next(self) -> float | None:
        return None if self._first is None else self._first.time

    def due(self, now: float, starts_before: float = inf) -> Iterator[Event]:
        """Remove and yield events that are due, in order, with those that are added meanwhile.

        Blocks that start at `starts_before` or later do not start yet.
        """
        while (first := self._first) is not None and first.time <= now:
            if first.phase is Phase.START and first.time >= starts_before:
                return
            events = self._events[first.block]
            events.pop()
            if not events:
                del self._events[first.block]
            self._find_next()
            yield first

    def add(self, playing: ActiveBlock, only: Collection[tuple[str, str]] | None = None) -> None:
        """Add the future events of a block, or `only` some (behaviour, sync), instead of those it has."""
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
        self._find_next()

    def pending(self, playing: ActiveBlock) -> set[tuple[str, str]]:
        """Return the future sync points of a block, as (behaviour, sync)."""
        return {(e.name, e.sync) for e in self._events.get(playing.number, ()) if e.name}

    def clear(self) -> None:
        """Remove all events."""
        self._first = None
        self._events.clear()

    def drop(self, playing: ActiveBlock) -> None:
        self._events.pop(playing.number, None)
        self._find_next()

    def _find_next(self) -> None:
        self._first = min((events[-1] for events in self._events.values()), default=None)
