"""Streaming speech of a client: text sent as it is produced, with feedback of its syncs."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any

from bml_schema.feedback import BlockProgress, Feedback, SyncPointProgress, WarningFeedback
from realizer.client.message_router import ClientError

LONGEST = 20_000  # characters that one message may append
# What comes sooner behind the last message goes with the next one: nobody reads faster, and a service takes
# only so many messages a second, behind which a stop would wait.
PAUSE = 0.01  # s


class SpeechProgress:
    """What was told of a speech; knows no sockets.

    Attributes:
        points: sync of the text -> when it was said, seconds on the session clock.
        end: that it has ended; `said` where it was cut off.
        refused: why it is not said at all.
        fault: why what was sent is no part of it: one of that id was closed and is still being said.
    """

    def __init__(self, id: str) -> None:
        self._id = id
        self.points: dict[str, float] = {}
        self.end: BlockProgress | None = None
        self.refused: str | None = None
        self.fault: dict[str, Any] | None = None

    def on_error(self, error: dict[str, Any]) -> None:
        """An error about a message that has no answer; most are of others."""
        if (error.get("where"), error.get("id")) == ("speech.id", self._id):
            self.fault = error

    def check(self) -> None:
        """
        Raises:
            ClientError: what was sent is no part of it.
        """
        if self.fault is not None:
            raise ClientError.of(self.fault)

    def on_feedback(self, feedback: Feedback) -> None:
        """One message of feedback; most are of others."""
        match feedback:
            case SyncPointProgress(id=id):
                block, behaviour, sync = id.split(":", 2)
                if behaviour == self._id and block.rpartition(".")[0] == self._id:
                    self.points.setdefault(sync, feedback.global_time)
            case BlockProgress(id=id) if id == f"{self._id}:end":
                self.end = feedback
            case WarningFeedback(id=id) if id == self._id:
                self.refused = feedback.text

    def has_passed(self, sync: str) -> bool:
        """Whether that sync has been said, or never will be."""
        return sync in self.points or self.is_finished

    @property
    def is_finished(self) -> bool:
        return any(known is not None for known in (self.end, self.refused, self.fault))

    def point(self, sync: str) -> float:
        """When a sync was said.

        Raises:
            ClientError: it never will be.
        """
        self.check()
        if sync not in self.points:
            raise ClientError(self.refused or f"the speech {self._id} has ended without a sync {sync!r}")
        return self.points[sync]

    def result(self) -> BlockProgress:
        """Its end.

        Raises:
            ClientError: it was refused.
        """
        self.check()
        if self.end is None:
            raise ClientError(self.refused or f"the speech {self._id} has not ended")
        return self.end


class Speech:
    """A speech over an open connection; made by `Client.speech`.

    Args:
        control: sends a control message.
        wait: until something is so.
        check: raises a ClientError where the connection has ended.
        opening: fields of its first message.
    """

    def __init__(
        self,
        id: str,
        control: Callable[..., Awaitable[None]],
        wait: Callable[[Callable[[], bool]], Awaitable[None]],
        check: Callable[[], None],
        opening: dict[str, Any],
    ) -> None:
        self.id = id
        self.progress = SpeechProgress(id)
        self._control = control
        self._wait = wait
        self._check = check
        self._opening = opening
        self._unsent = ""
        self._closed = False
        self._sending = asyncio.Lock()
        self._pausing: asyncio.Task[None] | None = None

    async def append(self, text: str) -> None:
        """Say more: text with <sync id="m"/>, SSML and behaviours in it, each sentence when it is whole.

        It is sent at once, or a moment after the last message was.

        Raises:
            ClientError: it was closed, here or by the service, because the connection that it came by had
                ended before it was whole. Or this connection has ended.
        """
        self.progress.check()
        self._check()  # what waits for its turn would be lost in silence
        if self._closed:
            raise ClientError(f"the speech {self.id} was closed: nothing can follow", "refused")
        self._unsent += text
        if self._pausing is None or self._pausing.done():
            await self._flush()
            self._pausing = asyncio.create_task(self._pause())

    async def close(self) -> None:
        """Nothing follows: what is left is said. Once more does nothing.

        Raises:
            ClientError: the connection has ended.
        """
        if self._closed:
            return
        self._closed = True
        if self.progress.fault is None:
            await self._flush(close=True)

    async def stop(self) -> None:
        """Fall silent at once."""
        self._unsent = ""
        await self._control("stop", blocks=[self.id])

    async def until(self, sync: str) -> float:
        """Wait until a sync of the text is said; when that was, seconds on the session clock.

        Raises:
            ClientError: the speech has ended without it, was refused, or the connection has ended.
        """
        await self._wait(lambda: self.progress.has_passed(sync))
        return self.progress.point(sync)

    async def ended(self) -> BlockProgress:
        """Wait until all is said, or it was cut off: then `said` are the words that were heard.

        Raises:
            ClientError: it was refused, or the connection has ended.
        """
        await self._wait(lambda: self.progress.is_finished)
        return self.progress.result()

    async def _flush(self, *, close: bool = False) -> None:
        async with self._sending:  # in order: a text may take several messages
            text, self._unsent = self._unsent, ""
            least = 0 if close else 1  # to append nothing begins a speech too
            for at in range(0, max(least, len(text)), LONGEST):
                await self._send(append=text[at : at + LONGEST])
            if close:
                await self._send(close=True)

    async def _pause(self) -> None:
        """Send what comes, a few times a second; a connection that has ended tells so whoever waits."""
        await asyncio.sleep(PAUSE)
        with contextlib.suppress(Exception):
            while self._unsent:
                await self._flush()
                await asyncio.sleep(PAUSE)

    async def _send(self, **fields: Any) -> None:
        opening, self._opening = self._opening, {}
        await self._control("speech", id=self.id, **fields, **opening)


class SyncSpeech:
    """A speech over an open connection without an event loop; made by `SyncClient.speech`. As `Speech`.

    Args:
        do: runs what a Speech does.
    """

    def __init__(self, speech: Speech, do: Callable[[Coroutine[Any, Any, Any]], Any]) -> None:
        self._speech = speech
        self._do = do

    @property
    def id(self) -> str:
        return self._speech.id

    def append(self, text: str) -> None:
        """Say more. As `Speech.append`."""
        self._do(self._speech.append(text))

    def close(self) -> None:
        """Nothing follows: what is left is said."""
        self._do(self._speech.close())

    def stop(self) -> None:
        """Fall silent at once."""
        self._do(self._speech.stop())

    def until(self, sync: str) -> float:
        """Wait until a sync of the text is said. Returns and raises as `Speech.until`."""
        return float(self._do(self._speech.until(sync)))

    def ended(self) -> BlockProgress:
        """Wait until all is said, or it was cut off. Raises as `Speech.ended`."""
        end: BlockProgress = self._do(self._speech.ended())
        return end
