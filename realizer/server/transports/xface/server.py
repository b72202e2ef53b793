"""The Xface TCP transport."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterable

from realizer.core.errors import RealizerError
from realizer.core.settings import Settings
from realizer.server.http.access import RateLimiter
from realizer.server.runtime.session_registry import JoinError
from realizer.server.transports.message_format import Disconnect, Inbound
from realizer.server.transports.tcp_listener import TcpTransport, session_name
from realizer.server.transports.transport import Sessions
from realizer.server.transports.xface.attachments import Attachment, prepare
from realizer.server.transports.xface.reader import Content, Fault, TaskReader
from realizer.server.transports.xface.tasks import ERROR, Answer, TaskRunner
from realizer.server.transports.xface.wire import Task

log = logging.getLogger(__name__)

READ = 64 * 1024  # bytes
# Of one task: minutes of FAP text, and more than plays as one document.
LIMIT = 4 * 2**20  # bytes
MAX_CLIENTS = 64  # a player is steered by one or two; each may hold a task that has not come to its end
# What is understood at once; more of it goes to a thread, so that the frames of others are not late.
SMALL = 16 * 1024  # characters
FEEDBACK = (
    '{"type":"subscribe","stream":"feedback",'
    '"elements":["predictionFeedback","blockProgress","warningFeedback"]}'
)


class XfaceTransport(TcpTransport):
    """Listens on `settings.host` and `settings.xface_port`; `port` is the one that is open after `start`.

    Each client has its own number, its own loaded file and its own queue, as several have in the player. The
    clients of one address share a face: that of the session `xface-ADDRESS`, which viewers can join.
    """

    def __init__(self, sessions: Sessions, settings: Settings) -> None:
        assert settings.xface_port is not None
        super().__init__("xface", settings.host, settings.xface_port, settings.max_connections)
        self._settings = settings
        self._sessions = sessions
        self._count = 0

    @property
    def startup_lines(self) -> tuple[str, ...]:
        return (f"xface: tasks at {self.where}, session xface-ADDRESS",)

    async def _talk(self, host: str, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._count += 1
        seat = _SessionLink(self._sessions, TaskRunner(self._count), writer)
        try:
            if len(self) > MAX_CLIENTS:
                raise JoinError(503, f"{MAX_CLIENTS} clients are connected: wanted fewer")
            number = self._sessions.join(seat, session_name("xface", host))
        except JoinError as error:
            log.warning("xface: %s is not let in: %s", host, error)
            writer.write(ERROR)
            await writer.drain()
            writer.close()
            return
        seat.attach(number)
        try:
            await self._read(reader, writer, seat)
        finally:
            self._sessions.leave(number)

    async def _read(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, seat: _SessionLink
    ) -> None:
        tasks = TaskReader(min(LIMIT, self._settings.max_message))
        pace, loop = RateLimiter(self._settings.max_rate), asyncio.get_running_loop()
        while data := await reader.read(READ):
            for found in tasks.feed(data):
                match found:
                    case Fault(text, task):
                        log.info("xface: client %d: %s", seat.tasks.owner, text)
                        seat.do(seat.tasks.refuse(task))
                    case Task():
                        seat.do(seat.tasks.accept(found))
                        brought = await self._prepared(found)
                        seat.do(seat.tasks.run(found, brought, asyncio.get_running_loop().time()))
                    case Content():
                        pass  # of a task that has been answered
                if seat.has_left:
                    return
                # 0 too: a read full of tasks must not hold up the frames of others, nor pile up notes unread.
                pause = pace.wait(loop.time())
                if pace.notice is not None:
                    log.warning("xface: client %d: %s", seat.tasks.owner, pace.notice)
                await asyncio.sleep(pause)
                await writer.drain()

    async def _prepared(self, task: Task) -> Attachment:
        try:
            if sum(map(len, task.params)) < SMALL and task.name != "LOAD_FAP":
                return prepare(task, self._settings)
            loop = asyncio.get_running_loop()
            return await loop.run_in_executor(None, prepare, task, self._settings)
        except RealizerError as error:
            return error
        except OSError as error:
            return RealizerError(str(error.strerror or error))


class _SessionLink:
    """One client in its session."""

    def __init__(self, sessions: Sessions, desk: TaskRunner, writer: asyncio.StreamWriter) -> None:
        self.tasks = desk
        self.has_left = False
        self._sessions = sessions
        self._writer = writer
        self._number = 0

    def attach(self, number: int) -> None:
        """It has joined its session."""
        self._number = number
        self._sessions.receive(number, FEEDBACK)
        self._writer.write(self.tasks.greeting)

    def do(self, answers: Iterable[Answer]) -> None:
        """Carry out what the desk wants, in order."""
        for answer in answers:
            match answer:
                case Inbound(text):
                    self.has_left = self.has_left or not self._sessions.receive(self._number, text)
                case Disconnect():
                    self.has_left = True
                case note:
                    self._writer.write(note)

    @property
    def unsent_bytes(self) -> int:
        return self._writer.transport.get_write_buffer_size()

    def send(self, data: str | bytes) -> None:
        if isinstance(data, str):
            loop = asyncio.get_running_loop()
            # What the desk wants of the session now would come back here before this has been told.
            loop.call_soon(lambda: self.do(self.tasks.on_feedback(data, loop.time())))

    def disconnect(self, code: int, reason: str) -> None:
        log.warning("xface: client %d is let go of: %s", self.tasks.owner, reason)
        self._writer.transport.abort()
