"""Tests of the restoring of sessions that other processes had."""

from __future__ import annotations

import asyncio

from realizer.core.settings import Settings
from realizer.server.runtime.session_host import SessionHost
from tests.realizer.server.runtime.test_session_host import Loop, subscribed


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
