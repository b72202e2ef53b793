"""The STOMP transport: a client of a message broker, with a session for each message format."""

import asyncio
import contextlib
import logging
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from bml_schema import WarningFeedback
from realizer.core.errors import RealizerError
from realizer.core.settings import Settings, limit_hint
from realizer.server.runtime.session_host import CONGESTION, SessionHost
from realizer.server.runtime.session_registry import JoinError
from realizer.server.transports.broker import BrokerConnection, check_installed
from realizer.server.transports.message_formats import (
    AsapJson,
    AsapXml,
    Disconnect,
    Inbound,
    Message,
    MessageFormat,
)
from realizer.server.transports.rate_limiter import RateLimiter
from realizer.server.transports.reconnecting import ReconnectingTransport
from realizer.server.transports.vhmsg import Vhmsg

log = logging.getLogger(__name__)

ATTEMPT = 5.0  # s; to connect, and to disconnect
# Messages that wait for the broker; beyond it the oldest are dropped.
MAX_QUEUED = 4 * 2**20  # characters
# Name of the session -> its topic to read in the settings, None to switch it off, and the format's factory.
MESSAGE_FORMATS: dict[str, tuple[str, Callable[[str, Settings], MessageFormat]]] = {
    "stomp-json": ("stomp_json_in", lambda topic, settings: AsapJson(topic, settings.stomp_json_out)),
    "stomp-xml": ("stomp_xml_in", lambda topic, settings: AsapXml(topic, settings.stomp_xml_out)),
    "stomp-vhmsg": ("stomp_vhmsg", lambda topic, settings: Vhmsg(topic, settings.max_document)),
}


