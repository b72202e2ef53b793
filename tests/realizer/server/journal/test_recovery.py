"""Tests of `realizer.server.journal.recovery`: a fault costs its message, never the session."""

from __future__ import annotations

import asyncio
import itertools
import json
import re
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any, cast

import pytest

from realizer.core.settings import Settings
from realizer.playback.player import Player
from realizer.protocol.wire import unpack
from realizer.server.documents.document_queue import Submission
from realizer.server.journal.session_journal import SessionJournal
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_loop import SessionLoop
from realizer.server.session.connections import Connections
from realizer.server.session.control_handlers import ControlHandlers
from realizer.server.session.session import Session
from realizer.server.session.ticker import Ticker
from realizer.server.streams.broadcast import Broadcast
from realizer.server.streams.frame_windows import FrameTimeline
from tests.realizer.server.runtime.test_session_host import Client, Loop

HELLO = '<bml id="{}" composition="APPEND"><speech id="s"><text>Hello there.</text></speech></bml>'
NOD = '<bml id="{}"><head id="n" lexeme="NOD" start="0.2"/></bml>'
FAPS = '{"type": "subscribe", "stream": "fap", "ahead": 0.2}'
STEPS = [
    (Session, "receive"),
    (Session, "on_speech"),
    (Session, "tick"),
    (Ticker, "tick"),
    (Ticker, "publish"),
    (Ticker, "send_ready"),
    (Submission, "enqueue"),
    (Submission, "work"),
    (Player, "due"),
    (Player, "submit"),
    (Connections, "send_feedback"),
    (Broadcast, "frames_due"),
    (Broadcast, "send_due"),
    (FrameTimeline, "window"),
    (SessionJournal, "note"),
    (ControlHandlers, "handle"),
]


class AtOnce:
    """A pool whose functions have ended when `submit` returns: no clock runs meanwhile."""

    def submit(self, owner: object, function: Callable[[], Any]) -> Future[Any]:
        done: Future[Any] = Future()
        done.set_result(function())
        return done

    def drop(self, owner: object) -> None:
        """Nothing waits."""

    def close(self) -> None:
        """Nothing is open."""


@pytest.fixture(autouse=True)
def _no_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SessionLoop, "speak", lambda self, order: self.engines.speak(order))


def played(journal: Path | None = None, script: Callable[[SessionHost], Any] | None = None) -> list[Client]:
    """Play three documents in one session, with two clients, and one in another; return the clients."""

    async def run() -> list[Client]:
        host = SessionHost(Settings(voice="silent", journal=None if journal is None else str(journal)))
        await host.start()
        pool: Any = AtOnce()
        host._loop.engines.speech_pool = pool
        clients = [Client(), Client(), Client()]
        try:
            numbers = [host.join(client, name) for client, name in zip(clients, "ssn", strict=True)]
            host.receive(numbers[0], FAPS)
            for at, number, message in (
                (0.0, 0, HELLO.format("a")),
                (0.0, 2, HELLO.format("z")),
                (0.3, 0, NOD.format("b")),
                (0.6, 1, HELLO.format("c")),
                (0.9, 1, '{"type": "set", "aus": {"12L": 0.5}}'),
                (6.0, 0, '{"type": "ping", "id": 1}'),
            ):
                while asyncio.get_running_loop().time() < 1000.0 + at:
                    await asyncio.sleep(0.05)
                assert host.receive(numbers[number], message)
            if script is not None:
                await script(host)
            await asyncio.sleep(4)
        finally:
            await host.close()
        return clients

    with asyncio.Runner(loop_factory=Loop) as runner:
        return runner.run(run())


def numbers(client: Client) -> list[int]:
    found = (re.search(r'\bseq="(\d+)"|:seq="(\d+)"', text) for text in client.texts)
    return [int(match[1] or match[2]) for match in found if match]


def has(client: Client, *parts: str) -> bool:
    return any(all(part in text for part in parts) for text in client.texts)


def ended(client: Client) -> set[str]:
    return {
        match[1]
        for text in client.texts
        if "blockProgress" in text and (match := re.search(r' id="(\w+):end"', text)) and "INTERR" not in text
    }


