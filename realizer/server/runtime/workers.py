"""Worker processes; connections of one port are passed to the worker of their session.

The parent looks at the first line of a request and leaves it in the socket. What it hands over is the socket
itself, so that nothing stands between a client and its worker afterwards.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import multiprocessing
import signal
import socket
from collections.abc import Callable, Coroutine
from dataclasses import replace
from multiprocessing.process import BaseProcess
from urllib.parse import parse_qs

from realizer.core.errors import RealizerError
from realizer.core.logs import write_words
from realizer.core.settings import Settings
from realizer.server.runtime.session_registry import worker_of
from realizer.server.runtime.worker_aggregation import aggregate, is_for_all_workers

log = logging.getLogger(__name__)

# A request's first line must have come by then, and be no longer.
PATIENCE, LONGEST = 10.0, 8192  # s, bytes
# How long a worker is waited for that should have ended: then it hangs.
GRACE = 5.0  # s
# How long a worker that is full is waited for, and how often a request that is not whole is looked at.
STEP = 0.005  # s
# What a worker says when its doors are open; and, before the words, when they cannot be.
READY, FAULT = b"r", b"!"


Serve = Callable[[Settings, int, socket.socket], None]


class WorkerError(RealizerError):
    """A worker that cannot be started, and why."""


class Workers:
    """The parent of `settings.workers` processes: `start`, then `close`.

    Args:
        serve: (settings, number, control) -> serves in a worker's own process the connections that come
            through `control`; a function of a module, which that process imports.

    Attributes:
        port: the one that is open after `start`.
    """

    def __init__(self, settings: Settings, serve: Serve) -> None:
        self._serve = serve
        self._settings = settings
        self.port = settings.port
        self._listening: asyncio.Server | None = None
        self._sockets: list[socket.socket] = []
        self._children: list[tuple[BaseProcess, socket.socket]] = []
        self._tasks: set[asyncio.Task[None]] = set()
        self._turn = itertools.count()
        self._ending = False

    async def start(self) -> Workers:
        """Start the workers, then open the port.

        Raises:
            OSError: the address cannot be had.
            WorkerError: a worker lacks something, or ended before it was ready.
        """
        loop = asyncio.get_running_loop()
        found = await loop.getaddrinfo(
            self._settings.host or None, self.port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )
        for family, _, _, _, address in dict.fromkeys(found):
            if self._sockets and self.port == 0:
                address = (address[0], self._sockets[0].getsockname()[1], *address[2:])
            here = socket.create_server(address[:2], family=family, backlog=1024)
            here.setblocking(False)
            self._sockets.append(here)
        self.port = self._sockets[0].getsockname()[1]
        try:
            for number in range(self._settings.workers):
                self._children.append(self._start_worker(number))
            for _, control in self._children:
                if (words := await _startup_error(control)) is not None:
                    raise WorkerError(words)
        except BaseException:
            await self.close()
            raise
        for here in self._sockets:
            self._keep(self._accept(here))
        for number, (_, control) in enumerate(self._children):
            self._keep(self._watch(number, control))
        return self

    @property
    def processes(self) -> list[int]:
        """Their numbers, in order."""
        return [child.pid for child, _ in self._children if child.pid is not None]

    def stop_accepting(self) -> None:
        """Take no more connections; each worker gives what plays its time, and ends."""
        self._ending = True
        for here in self._sockets:
            here.close()
        for child, _ in self._children:
            if child.pid is not None and child.is_alive():
                child.terminate()

    async def close(self) -> None:
        """`stop_accepting`, and wait for the workers; one that hangs is killed."""
        self.stop_accepting()
        for task in self._tasks:
            task.cancel()
        loop = asyncio.get_running_loop()
        last = loop.time() + self._settings.drain + GRACE
        for number, (child, control) in enumerate(self._children):
            control.close()  # a worker that is still starting ends by that
            await loop.run_in_executor(None, child.join, max(0.0, last - loop.time()))
            if child.is_alive():
                log.error("worker %d does not end: it is killed", number)
                child.kill()
                await loop.run_in_executor(None, child.join)

    # inside -------------------------------------------------------------------------------------

    def _keep(self, coroutine: Coroutine[None, None, None]) -> None:
        task = asyncio.get_running_loop().create_task(coroutine)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _start_worker(self, number: int) -> tuple[BaseProcess, socket.socket]:
        ours, theirs = socket.socketpair()
        child = multiprocessing.get_context("spawn").Process(
            target=_work,
            args=(self._serve, self._settings, number, self.port, theirs, logging.getLogger().level),
            name=f"worker-{number}",
        )
        child.start()
        theirs.close()
        ours.setblocking(False)
        return child, ours

    async def _watch(self, number: int, control: socket.socket) -> None:
        """Start a worker again that ends by itself."""
        loop = asyncio.get_running_loop()
        while not self._ending:
            with contextlib.suppress(OSError):
                if await loop.sock_recv(control, 1):
                    continue
            if self._ending:
                return
            child, _ = self._children[number]
            await loop.run_in_executor(None, child.join)
            fate = "are lost" if self._settings.journal is None else "go on when their clients come back"
            log.error("worker %d ended with status %s: its sessions %s", number, child.exitcode, fate)
            control.close()
            self._children[number] = child, control = self._start_worker(number)
            if (words := await _startup_error(control)) is not None:
                log.error("worker %d: %s", number, words)
                await asyncio.sleep(1.0)  # no more than one try a second

    async def _accept(self, here: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        while True:
            try:
                client, _ = await loop.sock_accept(here)
            except OSError as error:
                if self._ending:
                    return
                log.error("a connection could not be taken: %s", error)
                await asyncio.sleep(0.1)
                continue
            self._keep(self._route(client))

    async def _route(self, client: socket.socket) -> None:
        """Look who it is for, and give it away."""
        with client, contextlib.suppress(TimeoutError, OSError):
            async with asyncio.timeout(PATIENCE):
                line = await _first_line(client)
                if is_for_all_workers(line):
                    await aggregate(client, len(self._children), self._pass_socket)
                else:
                    await self._pass_socket(self._number(line), client)

    async def _pass_socket(self, number: int, client: socket.socket) -> None:
        """Hand a connection over."""
        while True:
            try:
                socket.send_fds(self._children[number][1], [READY], [client.fileno()])
                return
            except BlockingIOError:
                await asyncio.sleep(STEP)

    def _number(self, line: str) -> int:
        """The worker of a request: that of its session, the one it names (`?worker=1`), or the next."""
        query, count = parse_qs(line.partition("?")[2].partition(" ")[0]), len(self._children)
        if "session" in query:
            return worker_of(query["session"][-1], count, self._settings)
        named = query.get("worker", [""])[-1]
        if named in map(str, range(count)):
            return int(named)
        return next(self._turn) % count


async def _first_line(client: socket.socket) -> str:
    """The first line of what a client says, which stays to be read."""
    loop = asyncio.get_running_loop()
    while True:
        came = asyncio.Event()
        loop.add_reader(client, came.set)
        try:
            await came.wait()
        finally:
            loop.remove_reader(client)
        data = client.recv(LONGEST, socket.MSG_PEEK)
        line, end, _ = data.partition(b"\r\n")
        if end or not data or len(data) >= LONGEST:
            return line.decode("latin-1")
        await asyncio.sleep(STEP)


async def _startup_error(control: socket.socket) -> str | None:
    """Why a worker does not become ready; None once it is."""
    loop = asyncio.get_running_loop()
    if (first := await loop.sock_recv(control, 1)) == READY:
        return None
    words = b""
    while first and (more := await loop.sock_recv(control, 4096)):
        words += more
    return words.decode() or "a worker ended before it was ready"


def receive_sockets(control: socket.socket) -> list[socket.socket]:
    """The sockets that the parent has handed over since; none where it has ended."""
    data, numbers, _, _ = socket.recv_fds(control, 64, 64)
    if not data:
        raise EOFError
    sockets = [socket.socket(fileno=number) for number in numbers]
    for client in sockets:
        client.setblocking(False)
    return sockets


def _work(
    serve: Serve, settings: Settings, number: int, port: int, control: socket.socket, level: int
) -> None:
    """Run a worker in its own process, with the log level of its parent."""
    write_words(level, f"worker {number}: ")
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends us, also from a terminal
    if number:  # doors that have a port or a broker of their own are open once
        settings = replace(settings, asap_ports=None, xface_port=None, xface_player=None, stomp=None)
    control.setblocking(False)
    serve(replace(settings, port=port), number, control)
