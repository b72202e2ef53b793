"""Worker processes behind one port: each connection is passed to the worker of its session.

The parent peeks at the first line of a request, which stays in the socket, and passes the socket itself, so
that later messages go directly to the worker.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import multiprocessing
import re
import signal
import socket
from collections.abc import Callable, Coroutine
from dataclasses import replace
from multiprocessing.process import BaseProcess
from urllib.parse import parse_qs, unquote

from realizer.core.errors import RealizerError
from realizer.core.logs import write_words
from realizer.core.settings import Settings
from realizer.server.runtime.session_registry import worker_of
from realizer.server.runtime.worker_aggregation import aggregate, is_for_all_workers
from realizer.server.transports.tcp_listener import listen

log = logging.getLogger(__name__)

# Limits of the first line of a request: time to arrive, and length.
PATIENCE, LONGEST = 10.0, 8192  # s, bytes
GRACE = 5.0  # s; a worker that has not ended so long after its drain is killed
STEP = 0.005  # s; between attempts to pass a socket to a busy worker, or to read an incomplete line
SESSION_PATH = re.compile("/sessions/([^/]+)")
# The first byte from a worker: its transports are open, or an error text follows.
READY, FAULT = b"r", b"!"

Serve = Callable[[Settings, int, socket.socket], None]


class Workers:
    """The parent of `settings.workers` processes: `start`, then `close`.

    Args:
        serve: (settings, number, control): serves the connections that arrive through `control`, in a worker
            process; a function of a module, which that process imports.
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
            OSError: the address is not available.
            RealizerError: a worker cannot start.
        """
        self._sockets = await listen(self._settings.host, self.port)
        self.port = self._sockets[0].getsockname()[1]
        try:
            for number in range(self._settings.workers):
                self._children.append(self._start_worker(number))
            for _, control in self._children:
                if (words := await _startup_error(control)) is not None:
                    raise RealizerError(words)
        except BaseException:
            await self.close()
            raise
        for listener in self._sockets:
            self._add_task(self._accept(listener))
        for number, (_, control) in enumerate(self._children):
            self._add_task(self._watch(number, control))
        return self

    def stop_accepting(self) -> None:
        """Accept no more connections, and ask the workers to drain and end."""
        self._ending = True
        for listener in self._sockets:
            listener.close()
        for child, _ in self._children:
            if child.pid is not None and child.is_alive():
                child.terminate()

    async def close(self) -> None:
        """Stop accepting and wait for the workers to end; kill those that hang."""
        self.stop_accepting()
        for task in self._tasks:
            task.cancel()
        loop = asyncio.get_running_loop()
        last = loop.time() + self._settings.drain + GRACE
        for number, (child, control) in enumerate(self._children):
            control.close()  # which also ends a worker that is still starting
            await loop.run_in_executor(None, child.join, max(0.0, last - loop.time()))
            if child.is_alive():
                log.error("worker %d does not end: it is killed", number)
                child.kill()
                await loop.run_in_executor(None, child.join)

    def _add_task(self, coroutine: Coroutine[None, None, None]) -> None:
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
                await asyncio.sleep(1.0)  # at most one attempt a second

    async def _accept(self, listener: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        while True:
            try:
                client, _ = await loop.sock_accept(listener)
            except OSError as error:
                if self._ending:
                    return
                log.error("a connection could not be accepted: %s", error)
                await asyncio.sleep(0.1)
                continue
            self._add_task(self._route(client))

    async def _route(self, client: socket.socket) -> None:
        with client, contextlib.suppress(TimeoutError, OSError):
            async with asyncio.timeout(PATIENCE):
                line = await _first_line(client)
                if is_for_all_workers(line):
                    await aggregate(client, len(self._children), self._pass_socket)
                else:
                    await self._pass_socket(self._number(line), client)

    async def _pass_socket(self, number: int, client: socket.socket) -> None:
        while True:
            try:
                socket.send_fds(self._children[number][1], [READY], [client.fileno()])
                return
            except BlockingIOError:
                await asyncio.sleep(STEP)

    def _number(self, line: str) -> int:
        """Return the worker of a request: of its session, the one it names (`?worker=1`), or the next one."""
        path, _, query_text = line.partition(" ")[2].partition(" ")[0].partition("?")
        query, count = parse_qs(query_text), len(self._children)
        in_path = SESSION_PATH.match(path)
        session = unquote(in_path[1]) if in_path else query.get("session", [None])[-1]
        if session is not None:
            return worker_of(session, count, self._settings)
        named = query.get("worker", [""])[-1]
        if named in map(str, range(count)):
            return int(named)
        return next(self._turn) % count


async def _first_line(client: socket.socket) -> str:
    """Return the first line of a request without removing it from the socket."""
    loop = asyncio.get_running_loop()
    while True:
        readable = asyncio.Event()
        loop.add_reader(client, readable.set)
        try:
            await readable.wait()
        finally:
            loop.remove_reader(client)
        data = client.recv(LONGEST, socket.MSG_PEEK)
        line, end, _ = data.partition(b"\r\n")
        if end or not data or len(data) >= LONGEST:
            return line.decode("latin-1")
        await asyncio.sleep(STEP)


async def _startup_error(control: socket.socket) -> str | None:
    """Wait until a worker is ready and return None, or why it cannot start."""
    loop = asyncio.get_running_loop()
    if (first := await loop.sock_recv(control, 1)) == READY:
        return None
    words = b""
    while first and (more := await loop.sock_recv(control, 4096)):
        words += more
    return words.decode() or "a worker ended before it was ready"


def receive_sockets(control: socket.socket) -> list[socket.socket]:
    """Return the sockets that the parent has passed.

    Raises:
        EOFError: the parent has ended.
    """
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
    write_words(level, f"worker {number}: ")
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C goes to the parent, which ends the workers
    control.setblocking(False)
    serve(replace(settings, port=port), number, control)