@pytest.mark.parametrize(("where", "name"), STEPS, ids=[f"{where.__name__}.{name}" for where, name in STEPS])
@pytest.mark.parametrize("call", [1, 2, 7])
@pytest.mark.parametrize("with_journal", [False, True])
def test_fault_in_any_step_loses_no_acknowledged_block(
    where: type,
    name: str,
    call: int,
    with_journal: bool,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    tmp_path: Path,
) -> None:
    calm = played()[2]
    calls, real = itertools.count(1), getattr(where, name)

    def fails_once(self: Any, *arguments: Any, **options: Any) -> Any:
        if next(calls) == call:
            raise ZeroDivisionError("chaos")
        return real(self, *arguments, **options)

    monkeypatch.setattr(where, name, fails_once)
    first, second, neighbour = played(tmp_path / "journal.sqlite" if with_journal else None)
    assert not first.ends + second.ends + neighbour.ends
    acknowledged = {i for i in "abc" if has(first, "predictionFeedback", f'id="{i}"')}
    # What fails while a block is planned refuses it by a warning, as ever; nothing else is lost.
    refused = {i for i in "abc" if has(first, "warningFeedback", f'id="{i}"', "internal error")}
    assert ended(first) == ended(second) == acknowledged - refused
    for client in (first, second):
        assert numbers(client) == list(range(1, len(numbers(client)) + 1))
    assert has(first, "pong") or has(first, "internal")
    if "session n" not in caplog.text:
        assert len(neighbour.texts) == len(calm.texts)
    else:
        assert acknowledged == set("abc")


def scripted(script: Callable[[SessionHost, int, Client], Any], **settings: Any) -> Client:
    """Run a script with one client of a session; return the client."""

    async def run() -> Client:
        host, client, pool = SessionHost(Settings(voice="silent", **settings)), Client(), AtOnce()
        await host.start()
        host._loop.engines.speech_pool = cast(Any, pool)
        try:
            await script(host, host.join(client, "s"), client)
            await asyncio.sleep(5)
        finally:
            await host.close()
        return client

    with asyncio.Runner(loop_factory=Loop) as runner:
        return runner.run(run())


@pytest.mark.parametrize("with_journal", [False, True])
def test_document_at_which_every_replay_fails_is_left_out(
    with_journal: bool, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    real = Submission.work

    def work(self: Submission, t: float) -> bool:
        if any("poison" in pending.block.id for pending in self.pending.blocks):
            raise ZeroDivisionError("chaos")
        return real(self, t)

    monkeypatch.setattr(Submission, "work", work)

    async def script(host: SessionHost, number: int, client: Client) -> None:
        for id in ("before", "poison", "after"):
            host.receive(number, HELLO.format(id))
            await asyncio.sleep(0.2)

    journal = str(tmp_path / "journal.sqlite") if with_journal else None
    client = scripted(script, journal=journal)
    assert not client.ends
    assert ended(client) == {"before", "after"}
    assert has(client, "warningFeedback", 'id="poison"', "internal error")
    assert numbers(client) == list(range(1, len(numbers(client)) + 1))


def test_control_message_that_fails_costs_its_sender_an_error_and_nothing_else(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(*arguments: Any) -> None:
        raise RecursionError("chaos")

    monkeypatch.setattr(ControlHandlers, "_stop", fail)

    async def script(host: SessionHost, number: int, client: Client) -> None:
        host.receive(number, HELLO.format("a"))
        await asyncio.sleep(0.1)
        host.receive(number, '{"type": "stop"}')
        host.receive(number, '{"type": "ping", "id": 3}')

    client = scripted(script)
    (error,) = [json.loads(text) for text in client.texts if "internal error" in text]
    assert error["code"] == "internal"
    assert error["message"].partition(":")[0] in caplog.text
    assert has(client, "pong")
    assert ended(client) == {"a"}


def test_session_that_fails_again_and_again_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*arguments: Any) -> None:
        raise ZeroDivisionError("chaos")

    monkeypatch.setattr(ControlHandlers, "_stop", fail)

    async def script(host: SessionHost, number: int, client: Client) -> None:
        for _ in range(20):
            host.receive(number, '{"type": "stop"}')

    assert scripted(script).ends == [1011]


def test_subscription_goes_on_where_it_was_after_a_recovery(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*arguments: Any) -> None:
        raise ZeroDivisionError("chaos")

    monkeypatch.setattr(ControlHandlers, "_stop", fail)

    async def script(host: SessionHost, number: int, client: Client) -> None:
        host.receive(number, '{"type": "subscribe", "stream": "fap"}')
        host.receive(number, HELLO.format("a"))
        await asyncio.sleep(0.5)
        host.receive(number, '{"type": "stop"}')

    frames = [unpack(data).frame for data in scripted(script).frames]
    assert frames == list(range(frames[0], frames[0] + len(frames)))
    assert len(frames) > 100
