"""The service: opens the transports, prints their addresses, drains and ends."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import socket
import sys
from collections.abc import Awaitable, Coroutine, Iterator

from realizer.animation import arkit
from realizer.core.errors import RealizerError
from realizer.core.logs import write_json
from realizer.core.settings import Settings, SettingsError
from realizer.face.fap_mapping import mapping_of
from realizer.scheduling import warm_up
from realizer.server.http.hub import Hub
from realizer.server.http.server import HttpServer, startup_lines
from realizer.server.runtime.garbage import disable_automatic_gc
from realizer.server.runtime.session_host import SessionHost
from realizer.server.transports.transport import Transport, requested

# s; a thread waits so long before it takes Python's lock from the event loop. While documents are planned the
# loop pauses every 4 ms (`turns.SLICE`) and takes the lock back at once: with the usual 5 ms threads
# would wait until the end.
THREAD_WAIT = 0.001


async def serve(settings: Settings | None = None) -> None:
    """Serve until SIGINT or SIGTERM; then refuse documents, wait `settings.drain` s for what plays, and end.

    Print the addresses of each transport when it is ready. `settings.workers` > 1 starts as many processes.

    Raises:
        OSError: an address is not available.
        RealizerError: something that the settings name is missing, or a worker cannot start.
    """
    settings = settings or Settings()
    if settings.log == "json":
        write_json()
    if settings.workers > 1:
        from realizer.server.runtime.workers import Workers

        with _bind_errors(settings):
            workers = await Workers(settings, run_worker).start()
        ending = wait_for_signal(signal.SIGINT, signal.SIGTERM)
        try:
            print(*startup_lines(settings, workers.port), sep="\n", flush=True)
            await ending
        finally:
            await workers.close()
        return
    with _bind_errors(settings):
        server = await Server(settings).start()
    await _serve(server, wait_for_signal(signal.SIGINT, signal.SIGTERM))


@contextlib.contextmanager
def _bind_errors(settings: Settings) -> Iterator[None]:
    try:
        yield
    except socket.gaierror as error:
        words = f"setting host: wanted an address of this machine, got {settings.host!r}: {error.strerror}"
        raise SettingsError(words) from None


async def work(settings: Settings, number: int, control: socket.socket) -> None:
    """Serve as a worker the connections that arrive through `control`, until SIGTERM or the parent's end."""
    from realizer.server.runtime.workers import FAULT, READY, receive_sockets

    if settings.log == "json":
        write_json()
    loop = asyncio.get_running_loop()
    try:
        server = await Server(settings, worker=number).start()
    except (RealizerError, OSError, ValueError) as error:  # the parent reports it
        await loop.sock_sendall(control, FAULT + str(error).encode())
        return
    # Before READY, because the parent may terminate a worker that is ready.
    ending = wait_for_signal(signal.SIGTERM)

    def take() -> None:
        try:
            for client in receive_sockets(control):
                server.serve_socket(client)
        except BlockingIOError:
            pass
        except (EOFError, OSError):
            loop.remove_reader(control)
            if not ending.done():
                ending.set_result(None)

    ending.add_done_callback(lambda _: loop.remove_reader(control))
    loop.add_reader(control, take)
    await loop.sock_sendall(control, READY)
    await _serve(server, ending)


def run_worker(settings: Settings, number: int, control: socket.socket) -> None:
    """Run `work` in an event loop of its own."""
    run(work(settings, number, control))


async def _serve(server: Server, ending: Awaitable[None]) -> None:
    disable_automatic_gc()
    sys.setswitchinterval(THREAD_WAIT)
    printing = [asyncio.create_task(_print_lines(transport)) for transport in server.transports]
    try:
        await ending
        await server.drain()
    finally:
        for task in printing:
            task.cancel()
        await server.close()


