"""Tests of the effects of sessions: what is sent, and how answers come back."""

from __future__ import annotations

import asyncio
from concurrent.futures import Future
from types import SimpleNamespace
from typing import Any, cast

from realizer.core.settings import Settings
from realizer.server.runtime.engines import Engines
from realizer.server.runtime.session_loop import SessionLoop
from realizer.server.session.effects import Close, Send, Speak
from realizer.server.session.session import Session
from realizer.server.transports.transport import Outbound
from realizer.speech.utterance import SpeechRequest
from tests.realizer.server.conftest import spoken


class Client:
    """A client that keeps what it is sent."""

    unsent_bytes = 0

    def __init__(self) -> None:
        self.got: list[Any] = []

    def send(self, data: str | bytes) -> None:
        self.got.append(data)

    def disconnect(self, code: int, reason: str) -> None:
        self.got.append((code, reason))


class Pool:
    """A pool whose functions end when a test says so."""

    def __init__(self) -> None:
        self.futures: list[Future[Any]] = []

    def submit(self, owner: object, function: object) -> Future[Any]:
        self.futures.append(Future())
        return self.futures[-1]


async def delivered(*effects: Any) -> tuple[Client, Pool, list[Any]]:
    """Run effects of a session with one client; return it, the pool of voices, and where answers go."""
    client, pool, deliveries = Client(), Pool(), list[Any]()
    engines = cast(Engines, SimpleNamespace(speech_pool=pool, speak=lambda effect: spoken()))
    none: Any = None
    loop: Any = SessionLoop(engines, {1: cast(Outbound, client)}, none, none, none, none)
    loop.start()
    loop._deliver = lambda session, answer: deliveries.append(answer)
    session = Session("s", Settings(), 0.0)
    loop.run(session, effects)
    for future in pool.futures[:1]:
        future.set_result(spoken())
    for future in pool.futures[1:]:
        future.cancel()
    for _ in range(5):
        await asyncio.sleep(0)
    return client, pool, deliveries


def test_run_sends_and_closes_in_order_and_skips_clients_that_have_left() -> None:
    effects = (Send(1, "a"), Send(2, "gone"), Send(1, b"b"), Close(2, 1000, "gone"), Close(1, 1011, "end"))
    client, _, deliveries = asyncio.run(delivered(*effects))
    assert client.got == ["a", b"b", (1011, "end")]
    assert deliveries == []


def test_run_delivers_the_answer_of_a_voice_unless_it_is_cancelled() -> None:
    request = SpeechRequest("Hello")
    _, pool, deliveries = asyncio.run(delivered(Speak(1, request), Speak(2, request)))
    assert len(pool.futures) == 2
    (answer,) = deliveries
    answer()  # the session takes it; it has not asked for it
