"""The base of transports that reconnect, on a clock without waiting."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable

import pytest

from realizer.server.transports import reconnecting
from realizer.server.transports.reconnecting import ReconnectingTransport
from tests.waiting import LIMIT


class Scripted(ReconnectingTransport):
    """A transport whose connections succeed or fail in this order; it waits for ever after the last."""

    def __init__(self, *succeeds: bool) -> None:
        super().__init__("peer", "[::1]:7")
        self._succeeds = list(succeeds)
        self.done = asyncio.Event()

    async def _serve(self, connected: Callable[[], None]) -> str:
        if not self._succeeds:
            self.done.set()
            await asyncio.Event().wait()
        if self._succeeds.pop(0):
            connected()
            return "it is gone"
        return "it is not there"


def pauses(monkeypatch: pytest.MonkeyPatch, *succeeds: bool) -> list[float]:
    """Return the pauses after each connection."""
    waited: list[float] = []

    async def sleep(seconds: float) -> None:
        waited.append(seconds)

    async def run() -> None:
        transport = Scripted(*succeeds)
        assert transport._address == ("::1", 7)
        await transport.start()
        async with asyncio.timeout(LIMIT):
            await transport.done.wait()
        await transport.close()

    monkeypatch.setattr(reconnecting.asyncio, "sleep", sleep)
    asyncio.run(run())
    return waited


def test_reconnecting_transport_doubles_its_pause_up_to_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    assert pauses(monkeypatch, *[False] * 8) == [0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 10.0, 10.0]


def test_reconnecting_transport_begins_again_after_a_connection(monkeypatch: pytest.MonkeyPatch) -> None:
    assert pauses(monkeypatch, False, False, True, False) == [0.2, 0.4, 0.2, 0.4]


def test_reconnecting_transport_logs_each_loss_once(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO, reconnecting.__name__):
        pauses(monkeypatch, True, False, False, True, False)
    assert caplog.messages == [
        "peer: connected to [::1]:7",
        "peer: it is gone; looking for it",
        "peer: connected to [::1]:7",
        "peer: it is gone; looking for it",
    ]