def wait_for_signal(*signals: signal.Signals) -> asyncio.Future[None]:
    """Return a future that is done when one of these signals has come; a second one ends the process."""
    loop = asyncio.get_running_loop()
    received: asyncio.Future[None] = loop.create_future()

    def handle() -> None:
        for number in signals:
            try:
                loop.remove_signal_handler(number)
            except NotImplementedError:
                signal.signal(number, signal.SIG_DFL)
        if not received.done():
            received.set_result(None)

    for number in signals:
        try:
            loop.add_signal_handler(number, handle)
        except NotImplementedError:  # the event loops of Windows have none
            signal.signal(number, lambda *_: loop.call_soon_threadsafe(handle))
    return received


async def _print_lines(transport: Transport) -> None:
    await transport.ready()
    for line in transport.startup_lines:
        print(line, flush=True)


def run(service: Coroutine[None, None, None]) -> None:
    """Run `serve` or `work` in a new event loop, that of uvloop if it is installed."""
    _raise_file_limit()
    try:
        import uvloop
    except ImportError:
        asyncio.run(service)
    else:
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            runner.run(service)


def _raise_file_limit() -> None:
    """Raise the limit of open files, of which each WebSocket is one, to the system's maximum."""
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return
    _, maximum = resource.getrlimit(resource.RLIMIT_NOFILE)
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_NOFILE, (maximum, maximum))


class Server:
    """The service inside an event loop: `start`, then `close`; or `async with Server(settings) as server`.

    Args:
        worker: number of this process, if it is one of several; its connections come by `serve_socket` only.
    """

    def __init__(self, settings: Settings | None = None, worker: int | None = None) -> None:
        self.settings = settings or Settings()
        self._worker = worker
        self._hub = Hub(self.settings, worker)
        self._web = HttpServer(self._hub)
        self.transports: list[Transport] = []
        self._closed = asyncio.Event()

    @property
    def _sessions(self) -> SessionHost:
        return self._hub.sessions

    @property
    def port(self) -> int:
        """The port of the WebSocket and the page."""
        return self._web.port

    @property
    def url(self) -> str:
        """The address of the WebSocket."""
        return self._web.url

    @property
    def page(self) -> str:
        """The address of the page."""
        return self._web.page

    async def start(self) -> Server:
        """Open the transports; `port` is then the open port.

        Raises:
            OSError: an address is not available.
            ValueError: the scene file is not a scene.
            FaceError: there is no such face.
            RealizerError: a transport needs a package that is not installed.
        """
        await self._hub.ready()
        try:
            # Of several processes, the first one opens what can be open only once.
            wanted = () if self._worker else requested(self.settings)
            others = (make(self._sessions, self.settings) for make in wanted)
            for transport in (self._web, *others):
                if transport is not None:
                    await transport.start()
                    self.transports.append(transport)
        except BaseException:
            await self.close()
            raise
        # Warm up in a thread now; otherwise the first large block or arkit client would stop the event loop.
        asyncio.get_running_loop().run_in_executor(None, _warm_up, self.settings)
        return self

    def serve_socket(self, client: socket.socket) -> None:
        """Serve a connection that another process has accepted."""
        self._web.serve_socket(client)

    async def drain(self) -> None:
        """Refuse connections and documents, and wait at most `settings.drain` seconds for what plays."""
        self._sessions.stop_accepting()
        for transport in self.transports:
            transport.stop_accepting()
        await self._sessions.drain()

    async def close(self) -> None:
        """Close all connections and engines."""
        if self._closed.is_set():
            return
        try:
            await asyncio.gather(*(transport.close() for transport in self.transports))
        finally:
            await self._sessions.close()
            self._closed.set()

    async def wait_closed(self) -> None:
        """Wait until `close` has ended."""
        await self._closed.wait()

    async def __aenter__(self) -> Server:
        return await self.start()

    async def __aexit__(self, *_: object) -> None:
        await self.close()


def _warm_up(settings: Settings) -> None:
    """Load shared data that takes so long to load that it would delay frames."""
    warm_up()
    arkit.warm_up(mapping_of(settings.face, settings.mapping))
