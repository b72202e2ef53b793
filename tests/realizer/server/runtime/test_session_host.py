"""The session host in an event loop whose clock jumps to the next deadline."""

from __future__ import annotations

import asyncio
import json
import re
import selectors
import weakref
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field

import pytest

from bml_schema.feedback import parse_feedback
from realizer.core.settings import Settings
from realizer.protocol.wire import unpack
from realizer.server.runtime import turns
from realizer.server.runtime.session_host import MOST_WAITING, SessionHost
from realizer.server.runtime.session_registry import JoinError
from realizer.server.session.connections import SLOW
from tests.worst_documents import document

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


@dataclass
class Costly(Client):
    """A client each of whose frames takes the service some time."""

    selector: Selector = field(default_factory=Selector)
    cost: float = 0.0

    def send(self, data: str | bytes) -> None:
        super().send(data)
        self.selector.now += self.cost


@pytest.mark.parametrize(("ahead", "cost"), [(0, 0.01), (0.2, 0.02)])
def test_session_host_shares_the_frames_of_an_overload(ahead: float, cost: float) -> None:
    async def test(host: SessionHost) -> None:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, Loop)
        clients = [Costly(selector=loop.selector) for _ in range(20)]
        for client in clients:
            number = host.join(client)
            subscription = {"type": "subscribe", "stream": "fap", "fps": 25, "ahead": ahead}
            host.receive(number, json.dumps(subscription))
        await asyncio.sleep(2)
        assert "status" not in host.health()
        for client in clients:
            client.cost = cost
        await asyncio.sleep(10)
        assert host.health()["status"] == "degraded"
        assert "realizer_overloaded 1" in host.metrics_text()
        with pytest.raises(JoinError):
            host.check(None)
        counts, begin = [len(client.frames) for client in clients], loop.time()
        await asyncio.sleep(10)
        seconds = loop.time() - begin
        got = [len(client.frames) - count for client, count in zip(clients, counts, strict=True)]
        assert max(got) - min(got) <= 1
        assert sum(got) >= 0.8 * seconds / cost
        times = [unpack(client.frames[-1]).time for client in clients]
        assert min(times) > loop.time() - Selector.now - 1.5 * len(clients) * cost
        for client in clients:
            client.cost = 0.0
        await asyncio.sleep(15)
        assert "status" not in host.health()
        host.check(None)

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


def large(id: str, count: int = 300) -> str:
    """A document of many behaviours."""
    heads = "".join(f'<head id="h{i}" lexeme="NOD" start="{i}"/>' for i in range(count))
    return f'<bml id="{id}">{heads}</bml>'


def predicted(client: Client) -> list[str]:
    """The blocks whose predictions a client has got, in order."""
    texts = (text for text in client.texts if text.startswith("<predictionFeedback") and "<head" in text)
    return [parse_feedback(text).blocks[0].id for text in texts]


