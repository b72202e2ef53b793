"""The Xface TCP transport."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterable

from realizer.core.errors import RealizerError
from realizer.core.settings import Settings
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError
from realizer.server.transports.message_formats import Disconnect, Inbound
from realizer.server.transports.rate_limiter import RateLimiter
from realizer.server.transports.tcp_listener import TcpTransport, session_name
from realizer.server.transports.xface.attachments import Attachment, prepare
from realizer.server.transports.xface.tasks import ERROR, Answer, TaskRunner
from realizer.server.transports.xface.wire import Fault, Status, Task, TaskReader, pack_note

log = logging.getLogger(__name__)

READ_SIZE = 64 * 1024  # bytes
# The largest task in bytes: enough for minutes of FAP text.
MAX_TASK = 4 * 2**20
MAX_CLIENTS = 64  # usually one or two; each may hold a task in memory
# The largest attachment, in characters, that is parsed at once; others are parsed in a thread.
MAX_INLINE = 16 * 1024
FEEDBACK = (
    '{"type":"subscribe","stream":"feedback",'
    '"elements":["predictionFeedback","blockProgress","warningFeedback"]}'
)


class XfaceTransport(TcpTransport):
    """The Xface transport at `settings.host` and `settings.xface_port`.

    As in Xface's own player, each client has a number, a loaded file and a queue. The clients of an address
    share the character of the session `xface-ADDRESS`, which viewers can join.
    """

    def __init__(self, sessions: SessionHost, settings: Settings) -> None:
        assert settings.xface_port is not None
        super().__init__(
            "xface", settings.host, settings.xface_port, settings.max_connections, settings.allow
        )
        self._settings = settings
        self._sessions = sessions
        self._count = 0

    @property
    def startup_lines(self) -> tuple[str, ...]:
        return (f"xface: tasks at {self.address}, session xface-ADDRESS",)

    async def _handle(self, host: str, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._count += 1
        link = _SessionLink(self._sessions, TaskRunner(self._count), writer)
        try:
            if len(self) > MAX_CLIENTS:
                raise JoinError(503, f"{MAX_CLIENTS} clients are connected: wanted fewer")
            number = self._sessions.join(link, session_name("xface", host))
        except JoinError as error:
            log.warning("xface: %s is refused: %s", host, error)
            writer.write(ERROR)
            await writer.drain()
            writer.close()
            return
        link.attach(number)
        try:
            await self._read(reader, writer, link)
        finally:
            self._sessions.leave(number)

    async def _read(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, link: _SessionLink
    ) -> None:
        parser = TaskReader(min(MAX_TASK, self._settings.max_message))
        limiter, loop = RateLimiter(self._settings.max_rate), asyncio.get_running_loop()
        while data := await reader.read(READ_SIZE):
            for item in parser.feed(data):
                match item:
                    case Fault(text, task):
                        log.info("xface: client %d: %s", link.tasks.owner, text)
                        link.carry_out(link.tasks.refuse(task))
                    case Task():
                        link.carry_out(link.tasks.accept(item))
                        attachment = await self._prepared(item)
                        link.carry_out(link.tasks.run(item, attachment, loop.time()))
                if link.has_left:
                    return
                await limiter.pause(
                    lambda notice: log.warning("xface: client %d: %s", link.tasks.owner, notice)
                )
                await writer.drain()  # the client may not read its notifications
                await self._sessions.wait_for_room(link.number)

    async def _prepared(self, task: Task) -> Attachment:
        try:
            if sum(map(len, task.params)) < MAX_INLINE and task.name != "LOAD_FAP":
                return prepare(task, self._settings)
            loop = asyncio.get_running_loop()
            return await loop.run_in_executor(None, prepare, task, self._settings)
        except RealizerError as error:
            return error
        except OSError as error:
            return RealizerError(str(error.strerror or error))


class _SessionLink:
    """The connection of one client to its session; it implements `Outbound`."""

    def __init__(self, sessions: SessionHost, tasks: TaskRunner, writer: asyncio.StreamWriter) -> None:
        self.tasks = tasks
        self.has_left = False
        self._sessions = sessions
        self._writer = writer
        self.number: int

    def attach(self, number: int) -> None:
        self.number = number
        self._sessions.receive(number, FEEDBACK)
        self._writer.write(pack_note("CONNECTION_OK", self.tasks.owner, 0, Status.UNKNOWN))

    def carry_out(self, answers: Iterable[Answer]) -> None:
        for answer in answers:
            match answer:
                case Inbound(text):
                    self.has_left = self.has_left or not self._sessions.receive(self.number, text)
                case Disconnect():
                    self.has_left = True
                case bytes() as note:
                    self._writer.write(note)

    @property
    def unsent_bytes(self) -> int:
        return self._writer.transport.get_write_buffer_size()

    def send(self, data: str | bytes) -> None:
        if isinstance(data, str):
            loop = asyncio.get_running_loop()
            # Later, because a message to the session now would call `send` again before this one has ended.
            loop.call_soon(lambda: self.carry_out(self.tasks.on_feedback(data, loop.time())))

    def disconnect(self, code: int, reason: str) -> None:
        log.warning("xface: client %d is disconnected: %s", self.tasks.owner, reason)
        self._writer.transport.abort()
