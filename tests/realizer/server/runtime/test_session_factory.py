"""The factory of sessions: restored, not restorable, and without their recording."""

from __future__ import annotations

import asyncio
import errno
import json
from pathlib import Path

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from realizer.core.errors import FaceError
from realizer.core.settings import Settings
from realizer.server.http.metrics import Metrics
from realizer.server.journal import Journal, JournalError, TakenOver, journal_at
from realizer.server.runtime import session_factory
from realizer.server.runtime.session_factory import SessionFactory
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError
from realizer.server.serve import Server
from realizer.server.session.session import Session
from tests.feedback_log import read_feedback
from tests.realizer.server.runtime.test_session_host import Loop, subscribed
from tests.waiting import LIMIT

NEXT = '<bml id="b" composition="APPEND"><head id="n" lexeme="SHAKE" end="0.8"/></bml>'


async def drained(client: ClientConnection) -> None:
    """Read until the connection ends."""
    while True:
        await client.recv()


def test_factory_load_refuses_an_unknown_face_and_a_bad_scene(tmp_path: Path) -> None:
    scene = tmp_path / "scene.json"
    scene.write_text("[]")
    for settings, error in ((Settings(face="nobody"), FaceError), (Settings(scene=scene), ValueError)):
        with pytest.raises(error):
            asyncio.run(SessionFactory(settings, Metrics()).load())


def test_factory_keeps_named_sessions_only_in_its_journal(kept: Settings) -> None:
    async def run() -> None:
        factory = SessionFactory(kept, Metrics())
        await factory.load()
        assert factory.journal is not None
        for name, named in (("named", True), ("unnamed", False)):
            session = factory.new(name, 0.0, named)
            assert session.id == name
        assert factory.journal.claim("named") is not None
        assert factory.journal.claim("unnamed") is None
        factory.close()
        with pytest.raises(JoinError, match="the journal"):
            factory.new("late", 0.0, True)

    asyncio.run(run())


def test_factory_restores_nothing_without_an_entry_in_the_journal(kept: Settings) -> None:
    def speak(order: object) -> JournalError:
        raise AssertionError

    async def run() -> None:
        for settings in (kept, Settings()):
            factory = SessionFactory(settings, Metrics())
            await factory.load()
            assert await factory.restore("nobody", 0, speak) is None
            factory.close()

    asyncio.run(run())


def test_factory_that_cannot_restore_leaves_the_journal_unchanged(
    monkeypatch: pytest.MonkeyPatch, kept: Settings
) -> None:
    async def run() -> None:
        async with asyncio.timeout(LIMIT):
            async with Server(kept) as server, connect(f"{server.url}?session=s") as client:
                await client.send(NEXT)
                feedback = await read_feedback(client, "b:end")
            async with Server(kept) as server:
                with monkeypatch.context() as here:
                    here.setattr(Session, "receive", None)
                    async with connect(f"{server.url}?session=s&seen=0") as client:
                        with pytest.raises(ConnectionClosed) as closed:
                            await drained(client)
                    assert closed.value.rcvd is not None
                    assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (
                        1013,
                        "session s cannot be resumed: internal error",
                    )
                async with connect(f"{server.url}?session=s&seen=0") as client:
                    assert await read_feedback(client, "b:end") == feedback

    asyncio.run(run())


def test_factory_restores_a_session_whose_recording_failed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def full(file: object, line: str) -> None:
        if NEXT in json.loads(line).get("body", ""):
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("realizer.server.journal.recordings._write", full)

    async def run() -> None:
        settings = Settings(
            port=0, voice="silent", journal=str(tmp_path / "journal.db"), record=tmp_path / "records"
        )
        async with asyncio.timeout(LIMIT):
            async with Server(settings) as server, connect(f"{server.url}?session=s") as client:
                await client.send(NEXT)
                feedback = await read_feedback(client, "b:end")
                assert "realizer_records_stopped_total 1" in server._sessions.metrics_text()
            async with Server(settings) as server, connect(f"{server.url}?session=s&seen=0") as client:
                assert await read_feedback(client, "b:end") == feedback

    asyncio.run(run())


def opened(name: str, *, named: bool = True) -> Session:
    return Session(name, Settings(), 0.0, named=named)


async def taken_over(journal: Journal, sessions: list[Session]) -> list[Session]:
    factory = SessionFactory(Settings(), Metrics())
    factory.journal = journal
    return await factory.taken_over(sessions)


def test_factory_taken_over_finds_lost_sessions_among_many(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_factory, "BATCH", 2)
    here, there = (journal_at(str(tmp_path / "journal.db")) for _ in range(2))
    sessions = [opened(f"s{number}") for number in range(5)]
    for session in sessions:
        here.begin(session.id, 0.0)
    own = opened("own", named=False)
    here.begin("own", 0.0)
    for name in ("s1", "s3", "s4", "own"):
        there.claim(name)
    sessions[3].hand_over(TakenOver("known already"))
    found = asyncio.run(taken_over(here, [*sessions, own]))
    assert found == [sessions[1], sessions[4]]
    assert asyncio.run(taken_over(there, sessions)) == [sessions[0], sessions[2]]
    here.close()
    there.close()


def test_factory_taken_over_finds_none_if_the_journal_cannot_be_read(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = journal_at(str(tmp_path / "journal.db"))

    def broken(sessions: object) -> set[str]:
        raise JournalError("it does not answer")

    monkeypatch.setattr(journal, "taken_over", broken)
    assert asyncio.run(taken_over(journal, [opened("s")])) == []
    assert "it does not answer" in caplog.text
    journal.close()


def test_restore_advances_a_resumed_session_to_what_a_client_has_seen(tmp_path) -> None:
    settings = Settings(voice="silent", journal=str(tmp_path / "journal"), keep=60)

    async def run() -> None:
        first, second = SessionHost(settings), SessionHost(settings)
        for host in (first, second):
            await host.start()
        number, _ = subscribed(first, "s")
        first.receive(number, '<bml id="b"><wait id="w" duration="300"/></bml>')
        await asyncio.sleep(1)
        await second.restore("s")
        log = second._registry.sessions["s"].feedback_log
        before = log.newest
        await asyncio.sleep(30)
        assert log.newest == before
        await second.restore("s", seen=before + 1)
        assert log.newest > before
        for host in (first, second):
            await host.close()

    with asyncio.Runner(loop_factory=Loop) as runner:
        runner.run(run())


def test_restore_finds_nothing_without_a_journal() -> None:
    async def run() -> None:
        host = SessionHost(Settings(voice="silent"))
        await host.start()
        await host.restore("s", 3)
        await host.restore(None)
        assert host.health()["sessions"] == 0
        await host.close()

    with asyncio.Runner(loop_factory=Loop) as runner:
        runner.run(run())
