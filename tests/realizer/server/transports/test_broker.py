"""The connection to a broker: events of stomp.py's threads in the event loop."""

from __future__ import annotations

import asyncio
import sys
import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from realizer.core.errors import RealizerError
from realizer.core.settings import Settings
from realizer.server.serve import Server
from realizer.server.transports import broker
from realizer.server.transports.broker import BrokerConnection
from realizer.server.transports.message_formats import Message
from tests.waiting import LIMIT


def frame(body: str | bytes = b"", **headers: str) -> SimpleNamespace:
    return SimpleNamespace(
        body=body, headers={name.replace("_", "-"): value for name, value in headers.items()}
    )


def in_thread(call: Callable[..., Any], *arguments: Any) -> None:
    """Call a listener as stomp.py does."""
    thread = threading.Thread(target=call, args=arguments, daemon=True)
    thread.start()
    thread.join(LIMIT)


def connected(test: Callable[[BrokerConnection, list[tuple[int, bytes]]], Any]) -> None:
    """Run a test with a connection that is not opened, and the messages that it has taken."""

    async def run() -> None:
        taken: list[tuple[int, bytes]] = []
        connection = BrokerConnection(
            asyncio.get_running_loop(), lambda _, topic, body: taken.append((topic, body)), 1.0
        )
        async with asyncio.timeout(LIMIT):
            await test(connection, taken)

    asyncio.run(run())


def test_broker_connection_settles_and_reads_after_the_receipt() -> None:
    async def test(connection: BrokerConnection, _: object) -> None:
        in_thread(connection.on_connected, frame())
        await connection.settled.wait()
        assert connection.connected
        in_thread(connection.on_receipt, frame(receipt_id="another"))
        await asyncio.sleep(0)
        assert not connection.reading.is_set()
        in_thread(connection.on_receipt, frame(receipt_id="reading"))
        await connection.reading.wait()
        assert not connection.lost.is_set()

    connected(test)


@pytest.mark.parametrize(
    ("message", "body", "fault"),
    [
        ("Access refused", b"", "Access refused"),
        ("", b"Bad CONNECT\n\tat org.apache...", "Bad CONNECT"),
        ("Bad CONNECT", b"  Bad CONNECT\nof nobody", "Bad CONNECT"),
        ("Bad CONNECT", b"no such  vhost", "Bad CONNECT: no such vhost"),
        ("x" * 500, b"", "x" * 200),
    ],
)
def test_broker_connection_keeps_the_first_error_in_one_line(message: str, body: bytes, fault: str) -> None:
    async def test(connection: BrokerConnection, _: object) -> None:
        in_thread(connection.on_error, frame(body, message=message))
        in_thread(connection.on_error, frame(b"", message="a later one"))
        await connection.settled.wait()
        await asyncio.sleep(0)
        assert not connection.connected
        assert connection.fault == fault

    connected(test)


def test_broker_connection_is_lost_after_its_reason_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(broker, "REASON", 0.01)

    async def test(connection: BrokerConnection, _: object) -> None:
        in_thread(connection.on_heartbeat_timeout)
        await connection.lost.wait()
        assert connection.settled.is_set()
        assert connection.reading.is_set()
        assert connection.fault == "it has fallen silent"

    connected(test)


class Ahead(threading.BoundedSemaphore):
    """Says when a message has to wait."""

    def __init__(self, value: int) -> None:
        super().__init__(value)
        self.held_back = threading.Event()

    def acquire(self, blocking: bool = True, timeout: float | None = None) -> bool:
        if not super().acquire(blocking=False):
            self.held_back.set()
            super().acquire()
        return True


def test_broker_connection_takes_one_message_at_a_time() -> None:
    async def test(connection: BrokerConnection, taken: list[tuple[int, bytes]]) -> None:
        connection._ahead = ahead = Ahead(broker.AHEAD)
        in_thread(connection.on_message, frame("Grüße", subscription="1"))
        second = threading.Thread(target=connection.on_message, args=(frame(b"\0", subscription="0"),))
        second.start()
        assert await asyncio.to_thread(ahead.held_back.wait, LIMIT)
        assert taken == [(1, "Grüße".encode())]
        connection.handled()
        second.join(LIMIT)
        await asyncio.sleep(0)
        assert taken[1:] == [(0, b"\0")]

    connected(test)


def test_broker_connection_calls_of_a_lost_connection_are_our_errors() -> None:
    async def test(connection: BrokerConnection, _: object) -> None:
        connection.drop()  # without a socket
        for call in (lambda: connection.send(Message("/topic/t", "x")), connection.disconnect):
            with pytest.raises((RealizerError, AttributeError)):
                call()

    connected(test)


def test_check_installed_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "stomp", None)

    async def run() -> None:
        with pytest.raises(RealizerError, match=r"pip install 'bml-realizer\[stomp\]'"):
            await Server(Settings(port=0, stomp="127.0.0.1:61613", voice="silent")).start()

    asyncio.run(run())
