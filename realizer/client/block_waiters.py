"""Waiters for the blocks that a client has sent: which feedback starts, refuses and ends each of them."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field, fields
from itertools import repeat
from typing import Any

from bml_schema.documents import read
from bml_schema.errors import NOT_BML_1_0, BMLError
from bml_schema.feedback import (
    BlockProgress,
    Feedback,
    PredictionFeedback,
    SyncPointProgress,
    WarningFeedback,
)
from bml_schema.nodes import Block
from realizer.client.errors import ClientError

NO_ID = "<no id>"  # of warnings about documents whose block has no usable id
# The id here of a block that gets one from the service, and the form of those ids.
_MADE, _MADE_IDS = "unnamed0", re.compile(r"unnamed\d+")
_NO_DOCUMENT = "wanted <bml>, got"  # words of the error about text between documents


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockEnd(BlockProgress):
    """The end of a block that was played.

    Attributes:
        warnings: those about the block and its behaviours, in order.
    """

    warnings: tuple[WarningFeedback, ...] = field(default=(), compare=False)


class BlockWaiter:
    """A waiter for the end of a block, or the warning that refuses it.

    Args:
        block: id of the block; None if the service gives it one, NO_ID if it has none that can be used.
        is_acknowledged: whether its first prediction, with the status IN_PREP, has come.
        may_lack_id: whether a service that reads BML 1.0 only may warn of it without its id.

    Attributes:
        message: what was sent with it.
        is_sent: whether the service knows of it.
        start: when the block started, seconds on the session clock, or None.
        last: the feedback that ended it, or None.
        fault: an error instead of its end, as the message `error`, or None.
    """

    def __init__(
        self, block: str | None, *, is_acknowledged: bool = False, may_lack_id: bool = False
    ) -> None:
        self.block = block
        self.is_acknowledged = is_acknowledged
        self.is_planned = False
        self.message: object = None
        self.is_sent = True
        self.start: float | None = None
        self.last: BlockProgress | WarningFeedback | None = None
        self.fault: dict[str, Any] | None = None
        self.warnings: list[WarningFeedback] = []
        self._may_lack_id = may_lack_id

    @property
    def is_finished(self) -> bool:
        return self.last is not None or self.fault is not None

    def on_lost(self) -> None:
        """Handle the loss of the connection, by which the service knew the block."""

    def check(self) -> None:
        """Raise ClientError if there is an error instead of the end of the block."""
        if self.fault is not None:
            raise ClientError.of(self.fault)

    def is_refused_by(self, warning: WarningFeedback) -> bool:
        """Return whether a warning may be the refusal of this block."""
        if warning.id == NO_ID:
            return not self.is_acknowledged and (self.block == NO_ID or self._may_lack_id)
        if self.block != warning.id:
            return False
        # A warning about a block that was planned is about something that was dropped from it.
        return warning.in_use_for is not None or not self.is_planned

    def continues(self, other: "BlockWaiter") -> bool:
        """Return whether the messages of this speech continue another one, so that they end together."""
        return False

    def on_sync_point(self, feedback: SyncPointProgress) -> None:
        """Handle a sync point of the speech that this block belongs to."""

    def on_error(self, error: dict[str, Any]) -> bool:
        """Handle an error about a message without an answer. Return whether it is about this block."""
        return False

    def end(self) -> BlockEnd:
        """Return the feedback at the end of the block, with the warnings about it.

        Raises:
            ClientError: the block was refused, or its end is not known.
        """
        self.check()
        if isinstance(self.last, BlockProgress):
            values = {f.name: getattr(self.last, f.name) for f in fields(BlockProgress)}
            return BlockEnd(**values, warnings=tuple(self.warnings))
        assert self.last is not None
        raise ClientError(f"{self.last.id}: {self.last.text}", "refused")


def waiters_of(bml: str) -> list[BlockWaiter]:
    """Return a waiter for each document of a text, or for what is there instead; none if there is nothing.

    Raises:
        TypeError: `bml` is no string.
    """
    if not isinstance(bml, str):
        raise TypeError(f"bml: wanted a string, got {bml!r:.60}")
    items = [] if is_control(bml) else list(read(bml, block_ids=repeat(_MADE)))
    documents = [item for item in items if isinstance(item, Block) or not item.text.startswith(_NO_DOCUMENT)]
    waiters = [_waiter(item) for item in documents or items]
    for waiter in waiters:
        waiter.message = waiters
    return waiters


def is_control(text: str) -> bool:
    """Return whether a text is a control message."""
    return text.lstrip("\ufeff \t\r\n").startswith("{")


def _waiter(item: Block | BMLError) -> BlockWaiter:
    if isinstance(item, BMLError):
        return BlockWaiter(item.block or NO_ID)
    is_dialect = any(problem.type == NOT_BML_1_0 for problem in item.problems)
    return BlockWaiter(None if item.id == _MADE else item.id, may_lack_id=is_dialect)


class BlockWaiters:
    """The waiters of a connection, in the order in which their blocks were sent.

    If several have one id, the service answers them in this order too.

    Attributes:
        connection: the number of the connection in `welcome`.
    """

    def __init__(self, *waiters: BlockWaiter) -> None:
        self._waiters = list(waiters)
        self.connection: int | None = None

    def add(self, *waiters: BlockWaiter) -> None:
        """Pass feedback to waiters from now on."""
        self._waiters += waiters

    def on_feedback(self, feedback: Feedback) -> None:
        match feedback:
            case BlockProgress(id=id):
                block, _, point = id.rpartition(":")
                for waiter in self._reached(block):
                    if point == "start":
                        waiter.start = feedback.global_time
                    elif point == "end":
                        waiter.last = feedback
            case SyncPointProgress(id=id):
                block = id.partition(":")[0].rpartition(".")[0]  # speech s is spoken in blocks s.1, s.2 ...
                for waiter in self._reached(block):
                    waiter.on_sync_point(feedback)
            case WarningFeedback(id=id):
                block = id.partition(":")[0]
                if feedback.in_use_for in (None, self.connection):
                    for waiter in self._reached(block) or self._reached(block.rpartition(".")[0]):
                        waiter.warnings.append(feedback)
                self._refuse(feedback)
            case PredictionFeedback(blocks=blocks):
                for prediction in blocks:
                    if prediction.status == "IN_PREP":
                        self._acknowledge(prediction.id)
                    elif (current := self._current(prediction.id)) is not None:
                        current.is_planned = current.is_acknowledged
        self._drop_finished()

    def on_error(self, error: dict[str, Any]) -> None:
        """Handle an error about a message without an answer; of several of one id, the newest has sent it."""
        any(waiter.on_error(error) for waiter in reversed(self._waiters) if waiter.is_sent)
        self._drop_finished()

    def on_lost(self) -> list[BlockWaiter]:
        """Handle the loss of the connection, and return the waiters for what was sent and has not ended."""
        lost = [waiter for waiter in self._unfinished() if waiter.is_sent]
        for waiter in lost:
            waiter.on_lost()
        return lost

    def fail(self, waiters: Iterable[BlockWaiter], fault: dict[str, Any]) -> None:
        """End waiters by an error; those that have ended stay as they are."""
        for waiter in waiters:
            if not waiter.is_finished:
                waiter.fault = fault
        self._drop_finished()

    def _drop_finished(self) -> None:
        # Each message of a refused speech causes an error, which must not reach an older speech of its id.
        waited_for = {waiter.block for waiter in self._unfinished()}
        self._waiters = [w for w in self._waiters if w.last is None and w.block in waited_for]

    def _unfinished(self) -> list[BlockWaiter]:
        return [waiter for waiter in self._waiters if not waiter.is_finished]

    def _current(self, block: str) -> BlockWaiter | None:
        """Return the first waiter for the block of an id that plays or comes next."""
        found = [waiter for waiter in self._unfinished() if waiter.block == block]
        return min(found, key=lambda waiter: (not waiter.is_acknowledged, not waiter.is_sent), default=None)

    def _reached(self, block: str) -> list[BlockWaiter]:
        """Return the waiters for the block of an id that plays or comes next."""
        if (current := self._current(block)) is None:
            return []
        return [current, *(waiter for waiter in self._unfinished() if waiter.continues(current))]

    def _acknowledge(self, id: str) -> None:
        waiting = [w for w in self._unfinished() if w.is_sent and not w.is_acknowledged]
        waiter = next((waiter for waiter in waiting if waiter.block == id), None)
        if waiter is None and _MADE_IDS.fullmatch(id):
            waiter = next((waiter for waiter in waiting if waiter.block is None), None)
        if waiter is not None:
            waiter.block, waiter.is_acknowledged = id, True

    def _refuse(self, warning: WarningFeedback) -> None:
        if warning.in_use_for not in (None, self.connection):
            return  # the block of another client
        found = [w for w in self._unfinished() if w.is_sent and w.is_refused_by(warning)]
        if not found:
            return
        if warning.in_use_for is not None:
            # If all are acknowledged, the last one was by the block of another client.
            found = [w for w in found if not w.is_acknowledged] or found[-1:]
        for waiter in self._waiters:
            if waiter is found[0]:
                break
            # If a message is refused as a whole, the warning is about its last block only.
            if waiter.message is found[0].message and not waiter.is_acknowledged:
                waiter.last = warning
        found[0].last = warning
