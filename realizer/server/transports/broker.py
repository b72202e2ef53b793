"""A connection to a message broker over stomp.py, between its threads and the event loop."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import threading
from collections.abc import Callable, Sequence
from typing import Any

from realizer.core.errors import RealizerError
from realizer.server.transports.message_formats import Message

HEARTBEAT = 10_000  # ms, both ways: the only sign that the broker's host has died
REASON = 0.1  # s from the loss of a connection until it is reported, for its reason to arrive first
# Received messages that may wait to be handled; the broker holds back the others.
AHEAD = 1


def check_installed() -> None:
    """Raise RealizerError if stomp.py is not installed."""
    try:
        import stomp  # noqa: F401
    except ImportError:
        raise RealizerError("--stomp needs stomp.py: pip install 'bml-realizer[stomp]'") from None
    # It logs a traceback for each lost connection, which we log in one line.
    logging.getLogger("stomp.py").setLevel(logging.CRITICAL)


class BrokerConnection:
    """One connection, from `connect` to `lost`. Methods that block are called in a thread of the caller.

    Args:
        take: (self, topic, body), called for each message; `topic` is the index in `subscribe`.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        take: Callable[[BrokerConnection, int, bytes], None],
        timeout: float,
    ) -> None:
        self.settled = asyncio.Event()  # connected or failed
        self.reading = asyncio.Event()  # subscribed to all topics, or lost
        self.lost = asyncio.Event()
        self.connected = False
        self.fault = ""
        self._loop = loop
        self._take = take
        self._timeout = timeout
        self._ahead = threading.BoundedSemaphore(AHEAD)
        self._stomp: Any = None
        self._dropped = False

    # in the transport's thread

    def connect(
        self, address: tuple[str, int], host: str | None, login: str | None, password: str | None
    ) -> None:
        """Open the connection; `settled` is set when it has succeeded or failed."""
        import stomp
        from stomp.exception import StompException

        self._stomp = stomp.Connection12(
            [address],
            try_loopback_connect=False,  # only that address
            reconnect_attempts_max=1,
            reconnect_sleep_initial=0,  # the transport waits itself
            reconnect_sleep_max=0,
            timeout=self._timeout,
            heartbeats=(HEARTBEAT, HEARTBEAT),
            heart_beat_receive_scale=2.5,
            vhost=host,
            auto_decode=False,
            # ActiveMQ turns messages with a length into byte messages, which Java clients for text ignore.
            auto_content_length=False,
        )
        self._stomp.set_listener("transport", self)
        try:
            self._stomp.connect(login, password)
        except StompException as error:
            raise RealizerError(str(error) or "nobody answers") from None
        # With Nagle's algorithm a block takes 50 ms instead of 7.
        with contextlib.suppress(OSError, AttributeError):
            self._stomp.transport.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if self._dropped:  # before there was a socket to close
            self.drop()

    def subscribe(self, topics: Sequence[str]) -> None:
        """Subscribe to all topics; `reading` is set when that is done."""
        for number, topic in enumerate(topics):
            # The broker handles subscriptions in order: the receipt of the last one is enough.
            receipt = {"receipt": "reading"} if number == len(topics) - 1 else {}
            self._guarded(self._stomp.subscribe, topic, id=str(number), headers=receipt)

    def send(self, message: Message) -> None:
        """Send a message. Blocks while the broker does not read.

        Raises:
            OSError, RealizerError: the connection is lost.
        """
        self._guarded(self._stomp.send, message.topic, message.body, headers=dict(message.headers))

    def disconnect(self) -> None:
        """Begin to disconnect; `lost` is set when the broker has closed."""
        self._guarded(self._stomp.disconnect)

    @staticmethod
    def _guarded(call: Callable[..., Any], *arguments: Any, **named: Any) -> None:
        from stomp.exception import StompException

        try:
            call(*arguments, **named)
        except (StompException, AttributeError) as error:  # its socket may become None meanwhile
            raise RealizerError(str(error) or "the connection is lost") from None

    # in any thread

    def drop(self) -> None:
        """Close the socket if it is open, or as soon as it is."""
        self._dropped = True
        if self._stomp is not None:
            with contextlib.suppress(OSError, AttributeError):
                self._stomp.transport.disconnect_socket()

    # in stomp.py's thread

    def on_connected(self, frame: Any) -> None:
        self._in_loop(self._settle, True, "")

    def on_receipt(self, frame: Any) -> None:
        if frame.headers.get("receipt-id") == "reading":
            self._in_loop(self.reading.set)

    def on_error(self, frame: Any) -> None:
        title = frame.headers.get("message", "")
        detail, *_ = bytes(frame.body or b"").decode("utf-8", "replace").strip().splitlines() or [""]
        if title not in detail:  # some brokers repeat the title at the head of a long trace
            title = f"{title}: {detail}".removesuffix(": ")
        self._in_loop(self._settle, False, " ".join((title or detail).split())[:200])

    def on_disconnected(self) -> None:
        self._in_loop(self._settle, False, "")
        # If the broker is silent, the reading thread may report its loss before the heartbeat thread does.
        self._in_loop(self._loop.call_later, REASON, self.lost.set)
        self._in_loop(self.reading.set)

    def on_heartbeat_timeout(self) -> None:
        self._in_loop(self._settle, False, "it has fallen silent")
        self.on_disconnected()

    def on_message(self, frame: Any) -> None:
        self._ahead.acquire()
        body = frame.body.encode() if isinstance(frame.body, str) else bytes(frame.body or b"")
        self._in_loop(self._take, self, int(frame.headers.get("subscription", 0)), body)

    def _in_loop(self, function: Callable[..., object], *arguments: Any) -> None:
        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(function, *arguments)

    # in the event loop

    def handled(self) -> None:
        """Allow the next message to be read."""
        self._ahead.release()

    def _settle(self, connected: bool, fault: str) -> None:
        self.connected |= connected
        self.fault = self.fault or fault
        self.settled.set()
