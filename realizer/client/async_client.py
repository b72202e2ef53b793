"""The asynchronous client."""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import time
from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from copy import copy
from pathlib import Path
from typing import Any, Unpack
from urllib.parse import parse_qsl, urlencode, urlsplit

from bml_schema.feedback import BlockProgress, Feedback
from realizer.client.block_waiters import BlockWaiter, BlockWaiters, is_control
from realizer.client.errors import ClientError, ClosedError
from realizer.client.message_router import Arrivals, Frame, Playout, Receiver, Router
from realizer.client.speech import Speech
from realizer.client.stream_options import FrameOptions, PictureOptions, SoundOptions, SpeechOptions
from realizer.client.voice import Pcm, Timed, Voice, samples_of, timed
from realizer.protocol.messages.common import ANSWERS
from realizer.protocol.streams import STREAMS
from realizer.protocol.wire import ArkitFrame, AUFrame, FapFrame, MeshFrame, PictureFrame, SoundFrame


class Client:
    """An open connection, which `connect` returns. Several tasks may use it at once.

    Args:
        connect: opens another connection to an address of the same service.

    Attributes:
        url: the address of the connection.
        welcome: the first message of the service: session, version, capabilities, limits.
    """

    def __init__(
        self, socket: Any, url: str, connect: Callable[[str], contextlib.AbstractAsyncContextManager[Client]]
    ) -> None:
        self.url = url
        self._connect = connect
        self.welcome: Mapping[str, Any] = {}
        self._socket = socket
        self._router = Router()
        self._received = asyncio.Condition()
        self._end: ClientError | None = None  # why nothing more comes
        self._reader = asyncio.create_task(self._read())
        self._request_lock = asyncio.Lock()
        self._speeches: dict[str, Speech] = {}  # the latest of each id

    @property
    def session(self) -> str:
        """The name of the session, which other clients may join."""
        return str(self.welcome["session"])

    @property
    def errors(self) -> list[dict[str, Any]]:
        """Errors about messages that have no answer."""
        return list(self._router.errors)

    async def send(self, bml: str) -> None:
        """Send one or more BML documents.

        Raises:
            ClientError: the connection has ended.
        """
        self._router.on_sent(bml)
        await self._post(bml)

    async def control(self, /, type: str, **fields: Any) -> None:
        """Send a control message that has no answer, such as `stop` or `scene`; see `errors`.

        Raises:
            ClientError: the connection has ended.
        """
        await self._post(json.dumps({"type": type, **fields}))

    async def ask(self, /, type: str, **fields: Any) -> dict[str, Any]:
        """Send a control message and wait for its answer: hello, subscribe, state, ping.

        Raises:
            ClientError: the service answered with an error.
            ValueError: such a message has no answer.
        """
        if type not in ANSWERS:
            raise ValueError(f"wanted one of {', '.join(ANSWERS)}, which are answered; got {type}")
        async with self._request_lock:
            self._router.expect_answer(type)
            await self.control(type, **fields)
            await self.wait_for(lambda: self._router.has_answer)
            return self._router.answer()

    async def subscribe(self, /, stream: str, **fields: Any) -> dict[str, Any]:
        """Subscribe to a stream, a key of `welcome["capabilities"]["streams"]`, and return its description.

        Raises:
            ClientError: there is no such stream, or it is not available.
        """
        return await self.ask("subscribe", stream=stream, **fields)

    async def state(self) -> dict[str, Any]:
        """Return the state of the session: its blocks, and the action units with their sources."""
        return await self.ask("state")

    async def play(self, bml: str) -> BlockProgress:
        """Send BML, wait for the end of its last block, and return that.

        Feedback names blocks by their ids only. If several connections of a session send an id at the same
        time, this may return the end of the block of another one, though its own was refused.

        Raises:
            ClientError: the block was refused, or the connection ended.
            TypeError: `bml` is no string.
        """
        block = await self.send_and_follow(bml)
        await self.wait_for(lambda: block.is_finished)
        return block.end()

    async def send_and_follow(self, bml: str) -> BlockWaiter:
        """Send BML and return a waiter, which follows the start and the end of its last block.

        Raises:
            ClientError: the text is blank or a control message, or the connection has ended.
        """
        block = self._router.on_sent(bml)
        if block is None:
            got = "a control message, which `control` and `ask` send" if is_control(bml) else "nothing"
            raise ClientError(f"wanted <bml>, got {got}", "refused")
        await self._post(bml)
        return block

    async def wait_for(self, condition: Callable[[], bool]) -> None:
        """Wait until a condition holds. It is checked after each message of the service.

        Raises:
            ClientError: the connection ended first, also because a message could not be read.
        """
        async with self._received:
            await self._received.wait_for(lambda: condition() or self._end is not None)
        if not condition():
            self._check()

    def speech(self, id: str, **opening: Any) -> Speech:
        """Return a speech whose text is streamed: `async with client.speech("s") as speech`.

        Leaving the block closes the speech without waiting for its end; an exception stops it.

        Args:
            id: id of the speech and of its block; other blocks refer to a sync of its text as `ID:ID:sync`.
            opening: composition, character and language, as in the message `speech`.
        """
        speech = Speech(id, opening, self.control, self.wait_for, self._check)
        speech.earlier, self._speeches[id] = self._speeches.get(id), speech
        self._router.waiters.add(speech.progress)
        return speech

    def voice(self, *, rate: int, language: str | None = None, **opening: Unpack[SpeechOptions]) -> Voice:
        """Return a speech whose sound is sent as it comes: write(pcm), words([...]), close(), ended().

        Without words, lips follow the sound.

        Args:
            rate: samples a second.
            language: BCP-47 tag of the words; None: the service's.
        """
        fields = opening if language is None else {**opening, "language": language}
        voice = Voice(rate, fields, self._post, self.control, self.wait_for)
        self._router.waiters.add(voice.progress)
        return voice

    async def say(
        self,
        sound: Pcm,
        rate: int | None = None,
        text: str | None = None,
        words: Iterable[Timed] | None = None,
        phonemes: Iterable[Timed] | None = None,
        visemes: Iterable[Timed] | None = None,
        language: str | None = None,
        viseme_set: str = "oculus",
        **opening: Unpack[SpeechOptions],
    ) -> BlockProgress:
        """Play the sound of any other voice, and return its end; `said` are the words, if it was cut off.

        Without words, phonemes and visemes, lips follow the text, or the sound alone.

        Args:
            sound: a WAV, FLAC, MP3, Ogg or WebM file; with `rate` mono PCM: int16, or floats from -1 to 1.
            rate: samples a second of PCM.
            text: what is said.
            words, phonemes, visemes: (seconds, text) or (start, end, text) of each; phonemes in IPA.
            language: BCP-47 tag of the text and the words; None: the service's.
            viseme_set: oculus, mpeg4, sapi or polly.

        Raises:
            TypeError, ValueError: an argument has another form.
            ClientError: the service refuses it, or the connection has ended.
        """
        if rate is None and not isinstance(sound, bytes | bytearray | memoryview):
            raise TypeError(f"sound: wanted the bytes of a sound file, or PCM with a rate, got {type(sound)}")
        voice = self.voice(rate=1 if rate is None else rate, language=language, **opening)
        lists = {"words": words, "phonemes": phonemes, "visemes": visemes}
        described: dict[str, Any] = {name: timed(name, v) for name, v in lists.items() if v is not None}
        described |= {"text": text} if text is not None else {}
        described |= {"viseme_set": viseme_set} if visemes is not None else {}
        content = bytes(sound) if rate is None else samples_of(sound).astype("<i2").tobytes()
        await voice.clip(content, rate or 0, close=True, **described)
        return await voice.ended()

    async def feedback(self) -> AsyncIterator[Feedback]:
        """Yield feedback as it arrives, until `close`; each message to one iterator only.

        Raises:
            ClientError: the connection was lost.
        """
        with contextlib.suppress(ClosedError):
            while True:
                await self.wait_for(lambda: bool(self._router.feedback))
                yield self._router.feedback.popleft()

    async def until_end(self, block: str | None = None) -> AsyncIterator[Feedback]:
        """Yield feedback up to the end, or the refusal, of a block: by default of the last one sent.

        Args:
            block: an id. Another client may send this block, also later: this waits until one ends.

        Raises:
            ClientError: the connection was lost before that.
            ValueError: nothing was sent, so that there is no last block.
        """
        waiter = self._router.last_sent if block is None else BlockWaiter(block, is_acknowledged=True)
        if waiter is None:
            raise ValueError("block: wanted an id, because no BML was sent last")
        # What was sent is followed already.
        waiters, queue = BlockWaiters() if block is None else BlockWaiters(waiter), self._router.feedback
        with contextlib.suppress(ClosedError):
            while True:
                await self.wait_for(lambda: bool(queue) or waiter.is_finished)
                if not queue:
                    return  # its end was taken from the queue before
                feedback = queue.popleft()
                yield feedback
                waiters.on_feedback(feedback)
                if feedback is waiter.last:
                    return

    def frames(self, stream: str) -> AsyncIterator[Frame]:
        """Yield frames of a stream as they arrive, until `close`: WireFrame, or a dictionary for JSON.

        The attribute `stream_info` of a WireFrame describes its stream at that time. It changes when the
        character of a mesh gets another face, and `vertices` depends on it.

        Raises:
            ClientError: the connection was lost.
            ValueError: there is no such stream.
        """
        names = [name for name in STREAMS if name != "feedback"]
        if stream not in names:
            raise ValueError(f"stream: wanted one of {', '.join(names)}; got {stream!r}")
        return self._frames(stream)

    async def _frames(self, stream: str) -> AsyncIterator[Frame]:
        queue = self._router.queue_of(stream)
        with contextlib.suppress(ClosedError):
            while True:
                await self.wait_for(lambda: bool(queue))
                yield queue.popleft()

    def faps(self, *, ahead: float = 0.2, **options: Unpack[FrameOptions]) -> AsyncIterator[FapFrame]:
        """Subscribe to FAPs, and yield each frame at its time.

        Args:
            ahead: how long before their time the service sends frames, 0 to 2 s: longer delays are noticed.

        Raises:
            ClientError: the service refuses the subscription, or the connection was lost.
        """
        return self._play_out("fap", ahead, options)

    def aus(self, *, ahead: float = 0.2, **options: Unpack[FrameOptions]) -> AsyncIterator[AUFrame]:
        """Subscribe to action units, and yield each frame at its time, as `faps`."""
        return self._play_out("au", ahead, options)

    def arkit(self, *, ahead: float = 0.2, **options: Unpack[FrameOptions]) -> AsyncIterator[ArkitFrame]:
        """Subscribe to ARKit's weights and rotations, and yield each frame at its time, as `faps`."""
        return self._play_out("arkit", ahead, options)

    def mesh(self, **options: Unpack[FrameOptions]) -> AsyncIterator[MeshFrame]:
        """Subscribe to the vertices of the face, and yield frames as they arrive. Errors as `faps`."""
        return self._take("mesh", options)

    def pictures(self, **options: Unpack[PictureOptions]) -> AsyncIterator[PictureFrame]:
        """Subscribe to pictures, and yield them as they arrive. Errors as `faps`."""
        return self._take("video", options)

    def sound(self, **options: Unpack[SoundOptions]) -> AsyncIterator[SoundFrame]:
        """Subscribe to sound, and yield packets as they arrive, at most 0.1 s ahead. Errors as `faps`."""
        return self._take("audio", options)

    async def _play_out(self, stream: str, ahead: float, options: Mapping[str, Any]) -> AsyncIterator[Any]:
        playout = Playout(ahead)
        with contextlib.suppress(ClosedError):
            async with self._subscribed(stream, playout, {**options, "ahead": ahead}):
                while True:
                    while (frame := playout.take(time.monotonic())) is not None:
                        yield frame
                    due = playout.next_due
                    pause = None if due == math.inf else due - time.monotonic()
                    with contextlib.suppress(TimeoutError):
                        async with asyncio.timeout(pause):
                            await self.wait_for(lambda due=due: playout.next_due != due)  # type: ignore[misc]

    async def _take(self, stream: str, options: Mapping[str, Any]) -> AsyncIterator[Any]:
        arrivals = Arrivals()
        with contextlib.suppress(ClosedError):
            async with self._subscribed(stream, arrivals, options):
                while True:
                    await self.wait_for(lambda: bool(arrivals.frames))
                    yield arrivals.frames.popleft()

    @contextlib.asynccontextmanager
    async def _subscribed(
        self, stream: str, receiver: Receiver, options: Mapping[str, Any]
    ) -> AsyncIterator[None]:
        """Subscribe for a receiver, until the block is left."""
        character, receivers = options.get("character"), self._router.receivers
        receivers[stream, character] = receiver
        try:
            await self.subscribe(stream, **options)
            yield
        finally:
            if receivers.get((stream, character)) is receiver:
                del receivers[stream, character]
                with contextlib.suppress(ClientError):
                    await self.control("unsubscribe", stream=stream, character=character)

    async def film(self, /, path: str | Path, bml: str, *, fps: float = 25, **look: Any) -> BlockProgress:
        """Play BML and save its last block as a film with sound (.mp4, .webm).

        The service draws live, so the film repeats a picture if the next one was not drawn in time. `realizer
        realize` draws all pictures.

        Args:
            look: size, camera, light, background, character, as in `subscribe` for video.

        Raises:
            ClientError: the block was refused, there are no pictures, or the suffix is not that of a film.
            FileNotFoundError: the folder does not exist; nothing is played.
            RealizerError: PyAV is not installed.
        """
        from realizer.client.record import record

        # Another connection, so that the subscriptions of this one stay as they are.
        parts = urlsplit(self.url)
        query = [(name, value) for name, value in parse_qsl(parts.query) if name not in ("session", "seen")]
        url = parts._replace(query=urlencode([*query, ("session", self.session)])).geturl()
        return await record(self._connect(url), Path(path), bml, fps, look)

    async def close(self) -> None:
        """Close the connection, which ends the iterations over feedback and frames."""
        self._end = self._end or ClosedError()
        await self._socket.close()
        await self._reader

    async def _post(self, message: str | bytes) -> None:
        from websockets.exceptions import ConnectionClosed

        try:
            await self._socket.send(message)
        except ConnectionClosed:
            await self.wait_for(lambda: False)  # raises once the reader knows the reason

    async def _read(self) -> None:
        from websockets.exceptions import ConnectionClosed

        try:
            while True:
                message = await self._socket.recv()
                self._router.receive(message)
                async with self._received:
                    self._received.notify_all()
        except ConnectionClosed as closed:
            reason = closed.rcvd.reason if closed.rcvd is not None else ""
            end = ClientError("the connection has ended" + (f": {reason}" if reason else ""))
        except Exception as fault:
            end = ClientError(f"a message of the service cannot be read: {fault!r}")
            await self._socket.close()
        self._end = self._end or end
        async with self._received:
            self._received.notify_all()

    def _check(self) -> None:
        if self._end is not None:
            raise copy(self._end)  # for each caller, with a traceback of its own
