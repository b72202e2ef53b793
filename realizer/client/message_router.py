"""The router of the service's messages to queues, requests, waiters and receivers; it has no sockets."""

import json
import logging
import math
import time
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Protocol

from bml_schema.feedback import BlockProgress, Feedback, WarningFeedback, parse_feedback
from realizer.client.block_waiters import BlockWaiter, BlockWaiters, waiters_of
from realizer.client.control_requests import ControlRequests
from realizer.client.errors import ClientError
from realizer.protocol.streams import JSON_STREAMS
from realizer.protocol.wire import WireFrame, unpack

# Lengths of the queues for iterators slower than the service; older messages are dropped.
MAX_FRAMES = 1_000
MAX_FEEDBACK = 10_000
_LOG = logging.getLogger("realizer.client")

Frame = WireFrame[Any] | dict[str, Any]


class Receiver(Protocol):
    """A receiver of the binary frames of one subscription."""

    def receive(self, message: WireFrame[Any], now: float) -> None: ...


class Arrivals:
    """A receiver that keeps the newest frames as they arrive."""

    def __init__(self) -> None:
        self.frames: deque[WireFrame[Any]] = deque(maxlen=MAX_FRAMES)

    def receive(self, message: WireFrame[Any], now: float) -> None:
        self.frames.append(message)


class Router:
    """The queues of messages that have arrived, and what waits for some.

    Attributes:
        receivers: (stream, the character in `subscribe`) -> what its binary frames go to instead of a queue.
        errors: errors about nothing that waits, such as a part of a speech, and of video streams that ended.
        requests: the control messages that wait for their answers.
        waiters: of the blocks and speeches that were sent and have not ended.
        left_out: stream -> number of frames that an iteration was too late for.
        last_sent: the waiter for the last block of the last text.
        feedback: that was not taken, and an error where some is missing.
        welcome: the last one.
        seen: number of the last feedback.
    """

    def __init__(self) -> None:
        self.receivers: dict[tuple[str, str | None], Receiver] = {}
        self.feedback: deque[Feedback | ClientError] = deque(maxlen=MAX_FEEDBACK)
        self.welcome: dict[str, Any] = {}
        self.seen = 0
        self.frames: dict[str, deque[Frame]] = {}
        self.errors: deque[dict[str, Any]] = deque(maxlen=MAX_FRAMES)
        self.waiters = BlockWaiters()
        self.last_sent: BlockWaiter | None = None
        self.requests = ControlRequests()
        self.left_out = Counter[str]()
        self._streams: dict[tuple[str, int], dict[str, Any]] = {}  # stream, index -> its description

    def receive(self, message: str | bytes) -> None:
        if isinstance(message, bytes):
            frame = unpack(message)
            description = self._streams.get((frame.stream, frame.character))
            frame = replace(frame, stream_info=description)
            receiver = self.receivers.get((frame.stream, (description or {}).get("character")))
            if receiver is None:
                self.queue_of(frame.stream).append(frame)
            else:
                receiver.receive(frame, time.monotonic())
        elif message.startswith("{"):
            reply = json.loads(message)
            if reply["type"] in JSON_STREAMS:
                self.queue_of(reply["type"]).append(reply)
            else:
                self._reply(reply)
        else:
            feedback = parse_feedback(message)
            self.feedback.append(feedback)
            self.seen = feedback.seq or self.seen
            if isinstance(feedback, WarningFeedback):
                _LOG.warning("%s: %s: %s", feedback.id, feedback.type, feedback.text)
            elif isinstance(feedback, BlockProgress) and not feedback.shown:
                _LOG.warning("%s: nothing of it was heard or moved", feedback.id.removesuffix(":end"))
            self.waiters.on_feedback(feedback)

    def on_sent(self, bml: str) -> BlockWaiter | None:
        """Return a waiter for the last block of a text; None if the service will not answer the text."""
        added = waiters_of(bml)
        self.waiters.add(*added)
        self.last_sent = added[-1] if added else None
        return self.last_sent

    def take_feedback(self) -> Feedback:
        """Return the next feedback.

        Raises:
            ClientError: some is missing before it.
        """
        feedback = self.feedback.popleft()
        if isinstance(feedback, ClientError):
            raise feedback
        return feedback

    def on_gap(self, interrupted: Sequence[BlockWaiter]) -> None:
        """Handle that a new connection will not get all feedback since the last one was lost.

        Args:
            interrupted: what was waited for then.
        """
        words = "the connection was lost, and the service no longer has the feedback that followed"
        fault = {"code": "gap", "message": f"{words}: the session has begun anew, or too much was missed"}
        self.waiters.fail(interrupted, fault)
        self.feedback.append(ClientError.of(fault))

    def on_return(self, interrupted: Sequence[BlockWaiter]) -> None:
        """Handle that a new connection has got the feedback that was missed."""
        words = "the connection was lost before the service acknowledged the block: send it again"
        lost = [waiter for waiter in interrupted if not (waiter.is_acknowledged or waiter.is_finished)]
        self.waiters.fail(lost, {"code": "connection", "message": words})
        self._streams.clear()
        for receiver in self.receivers.values():
            if isinstance(receiver, Playout):
                receiver.restart()

    def queue_of(self, stream: str) -> deque[Frame]:
        """Return the newest messages of a stream; all of `schedule`, as each is the difference to others."""
        return self.frames.setdefault(stream, deque(maxlen=None if stream == "schedule" else MAX_FRAMES))

    def _reply(self, reply: dict[str, Any]) -> None:
        if reply["type"] == "welcome":
            self.welcome, self.seen = reply, reply["seq"]
            self.waiters.connection = reply.get("connection")
        if reply["type"] in ("subscribed", "changed"):
            key = reply["stream"], reply.get("index", 0)
            known = self._streams.get(key, {}) if reply["type"] == "changed" else {}
            self._streams[key] = known | reply
        if self.requests.on_reply(reply) is not None:
            return
        if reply["type"] in ("error", "gap"):
            # Each message of a refused speech causes the same error.
            is_repeated = bool(self.errors) and self.errors[-1] == reply
            self.errors.append(reply)
            if reply["type"] == "error" and not is_repeated:
                _LOG.warning("%s", ClientError.of(reply))
            self.waiters.on_error(reply)


