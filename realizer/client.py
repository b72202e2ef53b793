"""A client of the service: BML out, feedback and frames in; async by `connect`, plain by `connect_sync`."""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
from collections import deque
from collections.abc import AsyncIterator, Iterator
from typing import Any

from bml_schema.feedback import BlockProgress, Feedback, WarningFeedback, parse_feedback
from realizer.client_speech import ClientError, Heard, Speech, SyncSpeech
from realizer.server.wire import FrameKind, WireFrame, unpack

__all__ = ["Client", "ClientError", "SyncClient", "connect", "connect_sync"]

# Frames kept for an iterator that is slower than the service; older ones are dropped.
KEPT = 1_000
STREAM_OF = {
    FrameKind.FAP: "fap",
    FrameKind.AU: "au",
    FrameKind.PICTURE: "video",
    FrameKind.SOUND: "audio",
    FrameKind.MESH: "mesh",
}
_BLOCK_ID = re.compile(r"<(?:\w+:)?bml\b[^<>]*?\bid\s*=\s*[\"']([^\"'<>]+)[\"']")

Frame = WireFrame | dict[str, Any]


class _Mail:
    """Messages sorted by what they are; knows no sockets."""

    def __init__(self) -> None:
        self.feedback: deque[Feedback] = deque()
        self.frames: dict[str, deque[Frame]] = {}
        self.replies: deque[dict[str, Any]] = deque()
        self.last_block: str | None = None
        self.speeches: list[Heard] = []

    def put(self, message: str | bytes) -> None:
        if isinstance(message, bytes):
            frame = unpack(message)
            self.of(STREAM_OF[frame.kind]).append(frame)
        elif message.startswith("{"):
            reply = json.loads(message)
            if reply["type"] == "schedule" or ("frame" in reply and reply["type"] in ("fap", "au")):
                self.of(reply["type"]).append(reply)
            else:
                self.replies.append(reply)
        else:
            feedback = parse_feedback(message)
            self.feedback.append(feedback)
            for speech in self.speeches:
                speech.tell(feedback)
            self.speeches = [speech for speech in self.speeches if not speech.over]

    def sent(self, bml: str) -> None:
        found = _BLOCK_ID.findall(bml)
        self.last_block = found[-1] if found else None

    def of(self, stream: str) -> deque[Frame]:
        """The newest messages of a stream; of `schedule` all, as each says what has changed since another."""
        return self.frames.setdefault(stream, deque(maxlen=None if stream == "schedule" else KEPT))

    def reply(self) -> dict[str, Any]:
        reply = self.replies.popleft()
        if reply["type"] == "error":
            raise ClientError(f"{reply.get('where', '')}: {reply['message']}".removeprefix(": "))
        return reply


class _Until:
    """Whether a block has ended, from its feedback: its end, or the warning that it was refused."""

    def __init__(self, block: str | None) -> None:
        self.block = block
        self._planned = False

    def over(self, feedback: Feedback) -> bool:
        match feedback:
            case BlockProgress(id=id):
                return id == f"{self.block}:end"
            case WarningFeedback(id=id):
                # A warning on the block itself refuses it, unless its prediction is already out.
                return not self._planned and id == (self.block or "<no id>")
        blocks = getattr(feedback, "blocks", ())
        self._planned |= any(b.id == self.block and b.global_end is not None for b in blocks)
        return False


class Client:
    """An open connection; made by `connect`. Several tasks may use it at once."""

    def __init__(self, socket: Any) -> None:
        self._socket = socket
        self._mail = _Mail()
        self._news = asyncio.Condition()
        self._ended = False
        self._reader = asyncio.create_task(self._read())
        self._asking = asyncio.Lock()

    async def send(self, bml: str) -> None:
        """Send one or more BML documents."""
        self._mail.sent(bml)
        await self._socket.send(bml)

    async def control(self, type: str, **fields: Any) -> None:
        """Send a control message that has no answer, such as `stop` or `scene`."""
        await self._socket.send(json.dumps({"type": type, **fields}))

    async def ask(self, type: str, **fields: Any) -> dict[str, Any]:
        """Send a control message and wait for its answer: hello, subscribe, state, ping.

        Raises:
            ClientError: the service answered with an error.
        """
        async with self._asking:
            await self.control(type, **fields)
            await self._wait(lambda: bool(self._mail.replies))
            return self._mail.reply()

    async def subscribe(self, stream: str, **fields: Any) -> dict[str, Any]:
        """Ask for a stream (fap, au, mesh, audio, video, schedule); returns what its values mean.

        Raises:
            ClientError: there is no such stream, or it cannot be had.
        """
        return await self.ask("subscribe", stream=stream, **fields)

    @contextlib.asynccontextmanager
    async def speech(self, id: str, **opening: Any) -> AsyncIterator[Speech]:
        """A speech that is said while its text comes: `async with client.speech("s") as speech`.

        Leaving the block says that nothing follows, and waits for nothing; an exception stops the speech.

        Args:
            id: of the block that others can name; the syncs of its text are `ID:ID:sync` there.
            opening: composition, character, language of the message `speech`.
        """
        speech = Speech(id, self.control, self._wait, opening)
        self._mail.speeches.append(speech.heard)
        try:
            yield speech
        except BaseException:
            with contextlib.suppress(Exception):  # the first one counts
                await speech.stop()
                await speech.close()
            raise
        await speech.close()

    async def feedback(self) -> AsyncIterator[Feedback]:
        """Feedback as it comes, until the connection ends; each is given to one iterator."""
        with contextlib.suppress(ClientError):
            while True:
                await self._wait(lambda: bool(self._mail.feedback))
                yield self._mail.feedback.popleft()

    async def until_end(self, block: str | None = None) -> AsyncIterator[Feedback]:
        """Feedback up to the end (or the refusal) of a block: by default the last one that was sent."""
        until = _Until(block or self._mail.last_block)
        async for feedback in self.feedback():
            yield feedback
            if until.over(feedback):
                return

    async def frames(self, stream: str) -> AsyncIterator[Frame]:
        """Frames of a stream as they come: WireFrame, or a dictionary where the encoding is JSON."""
        kept = self._mail.of(stream)
        with contextlib.suppress(ClientError):
            while True:
                await self._wait(lambda: bool(kept))
                yield kept.popleft()

    async def close(self) -> None:
        """Say goodbye."""
        await self._socket.close()
        await self._reader

    async def _read(self) -> None:
        from websockets.exceptions import ConnectionClosed

        try:
            while True:
                message = await self._socket.recv()
                self._mail.put(message)
                async with self._news:
                    self._news.notify_all()
        except ConnectionClosed:
            pass
        finally:
            self._ended = True
            async with self._news:
                self._news.notify_all()

    async def _wait(self, there: Any) -> None:
        async with self._news:
            await self._news.wait_for(lambda: there() or self._ended)
        if not there():
            raise ClientError("the connection has ended")


