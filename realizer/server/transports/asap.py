"""The Asap TCP transport: BML on one port, feedback to a port of the client.

A client connects to the BML port and sends documents, without framing. The service connects back to the
client's feedback port, where the client may begin to listen only then. There is no handshake: a client leaves
by closing its BML connection.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import re
from collections import deque
from collections.abc import Callable
from typing import cast

from bml_schema import WarningFeedback
from realizer.core.settings import Settings
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError
from realizer.server.transports.document_framing import DocumentFramer, Fault
from realizer.server.transports.rate_limiter import RateLimiter
from realizer.server.transports.tcp_listener import TcpTransport, session_name

log = logging.getLogger(__name__)

READ = 64 * 1024  # bytes
# A client listens for the call-back only once it is connected, and looks for it once a second.
FIRST_RETRY = 0.05  # s
LAST_RETRY = 1.0  # s
ATTEMPT = 5.0  # s; a host that drops packets never answers
# Feedback that is queued until the client listens: hours of speech.
MAX_QUEUED = 4 * 2**20  # bytes
# Clients fail at a start tag longer than their buffer, which is 4096 characters in the smallest one.
LONGEST_TAG = 4000  # characters
_LONG_TAG = re.compile(rf"<[^<>]{{{LONGEST_TAG},}}")


class AsapTransport(TcpTransport):
    """The Asap transport at `settings.host` and the first of `settings.asap_ports`.

    Asap itself serves one client at a time. Here each address has its own session `asap-ADDRESS`, which
    viewers can join. Two clients of one host share a session, and each connection has its own call-back: that
    of the second one succeeds once it can listen on the port.
    """

    def __init__(self, sessions: SessionHost, settings: Settings) -> None:
        assert settings.asap_ports is not None
        port, self._feedback_port = settings.asap_ports
        super().__init__("asap", settings.host, port, settings.max_connections, settings.allow)
        self._limit = settings.max_document
        self._rate = settings.max_rate
        self._sessions = sessions

    @property
    def startup_lines(self) -> tuple[str, ...]:
        back = f"feedback to port {self._feedback_port} of the client"
        return (f"asap: BML at {self.address}, {back}, session asap-ADDRESS",)

    async def _handle(self, host: str, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        link = CallBack(host, self._feedback_port, writer.transport.abort)
        try:
            number = self._sessions.join(link, session_name("asap", host))
        except JoinError as error:
            log.warning("asap: %s is refused: %s", host, error)
            return
        calling = asyncio.create_task(link.keep_connected())
        try:
            await self._read(reader, number, link)
        finally:
            self._sessions.leave(number)
            calling.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await calling

    async def _read(self, reader: asyncio.StreamReader, number: int, link: CallBack) -> None:
        framer, limiter = DocumentFramer(self._limit, wraps=True), RateLimiter(self._rate)
        while data := await reader.read(READ):
            for item in framer.feed(data):
                if isinstance(item, Fault):
                    link.warn("PARSING_FAILURE", item.text, item.block or "<no id>")
                elif not self._sessions.receive(number, item):
                    return
                await limiter.pause(lambda notice: link.warn("IOException", notice))
                await self._sessions.wait_for_room(number)


class CallBack(asyncio.Protocol):
    """The way out to one client: a connection to its feedback port, opened again until it is cancelled."""

    def __init__(self, host: str, port: int, close: Callable[[], None]) -> None:
        self._target = (host, port)
        self._close = close
        self._transport: asyncio.Transport | None = None
        self._lost = asyncio.Event()
        self._queue: deque[bytes] = deque()
        self._size = 0  # bytes in _queue
        self._dropped = 0  # messages

    @property
    def unsent_bytes(self) -> int:
        return self._size if self._transport is None else self._transport.get_write_buffer_size()

    def send(self, data: str | bytes) -> None:
        """Send feedback, followed by a line feed. Queue it while there is no connection."""
        if isinstance(data, bytes) or not data.startswith("<"):
            return
        line = _short(data).encode() + b"\n"
        if self._transport is not None:
            self._transport.write(line)
            return
        self._queue.append(line)
        self._size += len(line)
        while self._size > MAX_QUEUED:
            self._size -= len(self._queue.popleft())
            self._dropped += 1

    def warn(self, type: str, text: str, id: str = "<no id>") -> None:
        """Send a warning of our own."""
        self.send(WarningFeedback(id=id, type=type, text=text).to_xml())

    def disconnect(self, code: int, reason: str) -> None:
        log.warning("asap: %s is disconnected: %s", self._target[0], reason)
        self._close()

    async def keep_connected(self) -> None:
        """Connect, and reconnect whenever the connection is lost, until cancelled."""
        loop, pause = asyncio.get_running_loop(), FIRST_RETRY
        try:
            while True:
                lasted = False
                with contextlib.suppress(OSError):  # also TimeoutError
                    async with asyncio.timeout(ATTEMPT):
                        await loop.create_connection(lambda: self, *self._target)
                    since = loop.time()
                    await self._lost.wait()
                    # A peer that closes at once may be another service: do not call it in quick succession.
                    lasted = loop.time() - since > LAST_RETRY
                pause = FIRST_RETRY if lasted else pause
                await asyncio.sleep(pause)
                pause = min(2 * pause, LAST_RETRY)
        finally:
            if self._transport is not None:
                self._transport.close()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        transport = cast(asyncio.Transport, transport)  # uvloop's class does not inherit from it
        self._lost.clear()
        if transport.get_extra_info("sockname") == transport.get_extra_info("peername"):
            transport.abort()  # a TCP self-connect: nothing listens there
            return
        self._transport = transport
        if self._dropped:
            self.warn("IOException", f"{self._dropped} messages are lost: nothing listened here in time")
        transport.writelines(self._queue)
        self._queue.clear()
        self._size = self._dropped = 0

    def connection_lost(self, exc: Exception | None) -> None:
        self._transport = None
        self._lost.set()


def _short(feedback: str) -> str:
    """Return the feedback, or a warning if one of its start tags is longer than clients can read."""
    if len(feedback) < LONGEST_TAG or (tag := _LONG_TAG.search(feedback)) is None:
        return feedback
    name = re.split(r"[\s/>]", tag[0][1:], maxsplit=1)[0]
    words = (
        f"wanted a start tag of at most {LONGEST_TAG} characters in feedback, got a <{name}> of {len(tag[0])}"
    )
    return WarningFeedback(id="<no id>", type="IOException", text=words).to_xml()
