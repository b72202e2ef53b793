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
from realizer.server.transports.message_format import Message

HEARTBEAT = 10_000  # ms, both ways: what else would tell that the broker's machine is gone
REASON = 0.1  # s between the loss of a connection and its telling, so that the reason is known by then
# Messages that have come in and are not handled: so a session keeps step, and the broker waits with more.
AHEAD = 1


def check_installed() -> None:
    """Raises a RealizerError that says what to install."""
    try:
        import stomp  # noqa: F401
    except ImportError:
        raise RealizerError("--stomp needs stomp.py: pip install 'bml-realizer[stomp]'") from None
    # It tells of every lost connection, with a traceback; so do we, in a line.
    logging.getLogger("stomp.py").setLevel(logging.CRITICAL)


class BrokerConnection:
    """One connection, from `connect` to `lost`; what blocks is called in a thread of the caller's.

    Args:
        loop: where `take(self, topic, body)` is called for each message, with the place of its topic among
            those that were subscribed to; and where the events are set.
        timeout: seconds to connect in.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        take: Callable[[BrokerConnection, int, bytes], None],
        timeout: float,
    ) -> None:
        self.settled = asyncio.Event()  # connected, or not
        self.reading = asyncio.Event()  # all topics are subscribed to; or lost
        self.lost = asyncio.Event()
        self.connected = False
        self.fault = ""
        self._loop = loop
        self._take = take
        self._timeout = timeout
        self._ahead = threading.BoundedSemaphore(AHEAD)
        self._stomp: Any = None
        self._dropped = False

    # in the door's thread

    def connect(
        self, address: tuple[str, int], host: str | None, login: str | None, password: str | None
    ) -> None:
        """Ask for a connection; `settled` says when there is one, or none."""
        import stomp
        from stomp.exception import StompException

        self._stomp = stomp.Connection12(
            [address],
            try_loopback_connect=False,  # that address and no other
            reconnect_attempts_max=1,
            reconnect_sleep_initial=0,  # we wait ourselves
            reconnect_sleep_max=0,
            timeout=self._timeout,
            heartbeats=(HEARTBEAT, HEARTBEAT),
            heart_beat_receive_scale=2.5,
            vhost=host,
            auto_decode=False,
            # With a length ActiveMQ makes messages of bytes, which Java clients that wait for text pass over.
            auto_content_length=False,
        )
        self._stomp.set_listener("door", self)
        try:
            self._stomp.connect(login, password)
        except StompException as error:
            raise RealizerError(str(error) or "nobody answers") from None
        # Otherwise each message waits until the one before is acknowledged: 50 ms a block instead of 7.
        with contextlib.suppress(OSError, AttributeError):
            self._stomp.transport.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if self._dropped:  # meanwhile; there was nothing to close yet
            self.drop()

    def subscribe(self, topics: Sequence[str]) -> None:
        """Ask for the messages of all topics; `reading` says when they come."""
        for number, topic in enumerate(topics):
            # The broker takes one after the other: its word on the last one is enough.
            receipt = {"receipt": "reading"} if number == len(topics) - 1 else {}
            self._guarded(self._stomp.subscribe, topic, id=str(number), headers=receipt)

    def send(self, message: Message) -> None:
        """Blocks while the broker does not read.

        Raises:
            OSError, RealizerError: the connection is lost.
        """
        self._guarded(self._stomp.send, message.topic, message.body, headers=dict(message.headers))

    def disconnect(self) -> None:
        """Say good-bye; `lost` says when the broker has."""
        self._guarded(self._stomp.disconnect)

    @staticmethod
    def _guarded(call: Callable[..., Any], *arguments: Any, **named: Any) -> None:
        from stomp.exception import StompException

        try:
            call(*arguments, **named)
        except (StompException, AttributeError) as error:  # it clears its socket under our hands
            raise RealizerError(str(error) or "the connection is lost") from None

    # in any thread

    def drop(self) -> None:
        """Close the socket, if it is still open or as soon as it is."""
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
        said = frame.headers.get("message", "")
        why, *_ = bytes(frame.body or b"").decode("utf-8", "replace").strip().splitlines() or [""]
        if said not in why:  # some brokers say it again at the head of a long trace
            said = f"{said}: {why}".removesuffix(": ")
        self._in_loop(self._settle, False, " ".join((said or why).split())[:200])

    def on_disconnected(self) -> None:
        self._in_loop(self._settle, False, "")
        # stomp.py closes the socket of a silent broker before it says so; the reading thread may be first.
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
        """One message less that has come in and waits."""
        self._ahead.release()

    def _settle(self, connected: bool, fault: str) -> None:
        self.connected |= connected
        self.fault = self.fault or fault
        self.settled.set()