class SyncClient:
    """An open connection without an event loop; made by `connect_sync`. For one thread."""

    def __init__(self, socket: Any) -> None:
        self._socket = socket
        self._mail = _Mail()

    def send(self, bml: str) -> None:
        """Send one or more BML documents."""
        self._mail.sent(bml)
        self._socket.send(bml)

    def control(self, type: str, **fields: Any) -> None:
        """Send a control message that has no answer."""
        self._socket.send(json.dumps({"type": type, **fields}))

    def ask(self, type: str, **fields: Any) -> dict[str, Any]:
        """Send a control message and wait for its answer. Errors as `Client.ask`."""
        self.control(type, **fields)
        self._wait(lambda: bool(self._mail.replies))
        return self._mail.reply()

    def subscribe(self, stream: str, **fields: Any) -> dict[str, Any]:
        """Ask for a stream; returns what its values mean. Errors as `Client.ask`."""
        return self.ask("subscribe", stream=stream, **fields)

    @contextlib.contextmanager
    def speech(self, id: str, **opening: Any) -> Iterator[SyncSpeech]:
        """A speech that is said while its text comes, as `Client.speech` without `async`."""
        speech = SyncSpeech(id, self.control, self._wait, opening)
        self._mail.speeches.append(speech.heard)
        try:
            yield speech
        except BaseException:
            with contextlib.suppress(Exception):  # the first one counts
                speech.stop()
                speech.close()
            raise
        speech.close()

    def feedback(self) -> Iterator[Feedback]:
        """Feedback as it comes, until the connection ends."""
        with contextlib.suppress(ClientError):
            while True:
                self._wait(lambda: bool(self._mail.feedback))
                yield self._mail.feedback.popleft()

    def until_end(self, block: str | None = None) -> Iterator[Feedback]:
        """Feedback up to the end (or the refusal) of a block: by default the last one that was sent."""
        until = _Until(block or self._mail.last_block)
        for feedback in self.feedback():
            yield feedback
            if until.over(feedback):
                return

    def frames(self, stream: str) -> Iterator[Frame]:
        """Frames of a stream as they come, until the connection ends."""
        kept = self._mail.of(stream)
        with contextlib.suppress(ClientError):
            while True:
                self._wait(lambda: bool(kept))
                yield kept.popleft()

    def close(self) -> None:
        """Say goodbye."""
        self._socket.close()

    def _wait(self, there: Any) -> None:
        from websockets.exceptions import ConnectionClosed

        while not there():
            try:
                self._mail.put(self._socket.recv())
            except ConnectionClosed:
                raise ClientError("the connection has ended") from None


@contextlib.asynccontextmanager
async def connect(url: str) -> AsyncIterator[Client]:
    """`async with connect("ws://127.0.0.1:8765/ws") as client`.

    Raises:
        OSError: nobody listens there.
    """
    from websockets.asyncio.client import connect as dial

    async with dial(url, compression=None, max_size=None, max_queue=None) as socket:
        client = Client(socket)
        try:
            yield client
        finally:
            await client.close()


@contextlib.contextmanager
def connect_sync(url: str) -> Iterator[SyncClient]:
    """`with connect_sync("ws://127.0.0.1:8765/ws") as client`. Errors as `connect`."""
    from websockets.sync.client import connect as dial

    with dial(url, compression=None, max_size=None) as socket:
        client = SyncClient(socket)
        try:
            yield client
        finally:
            client.close()
