"""The application in a thread of its own: under uvicorn, or as `realizer serve` runs it."""

from __future__ import annotations

import asyncio
import contextlib
import json
import threading
from collections.abc import Callable, Iterator
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
import uvicorn

from realizer.core.settings import Settings
from realizer.server.http.app import create_app
from realizer.server.serve import Server
from tests.waiting import LIMIT


class Served:
    """A served application: `get("/healthz")` and the like return (status, headers, body)."""

    def __init__(self, port: int) -> None:
        self.url = f"http://127.0.0.1:{port}"

    def __call__(
        self, method: str, path: str, body: bytes | str = b"", **headers: str
    ) -> tuple[int, dict[str, str], bytes]:
        data = body.encode() if isinstance(body, str) else body
        request = Request(self.url + path, data or None, headers, method=method)
        try:
            with urlopen(request, timeout=LIMIT) as answer:
                return answer.status, dict(answer.headers), answer.read()
        except HTTPError as error:
            with error:
                return error.code, dict(error.headers), error.read()

    def error(self, method: str, path: str, body: bytes | str = b"", **headers: str) -> tuple[int, str]:
        status, _, text = self(method, path, body, **headers)
        return status, json.loads(text)["error"]


@pytest.fixture(scope="module")
def serve() -> Callable[[Any], contextlib.AbstractContextManager[Served]]:
    """Return a function that serves an application on a free port."""

    @contextlib.contextmanager
    def served(app: Any) -> Iterator[Served]:
        config = uvicorn.Config(app, port=0, log_level="warning", timeout_graceful_shutdown=1)
        server = uvicorn.Server(config)
        started = threading.Event()
        startup = server.startup

        async def announced(*arguments: Any, **named: Any) -> None:
            await startup(*arguments, **named)
            started.set()

        server.startup = announced
        thread = threading.Thread(target=server.run)
        thread.start()
        assert started.wait(LIMIT)
        yield Served(server.servers[0].sockets[0].getsockname()[1])
        server.should_exit = True
        thread.join(LIMIT)
        assert not thread.is_alive()

    return served


@contextlib.contextmanager
def run_service(settings: Settings) -> Iterator[Served]:
    started, servers, loop = threading.Event(), [], asyncio.new_event_loop()

    async def run() -> None:
        async with Server(settings) as server:
            servers.append(server)
            started.set()
            await ending.wait()

    ending = asyncio.Event()
    thread = threading.Thread(target=lambda: loop.run_until_complete(run()))
    thread.start()
    assert started.wait(LIMIT)
    yield Served(servers[0].port)
    loop.call_soon_threadsafe(ending.set)
    thread.join(LIMIT)
    assert not thread.is_alive()
    loop.close()


@pytest.fixture(scope="module", params=["uvicorn", "serve"])
def open_service(request, serve) -> Callable[..., contextlib.AbstractContextManager[Served]]:
    """Return a function that serves the application with some settings."""
    if request.param == "serve":
        return lambda **settings: run_service(Settings(port=0, voice="silent", **settings))
    return lambda **settings: serve(create_app(Settings(voice="silent", **settings)))