class StompTransport(ReconnectingTransport):
    """A client of the broker at `settings.stomp`, which reconnects whenever the connection is lost.

    Each message format has a session, named as in MESSAGE_FORMATS, which begins with the first message and
    goes on while the broker is gone. Messages are queued meanwhile.
    """

    def __init__(self, sessions: SessionHost, settings: Settings) -> None:
        assert settings.stomp is not None
        super().__init__("stomp", settings.stomp)
        self._sessions = sessions
        self._settings = settings
        self._links = [
            _SessionLink(self, name, make(topic, settings))
            for name, (setting, make) in MESSAGE_FORMATS.items()
            if (topic := getattr(settings, setting)) is not None
        ]
        names = ", ".join(f"{link.format.topic} in session {link.name}" for link in self._links)
        self.startup_lines = (f"stomp: {self._peer} reads {names}",)
        self._limiter = RateLimiter(settings.max_rate)
        self._thread = ThreadPoolExecutor(1, "stomp")
        self._broker: BrokerConnection | None = None
        self._out: deque[Message] = deque()
        self.unsent_bytes = 0  # characters in _out
        self._news = asyncio.Event()
        self._leaving: asyncio.Task[None] | None = None

    async def start(self) -> None:
        check_installed()
        await super().start()

    async def close(self) -> None:
        if self._leaving is None:
            self._leaving = asyncio.create_task(self._leave())
        await self._leaving

    async def _leave(self) -> None:
        for link in self._links:
            link.leave()
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(ATTEMPT):
                while self._out and self._broker is not None:
                    await asyncio.sleep(0.01)
        await super().close()
        self._thread.shutdown(wait=False)

    # messages -----------------------------------------------------------------------------------

    def send_message(self, message: Message) -> None:
        """Send a message as soon as the broker is connected."""
        self._out.append(message)
        self.unsent_bytes += len(message.body)
        while self.unsent_bytes > MAX_QUEUED:
            self.unsent_bytes -= len(self._out.popleft().body)
        self._news.set()

    def _take(self, broker: BrokerConnection, topic: int, body: bytes) -> None:
        """Handle a message, and read the next one as soon as the rate permits."""
        pause = self._limiter.wait(self._loop.time())
        if self._limiter.notice is not None:
            log.warning("stomp: %s", self._limiter.notice)
        link = self._links[topic]
        if pause:
            self._loop.call_later(pause, self._read_on, broker, link)
        else:
            self._read_on(broker, link)
        if broker is not self._broker or self._leaving is not None:
            return
        if len(body) > self._settings.max_message:
            words = f"wanted at most {self._settings.max_message} bytes in a message, got {len(body)}"
            log.warning("stomp: %s: %s", link.name, words)
            text = f"{words} {limit_hint('max_message')}"
            link.send(WarningFeedback(id="<no id>", type="PARSING_FAILURE", text=text).to_xml())
            return
        for action in link.format.incoming(body):
            match action:
                case Message():
                    self.send_message(action)
                case Inbound(text):
                    link.receive(text)
                case Disconnect():
                    log.warning("stomp: vrKillComponent: the transport closes")
                    self._leaving = asyncio.create_task(self._leave())
                    return

    def _read_on(self, broker: BrokerConnection, link: "_SessionLink") -> None:
        """Read the next message as soon as the session of the last one is not congested."""
        if link.is_congested:
            self._loop.call_later(CONGESTION, self._read_on, broker, link)
        else:
            broker.handled()

    # the connection -----------------------------------------------------------------------------

    async def _serve(self, connected: Callable[[], None]) -> str:
        broker = BrokerConnection(self._loop, self._take, ATTEMPT)
        try:
            await self._connect(broker)
            connected()
            await self._send_queue(broker)
            reason = f"the broker at {self._peer} is gone"
        except (OSError, RealizerError) as error:
            broker.fault = broker.fault or str(error)
            reason = f"no broker at {self._peer}"
        finally:
            self._broker = None
            await asyncio.shield(self._disconnect(broker))
        return f"{reason} ({broker.fault})" if broker.fault else reason

    async def _connect(self, broker: BrokerConnection) -> None:
        s = self._settings
        async with asyncio.timeout(ATTEMPT):
            await self._call(broker.connect, self._address, s.stomp_host, s.stomp_login, s.stomp_password)
            await broker.settled.wait()
            if broker.connected:
                await self._call(broker.subscribe, [link.format.topic for link in self._links])
                await broker.reading.wait()
        if not broker.connected or broker.lost.is_set():
            raise RealizerError(broker.fault or "it closes the connection")
        self._broker = broker
        for link in self._links:
            for message in reversed(link.format.hello()):
                self._out.appendleft(message)
                self.unsent_bytes += len(message.body)
        self._news.set()
        self._up.set()

    async def _send_queue(self, broker: BrokerConnection) -> None:
        lost = asyncio.create_task(broker.lost.wait())
        try:
            while not lost.done():
                news = asyncio.create_task(self._news.wait())
                await asyncio.wait((news, lost), return_when=asyncio.FIRST_COMPLETED)
                news.cancel()
                self._news.clear()
                while self._out and not lost.done():
                    message = self._out[0]
                    try:
                        await self._call(broker.send, message)
                    except (OSError, RealizerError):
                        return  # the next connection sends it again
                    if self._out and self._out[0] is message:
                        self._out.popleft()
                        self.unsent_bytes -= len(message.body)
        finally:
            lost.cancel()

    async def _disconnect(self, broker: BrokerConnection) -> None:
        with contextlib.suppress(OSError, RealizerError):
            async with asyncio.timeout(ATTEMPT):
                if broker.connected and not broker.lost.is_set():
                    await self._call(broker.disconnect)
                    await broker.lost.wait()
        broker.drop()

    async def _call(self, function: Callable[..., None], *arguments: Any) -> None:
        await self._loop.run_in_executor(self._thread, function, *arguments)


class _SessionLink:
    """The connection of one message format to its session; an `Outbound`."""

    def __init__(self, transport: StompTransport, name: str, format: MessageFormat) -> None:
        self.name = name
        self.format = format
        self._transport = transport
        self._number: int | None = None

    def receive(self, text: str) -> None:
        sessions = self._transport._sessions
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
    def is_congested(self) -> bool:
        return self._number is not None and self._transport._sessions.is_congested(self._number)

    @property
    def unsent_bytes(self) -> int:
        return self._transport.unsent_bytes

    def send(self, data: str | bytes) -> None:
        if isinstance(data, str) and data.startswith("<"):
            for message in self.format.outgoing(data):
                self._transport.send_message(message)

    def disconnect(self, code: int, reason: str) -> None:
        log.warning("stomp: session %s ends: %s", self.name, reason)
        self.leave()

    def leave(self) -> None:
        for message in self.format.farewell():
            self._transport.send_message(message)
        if self._number is not None:
            self._transport._sessions.leave(self._number)
            self._number = None
