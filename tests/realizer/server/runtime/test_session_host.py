"""The session host in an event loop whose clock jumps to the next deadline."""

from __future__ import annotations

import asyncio
import selectors
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field

import pytest

from realizer.core.settings import Settings
from realizer.server.runtime.session_host import SessionHost
from realizer.server.streams.connection import SLOW

PERIOD = 1 / 25  # s
PHASES = [k / 8 * PERIOD for k in range(8)]  # where between two frames something happens


class Selector(selectors.DefaultSelector):
    """Return at once, and advance the clock by the timeout."""

    now = 1000.0

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        if timeout is None:  # nothing is due: a thread works
            return super().select()
        self.now += max(timeout, 0.0)
        return super().select(0)


class Loop(asyncio.SelectorEventLoop):
    """An event loop in which waiting takes no time."""

    def __init__(self) -> None:
        self.selector = Selector()
        super().__init__(self.selector)

    def time(self) -> float:
        return self.selector.now


@dataclass
class Client:
    """A client with the data it received."""

    unsent_bytes: int = 0
    frames: list[bytes] = field(default_factory=list)
    texts: list[str] = field(default_factory=list)
    ends: list[int] = field(default_factory=list)

    def send(self, data: str | bytes) -> None:
        if isinstance(data, bytes):
            self.frames.append(data)
        else:
            self.texts.append(data)

    def disconnect(self, code: int, reason: str) -> None:
        self.ends.append(code)


def hosted(test: Callable[[SessionHost], Awaitable[None]]) -> None:
    """Run a test against a host of sessions."""

    async def run() -> None:
        host = SessionHost(Settings(voice="silent"))
        await host.start()
        try:
            await test(host)
        finally:
            await host.close()

    with asyncio.Runner(loop_factory=Loop) as runner:
        runner.run(run())


def subscribed(host: SessionHost, session: str | None = None) -> tuple[int, Client]:
    """A client that gets 25 frames a second."""
    client = Client()
    number = host.join(client, session)
    host.receive(number, '{"type": "subscribe", "stream": "fap", "fps": 25}')
    return number, client


@pytest.mark.parametrize("alone", [True, False])
@pytest.mark.parametrize("phase", PHASES)
def test_session_host_sends_frames_again_to_a_client_that_has_read(phase: float, alone: bool) -> None:
    async def test(host: SessionHost) -> None:
        _, client = subscribed(host, "s")
        if not alone:
            subscribed(host, "s")
        await asyncio.sleep(0.5)
        client.unsent_bytes = SLOW + 1
        await asyncio.sleep(1 + phase)
        before = len(client.frames)
        await asyncio.sleep(1)
        assert len(client.frames) == before
        client.unsent_bytes = 0
        await asyncio.sleep(2)
        assert len(client.frames) - before >= 49

    hosted(test)


def test_session_host_sends_frames_at_their_times() -> None:
    async def test(host: SessionHost) -> None:
        _, client = subscribed(host)
        await asyncio.sleep(4 + PERIOD / 2)
        assert len(client.frames) == 101

    hosted(test)


def test_session_host_wakes_a_session_that_gets_messages_all_the_time() -> None:
    async def test(host: SessionHost) -> None:
        number, client = subscribed(host)
        for _ in range(1000):
            host.receive(number, '{"type": "ping"}')
            await asyncio.sleep(0.001)
        assert len(client.frames) >= 25

    hosted(test)


def test_session_host_wakes_no_session_after_close() -> None:
    async def test(host: SessionHost) -> None:
        _, client = subscribed(host)
        await host.close()
        before = len(client.frames)
        await asyncio.sleep(1)
        assert len(client.frames) == before

    hosted(test)
