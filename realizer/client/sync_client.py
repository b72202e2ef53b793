"""The synchronous client: an asynchronous one in a thread."""

import asyncio
import functools
import threading
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Coroutine, Iterator, Mapping
from contextlib import AbstractAsyncContextManager
from typing import Any, Concatenate, Generic, ParamSpec, Self, TypeVar, Unpack

from realizer.client.async_client import Client
from realizer.client.errors import ClosedError
from realizer.client.speech import OpenSpeech, Speech
from realizer.client.stream_options import SpeechOptions
from realizer.client.voice import OnWord, Voice

A = TypeVar("A")
P = ParamSpec("P")
T = TypeVar("T")


class LoopThread:
    """An event loop in a thread."""

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="realizer client", daemon=True)
        self._thread.start()

    @property
    def has_ended(self) -> bool:
        """Whether `end` was called."""
        return self._loop.is_closed()

    def do(self, work: Coroutine[Any, Any, T]) -> T:
        """Run a coroutine, and return its result.

        Raises:
            ClosedError: the thread has ended.
        """
        if self.has_ended:
            work.close()
            raise ClosedError
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    def each(self, items: AsyncIterator[T]) -> Iterator[T]:
        """Yield the items of an asynchronous iterator."""
        try:
            while (item := self.do(_next(items))) is not None:
                yield item
        finally:
            if isinstance(items, AsyncGenerator) and not self.has_ended:
                self.do(items.aclose())

    def end(self) -> None:
        """End the loop and the thread."""
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    async def end_iterations(self) -> None:
        """End the iterators that `each` has not ended."""
        await self._loop.shutdown_asyncgens()


class Synchronous(Generic[A]):
    """A synchronous form of an object, whose coroutines run in a thread."""

    def __init__(self, original: A, thread: LoopThread) -> None:
        self._original = original
        self._thread = thread


def waiting(
    method: Callable[Concatenate[A, P], Coroutine[Any, Any, T]],
) -> Callable[Concatenate[Synchronous[A], P], T]:
    """Return a method that waits for the result of the original's."""

    def call(self: Synchronous[A], /, *args: P.args, **kwargs: P.kwargs) -> T:
        work: Coroutine[Any, Any, T] = getattr(self._original, method.__name__)(*args, **kwargs)
        return self._thread.do(work)

    functools.update_wrapper(call, method)
    return call


def iterating(
    method: Callable[Concatenate[A, P], AsyncIterator[T]],
) -> Callable[Concatenate[Synchronous[A], P], Iterator[T]]:
    """Return a method that waits for each item of the original's."""

    def call(self: Synchronous[A], /, *args: P.args, **kwargs: P.kwargs) -> Iterator[T]:
        items: AsyncIterator[T] = getattr(self._original, method.__name__)(*args, **kwargs)
        return self._thread.each(items)

    functools.update_wrapper(call, method)
    return call


S = TypeVar("S", bound=OpenSpeech)


class SyncOpenSpeech(Synchronous[S]):
    """An `OpenSpeech` for programs without an event loop: `with` closes it at its end."""

    close = waiting(OpenSpeech.close)
    stop = waiting(OpenSpeech.stop)
    ended = waiting(OpenSpeech.ended)

    @property
    def id(self) -> str:
        return self._original.id

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._thread.do(self._original.__aexit__(kind))


class SyncSpeech(SyncOpenSpeech[Speech]):
    """A `Speech` for programs without an event loop, which `SyncClient.speech` returns."""

    append = waiting(Speech.append)
    until = waiting(Speech.until)


class SyncVoice(SyncOpenSpeech[Voice]):
    """A `Voice` for programs without an event loop, which `SyncClient.voice` returns."""

    write = waiting(Voice.write)
    words = waiting(Voice.words)


class SyncClient(Synchronous[Client]):
    """An open connection, which `with connect(...)` returns; its methods are those of `Client`.

    It reads in a thread, so that a program that computes for a while is not a slow client.
    """

    def __init__(self, opening: AbstractAsyncContextManager[Client]) -> None:
        thread = LoopThread()
        try:
            super().__init__(thread.do(opening.__aenter__()), thread)
        except BaseException:
            thread.end()
            raise
        self._opening = opening

    send = waiting(Client.send)
    control = waiting(Client.control)
    ask = waiting(Client.ask)
    subscribe = waiting(Client.subscribe)
    state = waiting(Client.state)
    play = waiting(Client.play)
    speak = waiting(Client.speak)
    say = waiting(Client.say)
    film = waiting(Client.film)
    feedback = iterating(Client.feedback)
    until_end = iterating(Client.until_end)
    frames = iterating(Client.frames)
    faps = iterating(Client.faps)
    aus = iterating(Client.aus)
    arkit = iterating(Client.arkit)
    mesh = iterating(Client.mesh)
    pictures = iterating(Client.pictures)
    sound = iterating(Client.sound)

    @property
    def url(self) -> str:
        """The address of the connection."""
        return self._original.url

    @property
    def welcome(self) -> Mapping[str, Any]:
        """The first message of the service."""
        return self._original.welcome

    @property
    def session(self) -> str:
        """The name of the session, which other clients may join."""
        return self._original.session

    @property
    def errors(self) -> list[dict[str, Any]]:
        """Errors that no method raises."""
        return self._original.errors

    def speech(self, id: str, **opening: Any) -> SyncSpeech:
        """Return a speech whose text is streamed: `with client.speech("s") as speech`."""
        return SyncSpeech(self._original.speech(id, **opening), self._thread)

    def voice(
        self,
        *,
        rate: int,
        language: str | None = None,
        on_word: OnWord | None = None,
        **opening: Unpack[SpeechOptions],
    ) -> SyncVoice:
        """Return a speech whose sound is sent as it comes, as `Client.voice`.

        `on_word` is called in the thread of the client.
        """
        original = self._original.voice(rate=rate, language=language, on_word=on_word, **opening)
        return SyncVoice(original, self._thread)

    @property
    def left_out(self) -> Mapping[str, int]:
        """As of `Client`."""
        return self._original.left_out

    def close(self) -> None:
        """Close the connection. Closing again does nothing."""
        if self._thread.has_ended:
            return
        try:
            self._thread.do(self._opening.__aexit__(None, None, None))
            self._thread.do(self._thread.end_iterations())
        finally:
            self._thread.end()


async def _next(items: AsyncIterator[T]) -> T | None:
    return await anext(items, None)
