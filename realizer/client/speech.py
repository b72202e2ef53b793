"""Streaming speech of a client: text that is sent as it is produced, and the feedback of its syncs."""

import asyncio
import contextlib
import re
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, Self

from bml_schema.feedback import SyncPointProgress
from realizer.client.block_waiters import BlockEnd, BlockWaiter
from realizer.client.errors import ClientError

LONGEST = 20_000  # characters of one message
# Text that follows sooner goes with the next message: a service limits the rate of messages, and a stop would
# wait behind them.
PAUSE = 0.01  # s

# Methods of a client: `control` and `wait_for`.
Control = Callable[..., Awaitable[None]]
Wait = Callable[[Callable[[], bool]], Awaitable[None]]


class SpeechProgress(BlockWaiter):
    """A waiter for the syncs and the end of one speech.

    Attributes:
        is_closed: whether its last message was sent.
        points: sync of the text -> when it was spoken, seconds on the session clock.
        on_word: called with the index of each known word of a clip, and when it is spoken; or None.
    """

    def __init__(self, id: str) -> None:
        super().__init__(id)
        self.is_sent = self.is_closed = False
        self.points: dict[str, float] = {}
        self.on_word: Callable[[int, float], None] | None = None
        self._words = 0  # that were spoken

    def on_lost(self) -> None:
        if not self.is_closed:  # the service closes it
            words = "the connection was lost while the speech was open: what had arrived of it is spoken"
            self.fault = self.fault or {"code": "connection", "id": self.block, "message": words}

    def continues(self, other: BlockWaiter) -> bool:
        if not isinstance(other, SpeechProgress) or other is self or other.is_closed:
            return False
        return self.block == other.block and self.is_sent and not self.is_acknowledged

    def on_sync_point(self, feedback: SyncPointProgress) -> None:
        _, behaviour, sync = feedback.id.split(":", 2)
        if behaviour == self.block and re.fullmatch(r"word-\d+", sync):  # each clip counts from 1
            self._words += 1
            if self.on_word is not None:
                self.on_word(self._words - 1, feedback.global_time)
        elif behaviour == self.block:
            self.points.setdefault(sync, feedback.global_time)

    def on_error(self, error: dict[str, Any]) -> bool:
        where = str(error.get("where"))
        # An error about a part of a clip has only the clip; that about a message that is too long, no id.
        is_clip = where.startswith(f"clip:{self.block}-") or error.get("code") == "too-large"
        if is_clip or (error.get("id") == self.block and where != "speech.append"):
            self.fault = self.fault or error
        return self.fault is not None and error.get("id") == self.block

    def point(self, sync: str) -> float:
        """Return when a sync was spoken.

        Raises:
            ClientError: it never will be.
        """
        self.check()
        if sync not in self.points:
            if self.last is not None:
                self.end()
            raise ClientError(f"the speech {self.block} has ended without a sync {sync!r}")
        return self.points[sync]


class OpenSpeech(ABC):
    """A speech that is sent in parts over an open connection.

    `async with` closes it at its end, and stops it after an exception.
    """

    def __init__(self, id: str, opening: Mapping[str, Any], control: Control, wait: Wait) -> None:
        self.id = id
        self.progress = SpeechProgress(id)
        self._opening = dict(opening)
        self._control = control
        self._wait = wait
        self._closed = self._stopped = False
        self._sending = asyncio.Lock()
        self.earlier: OpenSpeech | None = None  # the speech that had the id before

    @abstractmethod
    async def close(self) -> None:
        """End the speech: what was sent is spoken. Closing again does nothing.

        Raises:
            ClientError: the connection has ended.
        """

    async def stop(self) -> None:
        """Stop speaking at once. What is appended later is ignored; a new speech may have the same id."""
        if not self.progress.is_sent:  # the service cannot stop what it does not know
            await self._speech(append="")
        await self._control("stop", blocks=[self.id])
        await self._end_stopped()

    async def _end_stopped(self) -> None:
        """Close a speech that was cut off: until then the service ignores what has its id."""
        if not self._closed:
            self._closed = self._stopped = True
            await self._speech(close=True)

    async def ended(self) -> BlockEnd:
        """Wait for the end of the speech; if it was cut off, `said` are the words that were spoken.

        Raises:
            ClientError: the speech was refused, or the connection has ended.
        """
        await self._wait(lambda: self.progress.is_finished)
        return self.progress.end()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            await self.close()
            return
        with contextlib.suppress(Exception):  # keep the first exception
            await self.stop()
            await self.close()

    async def _speech(self, **fields: Any) -> None:
        earlier, self.earlier = self.earlier, None
        if earlier is not None and earlier.progress.is_finished:
            await earlier._end_stopped()
        opening = {} if self.progress.is_sent else self._opening
        self.progress.is_sent = True
        self.progress.is_closed |= bool(fields.get("close"))
        await self._control("speech", id=self.id, **opening, **fields)

    def _check_open(self) -> None:
        self.progress.check()
        if self._closed:
            raise ClientError(f"the speech {self.id} was closed: nothing can follow", "refused")


class Speech(OpenSpeech):
    """A speech whose text is sent as it comes, which `Client.speech` returns."""

    def __init__(
        self, id: str, opening: Mapping[str, Any], control: Control, wait: Wait, check: Callable[[], None]
    ) -> None:
        super().__init__(id, opening, control, wait)
        self._check = check
        self._unsent = ""
        self._pausing: asyncio.Task[None] | None = None

    async def append(self, text: str) -> None:
        """Append text, which may contain Markdown, <sync id="m"/>, SSML and behaviours; sentences are spoken.

        It is sent at once, or a moment after the last message.

        Raises:
            ClientError: the speech was closed, by this client or by the service when another connection that
                it came by ended; or this connection has ended.
        """
        if self._stopped:
            return
        self._check_open()
        self._check()  # text that waits to be sent would get lost
        self._unsent += text
        if self._pausing is None or self._pausing.done():
            await self._flush()
            self._pausing = asyncio.create_task(self._pause())

    async def close(self) -> None:
        if self._closed:
            return
        self._closed = True
        if self.progress.fault is None:
            await self._flush(close=True)
        self._end_pause()

    async def stop(self) -> None:
        self._unsent = ""
        self._end_pause()
        await super().stop()

    async def until(self, sync: str) -> float:
        """Wait until a sync of the text is spoken, and return when, in seconds on the session clock.

        Raises:
            ClientError: the speech ended without it or was refused, or the connection has ended.
        """
        await self._wait(lambda: sync in self.progress.points or self.progress.is_finished)
        return self.progress.point(sync)

    async def _flush(self, *, close: bool = False) -> None:
        async with self._sending:  # in order: a text may take several messages
            text, self._unsent = self._unsent, ""
            least = 0 if close else 1  # an empty text begins a speech too
            for at in range(0, max(least, len(text)), LONGEST):
                await self._speech(append=text[at : at + LONGEST])
            if close:
                await self._speech(close=True)

    def _end_pause(self) -> None:
        """Cancel the task that waits, when there is nothing left to send: it would outlive its event loop."""
        if self._pausing is not None:
            self._pausing.cancel()

    async def _pause(self) -> None:
        """Send appended text after a pause; if the connection ends, the methods that wait raise."""
        await asyncio.sleep(PAUSE)
        with contextlib.suppress(Exception):
            while self._unsent:
                await self._flush()
                await asyncio.sleep(PAUSE)
