"""A planned block in; the BML feedback that tells of it out, each with the time it is due."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from bml_schema import (
    Block,
    BlockPrediction,
    BlockProgress,
    Feedback,
    PredictionFeedback,
    SyncPointProgress,
    predicted,
)
from realizer.scheduling.timing import Schedule

__all__: list[str] = []

START, SYNC, END = range(3)


@dataclass(frozen=True, order=True, slots=True)
class Event:
    """One feedback and when it is due; the order of the fields is the order of report.

    At one instant earlier blocks report before later ones, so that what an APPEND waited for, or a REPLACE
    ended, has ended before it starts; within a block start, sync points by behaviour, end.
    """

    time: float
    block: int
    phase: int
    behaviour: int
    point: int
    feedback: Feedback = field(compare=False)


def acknowledgement(block: Block, start: float) -> PredictionFeedback:
    """Planning has begun."""
    prediction = BlockPrediction(id=block.id, global_start=start)
    return PredictionFeedback(character_id=block.character_id, blocks=(prediction,))


def prediction(block: Block, schedule: Schedule) -> PredictionFeedback:
    """Planning is done: when the block starts and ends, and every sync point."""
    nodes = {node.id: node for node in block.behaviours}
    return PredictionFeedback(
        character_id=block.character_id,
        blocks=(BlockPrediction(id=block.id, global_start=schedule.start, global_end=schedule.end),),
        behaviours=tuple(predicted(nodes[id], block.id, times) for id, times in schedule.behaviours.items()),
    )


def progress(block: Block, point: str, time: float, status: str | None = None) -> BlockProgress:
    """The block started or ended at `time` on the session clock."""
    return BlockProgress(
        id=f"{block.id}:{point}", global_time=time, character_id=block.character_id, status=status
    )


def events(block: Block, schedule: Schedule, number: int) -> Sequence[Event]:
    """Every feedback of a block that goes as planned (BML 1.0): start, each sync point, end.

    Args:
        number: order of acceptance, for blocks that report at one instant.
    """
    start = schedule.start
    out = [
        Event(start, number, START, 0, 0, progress(block, "start", start)),
        Event(schedule.end, number, END, 0, 0, progress(block, "end", schedule.end)),
    ]
    order = {node.id: index for index, node in enumerate(block.behaviours)}
    for behaviour, times in schedule.behaviours.items():
        for index, (point, time) in enumerate(times.items()):
            told = SyncPointProgress(
                id=f"{block.id}:{behaviour}:{point}",
                time=time,
                global_time=start + time,
                character_id=block.character_id,
            )
            out.append(Event(start + time, number, SYNC, order[behaviour], index, told))
    return out
