"""BML feedback of a planned block, with the time each element is due."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
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
from realizer.playback.block_states import State
from realizer.scheduling.timing import Schedule, Warning


class Phase(IntEnum):
    """What an event is, in the order of report at one instant."""

    START = 0
    SYNC = 1
    SUBSIDES = 2
    END = 3


class Event(NamedTuple):
    """Something that is due at a time; the order of the fields is the order of report.

    At one instant a block reports before those that follow it, so that what an APPEND waited for, or a
    REPLACE ended, has ended before it starts; within a block start, sync points by behaviour, end.

    Attributes:
        time: seconds on the session clock.
        order: place of the block among those that report at one instant.
        behaviour, point: places of a sync point in the block and in its behaviour.
        block: number of the block.
        name, sync: what it is called: behaviour id and sync point.
    """

    time: float
    order: int
    phase: Phase
    behaviour: int = 0
    point: int = 0
    block: int = 0
    name: str = ""
    sync: str = ""


# A NamedTuple is made in a third of the time without its own `__new__`, which is Python.
_new_event = tuple.__new__


def parse_warning(error: BMLError) -> Warning:
    """Return the BML warning of a document that gave no block."""
    return Warning(error.block or "<no id>", "PARSING_FAILURE", str(error))


def acknowledgement(block: Block, start: float) -> PredictionFeedback:
    """Planning has begun."""
    prediction = BlockPrediction(id=block.id, global_start=start, status=State.IN_PREP)
    return PredictionFeedback(character_id=block.character_id, blocks=(prediction,))


def prediction(
    block: Block,
    schedule: Schedule,
    state: State,
    behaviours: Mapping[str, Mapping[str, float]] | None = None,
) -> PredictionFeedback:
    """When a block starts and ends, and the sync points of behaviours where they are to be told."""
    times = BlockPrediction(
        id=block.id, global_start=schedule.start, global_end=schedule.end, status=state.value
    )
    return PredictionFeedback(
        character_id=block.character_id,
        blocks=(times,),
        behaviours=tuple(
            [prediction_of(block[id], block.id, syncs) for id, syncs in (behaviours or {}).items()]
        ),
    )


def progress(block: Block, point: str, time: float, state: State, said: str | None = None) -> BlockProgress:
    """The block started or ended at `time` on the session clock; `said` where its speech was cut off."""
    return BlockProgress(
        id=f"{block.id}:{point}",
        global_time=time,
        character_id=block.character_id,
        status=state.value,
        said=said,
    )


def sync_progress(block: Block, behaviour: str, sync: str, time: float, start: float) -> SyncPointProgress:
    """A sync point passed at `time` on the session clock; the block started at `start`."""
    return SyncPointProgress(
        id=f"{block.id}:{behaviour}:{sync}",
        time=time - start,
        global_time=time,
        character_id=block.character_id,
    )


def events(block: Block, schedule: Schedule, order: int, number: int) -> list[Event]:
    """Every sync point of a block, when it is due; `order` and `number` as of the Event."""
    found: list[Event] = []
    phase = Phase.SYNC
    for place, node in enumerate(block.behaviours):
        id = node.id
        if id not in schedule.times:
            continue
        times = (schedule.start + schedule.times[id]).tolist()
        found += [
            _new_event(Event, (time, order, phase, place, index, number, id, sync))
            for index, (sync, time) in enumerate(zip(schedule.points[id], times, strict=True))
        ]
    return found


class Reports:
    """The feedback a session owes, in the order of report; each is handed out once."""

    def __init__(self) -> None:
        self._feedback: list[Feedback] = []

    def __len__(self) -> int:
        return len(self._feedback)

    def add(self, feedback: Feedback) -> None:
        """One more."""
        self._feedback.append(feedback)

    def warn(self, warning: Warning, character: str | None) -> None:
        """A BML warning."""
        told = WarningFeedback(id=warning.id, type=warning.type, text=warning.text, character_id=character)
        self._feedback.append(told)

    def take_all(self) -> list[Feedback]:
        """What is owed."""
        owed, self._feedback = self._feedback, []
        return owed