@pytest.fixture
def in_tiny_slices(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each call is paused wherever it counts its work."""
    monkeypatch.setattr(turns, "SLICE", 0.0)


def test_session_host_answers_others_while_it_plans(in_tiny_slices) -> None:
    async def test(host: SessionHost) -> None:
        (busy, planning), (number, other) = subscribed(host), subscribed(host)
        host.receive(busy, large("a"))
        for n in range(20):
            host.receive(number, f'{{"type": "ping", "id": "{n}"}}')
            await asyncio.sleep(0)
        assert sum("pong" in text for text in other.texts) >= 5  # they are paused too
        assert predicted(planning) == []
        await asyncio.sleep(60)
        assert predicted(planning) == ["a"]

    hosted(test)


def test_session_host_keeps_the_order_of_messages_while_it_plans(in_tiny_slices) -> None:
    async def test(host: SessionHost) -> None:
        number, client = subscribed(host)
        for id in "abc":
            host.receive(number, large(id, 50))
        host.receive(number, '{"type": "ping"}')
        host.receive(number, large("d", 5))
        await asyncio.sleep(60)
        assert predicted(client) == ["a", "b", "c", "d"]

    hosted(test)


@pytest.mark.parametrize("named", [True, False])
def test_session_host_lets_a_client_leave_while_it_plans(in_tiny_slices, named: bool) -> None:
    async def test(host: SessionHost) -> None:
        number, client = subscribed(host, "s" if named else None)
        host.receive(number, large("a"))
        await asyncio.sleep(0)
        host.leave(number)
        assert host.health()["sessions"] == named
        await asyncio.sleep(30)
        assert predicted(client) == []
        _, again = subscribed(host, "s")
        host.receive(number + 1, large("b", 5))
        await asyncio.sleep(30)
        assert predicted(again) == ["b"]
        if named:
            assert client.ends == []

    hosted(test)


def test_session_host_welcomes_a_client_after_it_has_planned(in_tiny_slices) -> None:
    async def test(host: SessionHost) -> None:
        number, client = subscribed(host, "s")
        host.receive(number, large("a"))
        _, other = subscribed(host, "s")
        assert not other.frames
        await asyncio.sleep(60)
        assert other.frames
        assert predicted(client) == ["a"]

    hosted(test)


def test_session_host_moves_a_client_whose_messages_wait(in_tiny_slices) -> None:
    async def test(host: SessionHost) -> None:
        number, client = subscribed(host, "here")
        host.receive(number, large("a"))
        host.receive(number, '{"type": "hello", "version": 1, "session": "there"}')
        host.receive(number, large("b", 5))
        await asyncio.sleep(60)
        assert predicted(client) == ["b"]
        assert any('"session":"there"' in text.replace(" ", "") for text in client.texts)

    hosted(test)


def test_session_host_is_congested_while_many_messages_wait(in_tiny_slices) -> None:
    async def test(host: SessionHost) -> None:
        number, client = subscribed(host)
        other, _ = subscribed(host)
        host.receive(number, large("a"))
        congested = []
        for n in range(MOST_WAITING + 5):
            host.receive(number, f'{{"type": "ping", "id": "{n}"}}')
            congested.append(host.is_congested(number))
        assert congested == sorted(congested)
        assert (congested[0], congested[-1], host.is_congested(other)) == (False, True, False)
        await host.wait_for_room(other)
        assert host.is_congested(number)
        await host.wait_for_room(number)
        assert not host.is_congested(number)
        await asyncio.sleep(60)
        assert sum("pong" in text for text in client.texts) == MOST_WAITING + 5

    hosted(test)


def test_session_host_plans_in_slices_as_at_once(monkeypatch) -> None:
    results: list[list[str]] = []

    async def test(host: SessionHost) -> None:
        number, client = subscribed(host)
        for pattern in ("linked", "impossible", "squeezed", "overlapping"):
            host.receive(number, document(pattern, 60).replace('id="worst"', f'id="{pattern}"'))
        await asyncio.sleep(300)
        results.append([re.sub(r'(globalTime|global|posix)\w*="[^"]*"', "", text) for text in client.texts])

    for seconds in (0.0, 1e9):
        monkeypatch.setattr(turns, "SLICE", seconds)
        hosted(test)
    assert results[0] == results[1]
    assert len(results[0]) > 20


def test_session_host_closes_while_it_plans(in_tiny_slices) -> None:
    async def test(host: SessionHost) -> None:
        number, _ = subscribed(host)
        host.receive(number, large("a"))
        await asyncio.sleep(0)
        assert host.busy

    hosted(test)


def moved_to(session: str) -> str:
    """A message that moves its client into a session."""
    return f'{{"type": "hello", "version": 1, "session": "{session}"}}'


def test_session_host_moves_no_client_that_has_left_meanwhile(in_tiny_slices) -> None:
    async def test(host: SessionHost) -> None:
        number, _ = subscribed(host, "here")
        host.receive(number, large("a", 20))
        host.receive(number, moved_to("there"))
        host.leave(number)
        await asyncio.sleep(30)
        assert host.health() == {"sessions": 1, "connections": 0}
        await asyncio.sleep(host.settings.keep + 60)
        assert host.health()["sessions"] == 0

    hosted(test)


def test_session_host_joins_a_client_while_the_last_one_leaves(in_tiny_slices) -> None:
    async def test(host: SessionHost) -> None:
        number, _ = subscribed(host)
        await asyncio.sleep(1)
        (session,) = host._registry.sessions
        host.receive(number, large("a", 20))
        _, other = subscribed(host, session)
        host.leave(number)
        await asyncio.sleep(30)
        assert len(other.frames) > 10
        assert host.health() == {"sessions": 1, "connections": 1}

    hosted(test)


def test_session_host_joins_a_client_to_a_session_that_expires(in_tiny_slices) -> None:
    async def test(host: SessionHost) -> None:
        number, _ = subscribed(host, "s")
        host.receive(number, large("a", 20))
        host.receive(number, large("b", 200))
        host.leave(number)
        session = host._registry.sessions["s"]
        while session.connections:
            await asyncio.sleep(0)
        assert host.busy
        for _ in range(20):
            await asyncio.sleep(0)
        _, other = subscribed(host, "s")
        assert not session.connections
        host._registry.remove_expired(asyncio.get_running_loop().time() + host.settings.keep)
        await asyncio.sleep(30)
        assert len(other.frames) > 10 or other.ends

    hosted(test)


def test_session_host_keeps_the_order_of_messages_while_a_client_moves(in_tiny_slices) -> None:
    async def test(host: SessionHost) -> None:
        number, client = subscribed(host, "here")
        other, _ = subscribed(host, "here")
        await asyncio.sleep(1)
        host.receive(other, large("x", 20))
        host.receive(number, moved_to("there"))
        host.receive(other, large("y", 50))
        host.receive(number, large("a", 3))
        while host._registry.session_of[number].id == "here":
            await asyncio.sleep(0)
        host.receive(number, large("b", 3))
        await asyncio.sleep(60)
        assert predicted(client) == ["a", "b"]

    hosted(test)


@pytest.mark.parametrize("joins_late", [True, False])
def test_session_host_closes_clients_of_a_taken_session(in_tiny_slices, tmp_path, joins_late: bool) -> None:
    settings = Settings(voice="silent", journal=str(tmp_path / "journal"))

    async def run() -> None:
        first, second = SessionHost(settings), SessionHost(settings)
        for host in (first, second):
            await host.start()
        number, client = subscribed(first, "s")
        await asyncio.sleep(1)
        first.receive(number, large("a", 20))
        late = subscribed(first, "s")[1] if joins_late else client
        await second.restore("s")
        await asyncio.sleep(60)
        assert (client.ends, late.ends) == ([1012], [1012])
        for host in (first, second):
            await host.close()

    with asyncio.Runner(loop_factory=Loop) as runner:
        runner.run(run())


@pytest.mark.usefixtures("no_automatic_gc")
def test_session_host_frees_the_blocks_of_a_session_that_ends() -> None:
    async def test(host: SessionHost) -> None:
        number, client = subscribed(host, "s")
        host.receive(number, large("a", 20))
        await asyncio.sleep(1)
        assert predicted(client) == ["a"]
        (playing,) = map(weakref.ref, host._registry.sessions["s"].player.blocks.all())
        host.end("s")
        await asyncio.sleep(1)
        assert playing() is None

    hosted(test)
