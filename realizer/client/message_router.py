"""A router of the service's messages to those that wait for them; it knows no sockets."""

from __future__ import annotations

import json
import re
from collections import deque
from dataclasses import replace
from html import unescape
from typing import Any, Protocol

from bml_schema.feedback import BlockProgress, Feedback, PredictionFeedback, WarningFeedback, parse_feedback
from realizer.core.errors import RealizerError
from realizer.protocol.messages.common import ANSWERS
from realizer.protocol.wire import WireFrame, unpack

# Frames and feedback kept for an iterator that is slower than the service; older ones are dropped.
MAX_FRAMES = 1_000
MAX_FEEDBACK = 10_000
_COMMENT = re.compile(r"<!--.*?-->|<\?.*?\?>", re.DOTALL)
_BLOCK_ID = re.compile(r"<(?:\w+:)?bml\b[^<>]*?\bid\s*=\s*[\"']([^\"'<>]+)[\"']")

Frame = WireFrame | dict[str, Any]


class ClientError(RealizerError):
    """The service refused something, or the connection ended while something was awaited.

    Attributes:
        code: as in the message `error`; "refused" of a block, "connection" where it ended.
    """

    def __init__(self, text: str, code: str = "connection") -> None:
        super().__init__(text)
        self.code = code

    @classmethod
    def of(cls, error: dict[str, Any]) -> ClientError:
        """What a message `error` says."""
        return cls(f"{error.get('where', '')}: {error['message']}".removeprefix(": "), error["code"])


def is_blank(bml: str) -> bool:
    """Whether there is nothing in a text that the service would answer."""
    return not _COMMENT.sub("", bml).strip()


class Listener(Protocol):
    """Who hears feedback until it is over."""

    @property
    def is_finished(self) -> bool:
        """Nothing more of what it follows will come."""
        ...

    def on_feedback(self, feedback: Feedback) -> None:
        """One message of feedback; most are of others."""
        ...

    def on_error(self, error: dict[str, Any]) -> None:
        """An error about a message that has no answer; most are of others."""
        ...


class Router:
    """What has come and nobody has taken yet.

    Attributes:
        errors: of what was not asked for: control messages without an answer, pictures that ended.
        last_block: id of the last block that was sent; None where it has none.
    """

    def __init__(self) -> None:
        self.feedback: deque[Feedback] = deque(maxlen=MAX_FEEDBACK)
        self.frames: dict[str, deque[Frame]] = {}
        self.errors: deque[dict[str, Any]] = deque(maxlen=MAX_FRAMES)
        self.last_block: str | None = None
        self._asked: str | None = None
        self._answer: dict[str, Any] | None = None
        self._listeners: list[Listener] = []
        self._told: dict[tuple[str, int], dict[str, Any]] = {}  # stream, index -> what its frames mean

    def receive(self, message: str | bytes) -> None:
        if isinstance(message, bytes):
            frame = unpack(message)
            told = self._told.get((frame.stream, frame.character))
            self.queue_of(frame.stream).append(replace(frame, stream_info=told))
        elif message.startswith("{"):
            reply = json.loads(message)
            if reply["type"] == "schedule" or "values" in reply:
                self.queue_of(reply["type"]).append(reply)
            else:
                self._reply(reply)
        else:
            feedback = parse_feedback(message)
            self.feedback.append(feedback)
            for one in self._listeners:
                one.on_feedback(feedback)
            self._listeners = [one for one in self._listeners if not one.is_finished]

    def on_sent(self, bml: str) -> None:
        found = _BLOCK_ID.findall(_COMMENT.sub("", bml))
        self.last_block = unescape(found[-1]) if found else None

    def queue_of(self, stream: str) -> deque[Frame]:
        """The newest messages of a stream; of `schedule` all, as each says what has changed since another."""
        return self.frames.setdefault(stream, deque(maxlen=None if stream == "schedule" else MAX_FRAMES))

    def expect_answer(self, type: str) -> None:
        """From now on the next answer to a message of that type is for `answer`."""
        self._asked, self._answer = type, None

    @property
    def has_answer(self) -> bool:
        return self._answer is not None

    def answer(self) -> dict[str, Any]:
        assert self._answer is not None
        if self._answer["type"] == "error":
            raise ClientError.of(self._answer)
        return self._answer

    def add_listener(self, follower: Listener) -> None:
        """Let somebody hear all feedback from now on; whoever iterates gets it all the same."""
        self._listeners.append(follower)

    def _reply(self, reply: dict[str, Any]) -> None:
        asked = self._asked
        if reply["type"] in ("subscribed", "changed"):
            key = reply["stream"], reply.get("index", 0)
            self._told[key] = self._told.get(key, {}) | reply
        if reply["type"] == "error":
            # Where it says nothing of where, it is about text that was no message at all.
            mine = reply.get("where", f"{asked}").partition(".")[0] in (asked, "type")
        else:
            mine = asked is not None and reply["type"] == ANSWERS.get(asked)
        if mine and asked is not None:
            self._asked, self._answer = None, reply
        elif reply["type"] in ("error", "gap"):
            self.errors.append(reply)
            for one in self._listeners:
                one.on_error(reply)


class BlockWaiter:
    """Whether a block has ended, from its feedback: its end, or the warning that it was refused.

    Attributes:
        start: when it started, seconds on the session clock; None before.
        last: the feedback that ended it; None before.
    """

    def __init__(self, block: str | None) -> None:
        self.block = block
        self.start: float | None = None
        self.last: BlockProgress | WarningFeedback | None = None
        self._planned = False

    @property
    def is_finished(self) -> bool:
        return self.last is not None

    def on_feedback(self, feedback: Feedback) -> None:
        """One message of feedback; most are of others."""
        match feedback:
            case BlockProgress(id=id) if id == f"{self.block}:start":
                self.start = feedback.global_time
            case BlockProgress(id=id) if id == f"{self.block}:end":
                self.last = self.last or feedback
            case WarningFeedback(id=id) if id == (self.block or "<no id>") and not self._planned:
                # A warning on the block itself refuses it, unless its prediction is already out.
                self.last = self.last or feedback
            case PredictionFeedback():
                self._planned |= any(b.id == self.block and b.global_end is not None for b in feedback.blocks)

    def on_error(self, error: dict[str, Any]) -> None:
        """What is wrong with a block is told in feedback."""

    def end(self) -> BlockProgress:
        """What told the end.

        Raises:
            ClientError: the block was refused.
        """
        if isinstance(self.last, BlockProgress):
            return self.last
        assert self.last is not None
        raise ClientError(f"{self.last.id}: {self.last.text}", "refused")