# Of frames that are not due yet, the oldest ones are lost beyond this number.
MAX_WAITING = 1_000
# The session clock is estimated from the messages of so many seconds.
MEMORY = 5.0  # s
LATE = 0.2  # s; of frames that are due for longer only the newest one is taken
GAP = 0.5  # s without a message, in which the program stood still: what it knew of the clock is no older


class Playout:
    """A queue of the frames of one stream, each of which is due at its time on the session clock.

    The session clock is estimated from the messages that took the least time: the service sends their last
    frame `ahead` seconds before its time. A program that is slower than the frames, or stood still, gets the
    newest one that is due; `left_out` counts the others.

    Args:
        ahead: as in `subscribe`.
    """

    def __init__(self, ahead: float) -> None:
        self.left_out = 0  # frames that were long past
        self.received = 0  # messages
        self._ahead = ahead
        self._heard = -math.inf  # when the last message arrived
        self._frames: deque[WireFrame[Any]] = deque(maxlen=MAX_WAITING)
        self._next = 0  # number of the first frame that was not taken
        # (arrival, offset) of messages, the offsets rising: the first is the least of those remembered.
        self._offsets: deque[tuple[float, float]] = deque()

    def receive(self, message: WireFrame[Any], now: float) -> None:
        """Add the frames of a message, instead of those from its first one on.

        Args:
            now: when it arrived, in seconds on any clock that never jumps.
        """
        frames = message.rows()
        self.received += 1
        while self._frames and self._frames[-1].frame >= message.frame:
            self._frames.pop()
        self._frames.extend(frame for frame in frames if frame.frame >= self._next)
        gap = now - self._heard
        if GAP < gap < math.inf:
            self._offsets = deque((arrival + gap, offset) for arrival, offset in self._offsets)
        self._heard = now
        offset = now - (frames[-1].time - self._ahead)
        while self._offsets and self._offsets[0][0] < now - MEMORY:
            self._offsets.popleft()
        while self._offsets and self._offsets[-1][1] >= offset:
            self._offsets.pop()
        self._offsets.append((now, offset))

    def restart(self) -> None:
        """Handle a new connection, whose frames may have other numbers and times."""
        self._frames.clear()
        self._offsets.clear()
        self._next = 0
        self._heard = -math.inf

    def is_late(self, now: float) -> bool:
        """Return whether the next frame is long past."""
        return self.next_due < now - LATE

    @property
    def next_due(self) -> float:
        """When the next frame is due, on the clock of `receive`; infinity without frames."""
        return self._frames[0].time + self._offsets[0][1] if self._frames else math.inf

    def take(self, now: float) -> WireFrame[Any] | None:
        """Return the next frame if it is due; of frames long past, the newest one."""
        if self.next_due > now:
            return None
        if self.is_late(now):
            while len(self._frames) > 1 and self._frames[1].time + self._offsets[0][1] <= now:
                self._frames.popleft()
                self.left_out += 1
        frame = self._frames.popleft()
        self._next = frame.frame + 1
        return frame
