"""The Asap TCP transport: BML on one port, feedback to a port of the client.

A client connects to our BML port and sends documents, without frames. We connect back to its address at the
feedback port, where it may begin to listen only now. Neither side says hello or good-bye: who closes its BML
connection is gone.
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
from realizer.core.settings import Settings, raises
from realizer.server.http.access import RateLimiter
from realizer.server.runtime.session_registry import JoinError
from realizer.server.transports.document_framing import DocumentFramer, Fault
from realizer.server.transports.tcp_listener import TcpTransport, session_name
from realizer.server.transports.transport import Sessions

log = logging.getLogger(__name__)

READ = 64 * 1024  # bytes
# A client listens for the call-back only after its own connection stands, and looks for it once a second.
FIRST_RETRY = 0.05  # s
LAST_RETRY = 1.0  # s
ATTEMPT = 5.0  # s; a host that drops packets answers nothing
# Feedback that is kept while there is nobody to take it: hours of talk.
MAX_QUEUED = 4 * 2**20  # bytes
# A client's reader fails where the buffer of a start tag ends, at 4096 characters in the smallest.
LONGEST_TAG = 4000  # characters
_LONG_TAG = re.compile(rf"<[^<>]{{{LONGEST_TAG},}}")


class AsapTransport(TcpTransport):
    """Listens on `settings.host` and the first of `settings.asap_ports`, `port` once it has started.

    Asap serves one client at a time. Here each address has a session of its own, named `asap-ADDRESS`, which
    viewers can join; so clients on several hosts play side by side. Two on one host share a session, and each
    connection has its own call-back: the later one is called back once the port is its to listen on.
    """

    def __init__(self, sessions: Sessions, settings: Settings) -> None:
        assert settings.asap_ports is not None
        port, self._feedback_port = settings.asap_ports
        super().__init__("asap", settings.host, port, settings.max_connections)
        self._limit = settings.max_document
        self._rate = settings.max_rate
        self._sessions = sessions

    @property
    def startup_lines(self) -> tuple[str, ...]:
        back = f"feedback to port {self._feedback_port} of the client"
        return (f"asap: BML at {self.where}, {back}, session asap-ADDRESS",)

    async def _talk(self, host: str, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        link = CallBack(host, self._feedback_port, writer.transport.abort)
        try:
            number = self._sessions.join(link, session_name("asap", host))
        except JoinError as error:
            log.warning("asap: %s is not let in: %s", host, error)
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
        assembler, pace = DocumentFramer(self._limit), RateLimiter(self._rate)
        loop = asyncio.get_running_loop()
        while data := await reader.read(READ):
            for found in assembler.feed(data):
                if isinstance(found, Fault):
                    id, text = found.block or "<no id>", found.text
                    if found.large:
                        text = f"{text} {raises('max_document')}"
                    link.send(WarningFeedback(id=id, type="PARSING_FAILURE", text=text).to_xml())
                elif not self._sessions.receive(number, found):
                    return
                # 0 too: a read full of documents must not hold up the frames of others.
                pause = pace.wait(loop.time())
                if pace.notice is not None:
                    link.send(WarningFeedback(id="<no id>", type="IOException", text=pace.notice).to_xml())
                await asyncio.sleep(pause)


class CallBack(asyncio.Protocol):
    """The way out to one client: a connection to its feedback port, made anew until it is told to stop.

    Args:
        host, port: where the client listens, sooner or later.
        close: lets go of the client, from `disconnect`.
    """

    def __init__(self, host: str, port: int, close: Callable[[], None]) -> None:
        self._to = (host, port)
        self._close = close
        self._transport: asyncio.Transport | None = None
        self._lost = asyncio.Event()
        self._queue: deque[bytes] = deque()
        self._size = 0  # bytes in _kept
        self._dropped = 0

    @property
    def unsent_bytes(self) -> int:
        return self._size if self._transport is None else self._transport.get_write_buffer_size()

    def send(self, data: str | bytes) -> None:
        """Feedback: one element, then a line feed. It is kept while there is no connection."""
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

    def disconnect(self, code: int, reason: str) -> None:
        log.warning("asap: %s is let go of: %s", self._to[0], reason)
        self._close()

    async def keep_connected(self) -> None:
        """Connect, and again whenever the connection is lost, until cancelled."""
        loop = asyncio.get_running_loop()
        try:
            pause = FIRST_RETRY
            while True:
                await self._connect(loop)
                since = loop.time()
                await self._lost.wait()
                # Who hangs up at once may be somebody else's service.
                lasted = loop.time() - since > LAST_RETRY
                pause = FIRST_RETRY if lasted else min(2 * pause, LAST_RETRY)
                await asyncio.sleep(pause)
        finally:
            if self._transport is not None:
                self._transport.close()

    async def _connect(self, loop: asyncio.AbstractEventLoop) -> None:
        pause = FIRST_RETRY
        while True:
            with contextlib.suppress(OSError):  # a timeout is one too
                async with asyncio.timeout(ATTEMPT):
                    await loop.create_connection(lambda: self, *self._to)
                    return
            await asyncio.sleep(pause)
            pause = min(2 * pause, LAST_RETRY)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        transport = cast(asyncio.Transport, transport)  # uvloop's is one in all but name
        self._lost.clear()
        if transport.get_extra_info("sockname") == transport.get_extra_info("peername"):
            transport.abort()  # nobody listened, and TCP has met itself on the way
            return
        self._transport = transport
        if self._dropped:
            words = f"{self._dropped} messages came before anybody listened here and are left out"
            warning = WarningFeedback(id="<no id>", type="IOException", text=words)
            transport.write(warning.to_xml().encode() + b"\n")
        transport.writelines(self._queue)
        self._queue.clear()
        self._size = self._dropped = 0

    def connection_lost(self, exc: Exception | None) -> None:
        self._transport = None
        self._lost.set()


def _short(feedback: str) -> str:
    """The feedback; a warning in its place where one of its start tags is longer than clients can read."""
    if len(feedback) < LONGEST_TAG or (tag := _LONG_TAG.search(feedback)) is None:
        return feedback
    name = re.split(r"[\s/>]", tag[0][1:], maxsplit=1)[0]
    words = (
        f"wanted a start tag of at most {LONGEST_TAG} characters in feedback, got a <{name}> of {len(tag[0])}"
    )
    return WarningFeedback(id="<no id>", type="IOException", text=words).to_xml()
