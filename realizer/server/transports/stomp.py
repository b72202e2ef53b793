"""The STOMP transport: a client of a message broker that speaks all formats there."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from bml_schema import WarningFeedback
from realizer.core.errors import RealizerError
from realizer.core.settings import Settings, raises
from realizer.server.http.access import RateLimiter
from realizer.server.runtime.session_registry import JoinError
from realizer.server.transports.broker import BrokerConnection, check_installed
from realizer.server.transports.message_format import Disconnect, Inbound, Message, MessageFormat
from realizer.server.transports.message_formats import MESSAGE_FORMATS
from realizer.server.transports.transport import Sessions

log = logging.getLogger(__name__)

FIRST_RETRY = 0.2  # s
LAST_RETRY = 10.0  # s
ATTEMPT = 5.0  # s; to connect, and to part
# Messages that wait for the broker; of more the oldest go.
MAX_QUEUED = 4 * 2**20  # characters


class StompTransport:
    """A client of the broker at `settings.stomp` that comes back whenever the broker does.

    Each dialect has a session of its own, by its name in DIALECTS, made when the first message comes and kept
    while the broker is away. What is said meanwhile is said when it is back.
    """

    def __init__(self, sessions: Sessions, settings: Settings) -> None:
        assert settings.stomp is not None
        host, _, port = settings.stomp.rpartition(":")
        self._address = (host.strip("[]"), int(port))
        self._sessions = sessions
        self._settings = settings
        made = {name: make(settings) for name, make in MESSAGE_FORMATS.items()}
        self._links = [
            _SessionLink(self, name, dialect) for name, dialect in made.items() if dialect is not None
        ]
        self._pace = RateLimiter(settings.max_rate)
        self._thread = ThreadPoolExecutor(1, "stomp")
        self._link: BrokerConnection | None = None
        self._out: deque[Message] = deque()
        self._size = 0  # characters in _out
        self._news = asyncio.Event()
        self._up = asyncio.Event()
        self._keeper: asyncio.Task[None] | None = None
        self._leaving: asyncio.Task[None] | None = None

    @property
    def startup_lines(self) -> tuple[str, ...]:
        names = ", ".join(f"{seat.format.topic} in session {seat.name}" for seat in self._links)
        return (f"stomp: {self._settings.stomp} reads {names}",)

    async def start(self) -> None:
        check_installed()
        self._loop = asyncio.get_running_loop()
        self._keeper = asyncio.create_task(self._keep_connected())

    async def ready(self) -> None:
        await self._up.wait()

    def stop_accepting(self) -> None:
        """Sessions refuse what comes from now on, with words; so messages are still read."""

    async def close(self) -> None:
        if self._leaving is None:
            self._leaving = asyncio.create_task(self._leave())
        await self._leaving

    async def _leave(self) -> None:
        """Say good-bye where somebody listens, and part."""
        for seat in self._links:
            seat.leave()
        if self._link is not None:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(ATTEMPT):
                    while self._out and self._link is not None:
                        await asyncio.sleep(0.01)
        if self._keeper is not None:
            self._keeper.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._keeper
        self._thread.shutdown(wait=False)

    # what comes and goes ------------------------------------------------------------------------

    def send_message(self, message: Message) -> None:
        """Send it, when the broker is there."""
        self._out.append(message)
        self._size += len(message.body)
        while self._size > MAX_QUEUED:
            self._size -= len(self._out.popleft().body)
        self._news.set()

    @property
    def waiting(self) -> int:
        return self._size

    def _take(self, link: BrokerConnection, seat: int, body: bytes) -> None:
        """A message has come in; in the event loop. The next one is read when it may be."""
        pause = self._pace.wait(self._loop.time())
        if self._pace.notice is not None:
            log.warning("stomp: %s", self._pace.notice)
        if pause:
            self._loop.call_later(pause, link.handled)
        else:
            link.handled()
        if link is not self._link or self._leaving is not None:
            return
        if len(body) > self._settings.max_message:
            words = f"wanted at most {self._settings.max_message} bytes in a message, got {len(body)}"
            log.warning("stomp: %s: %s", self._links[seat].name, words)
            refusal = WarningFeedback(
                id="<no id>", type="PARSING_FAILURE", text=f"{words} {raises('max_message')}"
            )
            self._links[seat].send(refusal.to_xml())
            return
        for action in self._links[seat].format.incoming(body):
            match action:
                case Message():
                    self.send_message(action)
                case Inbound(text):
                    self._links[seat].receive(text)
                case Disconnect():
                    log.warning("stomp: vrKillComponent: the door closes")
                    self._leaving = asyncio.create_task(self._leave())
                    return

    # the connection -----------------------------------------------------------------------------

    async def _keep_connected(self) -> None:
        """Be connected, until cancelled."""
        pause = FIRST_RETRY
        told = False
        while True:
            link = BrokerConnection(self._loop, self._take, ATTEMPT)
            try:
                await self._connect(link)
                log.log(
                    logging.WARNING if told else logging.INFO, "stomp: connected to %s", self._settings.stomp
                )
                pause, told = FIRST_RETRY, False
                await self._talk(link)
                words = "the broker at %s is gone%s; looking for it"
            except (OSError, RealizerError) as error:
                link.fault = link.fault or str(error)
                words = "no broker at %s%s; looking for it"
            finally:
                self._link = None
                await asyncio.shield(self._disconnect(link))
            if not told:
                log.warning("stomp: " + words, self._settings.stomp, link.fault and f" ({link.fault})")
                told = True
            await asyncio.sleep(pause)
            pause = min(2 * pause, LAST_RETRY)

    async def _connect(self, link: BrokerConnection) -> None:
        settings = self._settings
        async with asyncio.timeout(ATTEMPT):
            await self._call(
                link.connect,
                self._address,
                settings.stomp_host,
                settings.stomp_login,
                settings.stomp_password,
            )
            await link.settled.wait()
            if link.connected:
                await self._call(link.subscribe, [seat.format.topic for seat in self._links])
                await link.reading.wait()
        if not link.connected or link.lost.is_set():
            raise RealizerError(link.fault or "it closes the connection")
        self._link = link
        for seat in self._links:
            for message in reversed(seat.format.hello()):
                self._out.appendleft(message)
                self._size += len(message.body)
        self._news.set()
        self._up.set()

    async def _talk(self, link: BrokerConnection) -> None:
        """Send what there is to send, until the connection is lost."""
        lost = asyncio.create_task(link.lost.wait())
        try:
            while not lost.done():
                news = asyncio.create_task(self._news.wait())
                await asyncio.wait((news, lost), return_when=asyncio.FIRST_COMPLETED)
                news.cancel()
                self._news.clear()
                while self._out and not lost.done():
                    message = self._out[0]
                    try:
                        await self._call(link.send, message)
                    except (OSError, RealizerError):
                        return  # it is said again to the next connection
                    if self._out and self._out[0] is message:
                        self._out.popleft()
                        self._size -= len(message.body)
        finally:
            lost.cancel()

    async def _disconnect(self, link: BrokerConnection) -> None:
        with contextlib.suppress(OSError, RealizerError):
            async with asyncio.timeout(ATTEMPT):
                if link.connected and not link.lost.is_set():
                    await self._call(link.disconnect)
                    await link.lost.wait()
        link.drop()

    async def _call(self, function: Callable[..., None], *arguments: Any) -> None:
        """Something that blocks, in the door's own thread, one after the other."""
        await self._loop.run_in_executor(self._thread, function, *arguments)


class _SessionLink:
    """One dialect's connection to its session; a Client."""

    def __init__(self, door: StompTransport, name: str, dialect: MessageFormat) -> None:
        self.name = name
        self.format = dialect
        self._door = door
        self._number: int | None = None

    def receive(self, text: str) -> None:
        """To the session, which is made where there is none."""
        sessions = self._door._sessions
        try:
            if self._number is None:
                self._number = sessions.join(self, self.name)
            if not sessions.receive(self._number, text):
                sessions.leave(self._number)
                self._number = sessions.join(self, self.name)
                sessions.receive(self._number, text)
        except JoinError as error:
            log.warning("stomp: %s: %s", self.name, error)

    @property
    def unsent_bytes(self) -> int:
        return self._door.waiting

    def send(self, data: str | bytes) -> None:
        if isinstance(data, str) and data.startswith("<"):
            for message in self.format.outgoing(data):
                self._door.send_message(message)

    def disconnect(self, code: int, reason: str) -> None:
        log.warning("stomp: session %s ends: %s", self.name, reason)
        self.leave()

    def leave(self) -> None:
        for message in self.format.farewell():
            self._door.send_message(message)
        if self._number is not None:
            self._door._sessions.leave(self._number)
            self._number = None
