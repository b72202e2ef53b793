"""ASGI applications under uvicorn on the loopback address; tests of them are skipped without the extras."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

httpx = pytest.importorskip("httpx", reason="needs the extra test")
uvicorn = pytest.importorskip("uvicorn", reason="needs the extra asgi")
pytest.importorskip("starlette", reason="needs the extra asgi")

NOD = '<bml id="{}"><head id="n" lexeme="NOD" start="0" end="0.3"/></bml>'
LIMIT = 30  # s


@contextmanager
def serving(app: Any) -> Iterator[str]:
    """Serve an application in a thread; yield its address without the scheme."""
    server = uvicorn.Server(uvicorn.Config(app, port=0, log_level="warning", ws="websockets-sansio"))
    opened = threading.Event()
    start = server.startup

    async def startup(*args: Any, **named: Any) -> None:
        await start(*args, **named)
        opened.set()

    server.startup = startup
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        assert opened.wait(LIMIT)
        port = server.servers[0].sockets[0].getsockname()[1]
        yield f"127.0.0.1:{port}"
    finally:
        server.should_exit = True
        thread.join(LIMIT)
