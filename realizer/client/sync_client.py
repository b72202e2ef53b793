"""The synchronous client: an asynchronous one in a thread."""

import asyncio
import threading
from collections.abc import AsyncGenerator, AsyncIterator, Coroutine, Iterable, Iterator, Mapping
from contextlib import AbstractAsyncContextManager, contextmanager
from pathlib import Path
from typing import Any, TypeVar, Unpack

from bml_schema.feedback import BlockProgress, Feedback
from realizer.client.async_client import Client
from realizer.client.message_router import ClientError, Frame
from realizer.client.speech import SyncSpeech
from realizer.client.stream_options import FrameOptions, PictureOptions, SoundOptions, SpeechOptions
from realizer.client.voice import Pcm, SyncVoice, Timed
from realizer.protocol.wire import ArkitFrame, AUFrame, FapFrame, MeshFrame, PictureFrame, SoundFrame

T = TypeVar("T")


class SyncClient:
    """An open connection, which `with connect(...)` returns; its methods are those of `Client`.

    It reads in a thread, so that a program that computes for a while is not a slow client.
    """

    def __init__(self, opening: AbstractAsyncContextManager[Client]) -> None:
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="realizer client", daemon=True)
        self._thread.start()
        self._opening = opening
        try:
            self._client = self._do(_enter(opening))
        except BaseException:
            self._end()
            raise

    @property
    def url(self) -> str:
        """The address of the connection."""
        return self._client.url

    @property
    def welcome(self) -> Mapping[str, Any]:
        """The first message of the service."""
        return self._client.welcome

    @property
    def session(self) -> str:
        """The name of the session, which other clients may join."""
        return self._client.session

    @property
    def errors(self) -> list[dict[str, Any]]:
        """Errors about messages that have no answer."""
        return self._client.errors

    def send(self, bml: str) -> None:
        """Send one or more BML documents."""
        self._do(self._client.send(bml))

    def control(self, type: str, **fields: Any) -> None:
        """Send a control message that has no answer."""
        self._do(self._client.control(type, **fields))

    def ask(self, type: str, **fields: Any) -> dict[str, Any]:
        """Send a control message and wait for its answer."""
        return self._do(self._client.ask(type, **fields))

    def subscribe(self, stream: str, **fields: Any) -> dict[str, Any]:
        """Subscribe to a stream and return its description."""
        return self._do(self._client.subscribe(stream, **fields))

    def state(self) -> dict[str, Any]:
        """Return the state of the session: its blocks, and the action units with their sources."""
        return self._do(self._client.state())

    def play(self, bml: str) -> BlockProgress:
        """Send BML, wait for the end of its last block, and return that."""
        return self._do(self._client.play(bml))

    @contextmanager
    def speech(self, id: str, **opening: Any) -> Iterator[SyncSpeech]:
        """Open a speech whose text is streamed: `with client.speech("s") as speech`."""
        manager = self._client.speech(id, **opening)
        speech = SyncSpeech(self._do(_enter(manager)), self._do)
        try:
            yield speech
        except BaseException as error:
            self._do(_exit(manager, error))
            raise
        self._do(_exit(manager, None))

    def voice(self, *, rate: int, language: str | None = None, **opening: Unpack[SpeechOptions]) -> SyncVoice:
        """Return a speech whose sound is sent as it comes, as `Client.voice`."""
        return SyncVoice(self._client.voice(rate=rate, language=language, **opening), self._do)

    def say(
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
        """Play the sound of any other voice, and return its end, as `Client.say`."""
        return self._do(
            self._client.say(sound, rate, text, words, phonemes, visemes, language, viseme_set, **opening)
        )

    def feedback(self) -> Iterator[Feedback]:
        """Yield feedback as it arrives, until the connection ends."""
        return self._each(self._client.feedback())

    def until_end(self, block: str | None = None) -> Iterator[Feedback]:
        """Yield feedback up to the end, or the refusal, of a block: by default of the last one sent."""
        return self._each(self._client.until_end(block))

    def frames(self, stream: str) -> Iterator[Frame]:
        """Yield frames of a stream as they arrive, until the connection ends."""
        return self._each(self._client.frames(stream))

    def faps(self, *, ahead: float = 0.2, **options: Unpack[FrameOptions]) -> Iterator[FapFrame]:
        """Subscribe to FAPs, and yield each frame at its time, as `Client.faps`."""
        return self._each(self._client.faps(ahead=ahead, **options))

    def aus(self, *, ahead: float = 0.2, **options: Unpack[FrameOptions]) -> Iterator[AUFrame]:
        """Subscribe to action units, and yield each frame at its time, as `Client.aus`."""
        return self._each(self._client.aus(ahead=ahead, **options))

    def arkit(self, *, ahead: float = 0.2, **options: Unpack[FrameOptions]) -> Iterator[ArkitFrame]:
        """Subscribe to ARKit's weights and rotations, and yield each frame at its time."""
        return self._each(self._client.arkit(ahead=ahead, **options))

    def mesh(self, **options: Unpack[FrameOptions]) -> Iterator[MeshFrame]:
        """Subscribe to the vertices of the face, and yield frames as they arrive."""
        return self._each(self._client.mesh(**options))

    def pictures(self, **options: Unpack[PictureOptions]) -> Iterator[PictureFrame]:
        """Subscribe to pictures, and yield them as they arrive."""
        return self._each(self._client.pictures(**options))

    def sound(self, **options: Unpack[SoundOptions]) -> Iterator[SoundFrame]:
        """Subscribe to sound, and yield packets as they arrive."""
        return self._each(self._client.sound(**options))

    def film(self, path: str | Path, bml: str, *, fps: float = 25, **look: Any) -> BlockProgress:
        """Play BML and save its last block as a film with sound."""
        return self._do(self._client.film(path, bml, fps=fps, **look))

    def close(self) -> None:
        """Close the connection. Closing again does nothing."""
        if self._loop.is_closed():
            return
        try:
            self._do(_exit(self._opening, None))
            self._do(self._loop.shutdown_asyncgens())
        finally:
            self._end()

    def _each(self, items: AsyncIterator[T]) -> Iterator[T]:
        try:
            while (item := self._do(_next(items))) is not None:
                yield item
        finally:
            if not self._loop.is_closed():
                self._do(_end_iteration(items))

    def _do(self, work: Coroutine[Any, Any, T]) -> T:
        if self._loop.is_closed():
            work.close()
            raise ClientError("the connection has ended: it was closed here")
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    def _end(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()


async def _next(items: AsyncIterator[T]) -> T | None:
    return await anext(items, None)


async def _end_iteration(items: AsyncIterator[T]) -> None:
    if isinstance(items, AsyncGenerator):
        await items.aclose()


async def _enter(manager: AbstractAsyncContextManager[T]) -> T:
    return await manager.__aenter__()


async def _exit(manager: AbstractAsyncContextManager[Any], error: BaseException | None) -> None:
    trace = None if error is None else error.__traceback__
    await manager.__aexit__(None if error is None else type(error), error, trace)
