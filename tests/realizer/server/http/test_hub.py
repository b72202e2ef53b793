"""The sessions of an application: their start, the tokens of clients, and bodies of requests."""

from __future__ import annotations

import asyncio
import http.client
import json
import threading
from collections.abc import Iterator
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from realizer.core.settings import Settings, SettingsError
from realizer.server.http import hub, renderings
from realizer.server.http.app import create_app
from realizer.server.serve import Server
from tests.realizer.server.http.conftest import LIMIT, Served, run_service

NOD = '<bml id="a"><head id="n" lexeme="NOD"/></bml>'


@pytest.fixture(scope="module")
def app(open_service) -> Iterator[Served]:
    with open_service() as served:
        yield served


@pytest.mark.parametrize("path", ["/check", "/realize", "/sessions/s/bml"])
def test_hub_refuses_bodies_that_are_empty_or_too_long(app, path) -> None:
    assert app.error("POST", path, " ") == (400, "body: wanted BML or a text to speak, got nothing")
    status, words = app.error("POST", path, "x" * (2**20 + 1))
    assert status == 413
    assert words.startswith("body: wanted at most")


def test_hub_asks_for_a_token(open_service) -> None:
    with open_service(token="secret") as app:
        for method, path in (("POST", "/check"), ("POST", "/sessions/s/bml"), ("DELETE", "/sessions/s")):
            assert app.error(method, path, NOD)[0] == 401
        assert app("POST", "/check", NOD, Authorization="Bearer secret")[0] == 200
        assert app("POST", "/check?token=secret", NOD)[0] == 200
        with connect(app.url.replace("http", "ws") + "/ws?token=secret", open_timeout=LIMIT) as socket:
            socket.send('{"type": "ping"}')
            assert '"pong"' in str(socket.recv(LIMIT))
        with pytest.raises(InvalidStatus) as refused:
            connect(app.url.replace("http", "ws") + "/ws?token=wrong", open_timeout=LIMIT)
        assert refused.value.response.status_code == 401
        wrong, page = app.url.replace("http", "ws") + "/ws?token=wrong", "http://localhost:3000"
        with connect(wrong, origin=page, open_timeout=LIMIT) as socket:  # type: ignore[arg-type]
            assert '"code":"token"' in str(socket.recv(LIMIT))
            with pytest.raises(ConnectionClosed, match="1008"):
                socket.recv(LIMIT)


@pytest.mark.parametrize("passes_lifespan_on", [True, False])
def test_hub_starts_inside_another_application(serve, passes_lifespan_on) -> None:
    fastapi = pytest.importorskip("fastapi")
    face = create_app(Settings(voice="silent"))
    lifespan = face.router.lifespan_context if passes_lifespan_on else None
    outer = fastapi.FastAPI(lifespan=lifespan)
    outer.mount("/face", face)
    with serve(outer) as served:
        assert json.loads(served("GET", "/face/healthz")[2])["status"] == "ok"
        assert json.loads(served("GET", "/face/openapi.json")[2])["servers"] == [{"url": "/face"}]
        with connect(served.url.replace("http", "ws") + "/face/ws", open_timeout=LIMIT) as socket:
            socket.send(NOD)
            assert "predictionFeedback" in str(socket.recv(LIMIT))
        assert served("POST", "/face/check", NOD)[0] == 200


def test_hub_refuses_workers() -> None:
    with pytest.raises(SettingsError, match="an ASGI application is one process"):
        create_app(Settings(workers=2))


@pytest.fixture
def endless(monkeypatch) -> tuple[threading.Event, threading.Event]:
    """Renderings that never end; two events say that one has begun, and that it was cancelled."""
    begun, cancelled = threading.Event(), threading.Event()

    async def run(*_: object) -> None:
        begun.set()
        try:
            await asyncio.Event().wait()
        finally:
            cancelled.set()

    monkeypatch.setattr(renderings, "_run", run)
    return begun, cancelled


def posted(app: Served) -> http.client.HTTPConnection:
    connection = http.client.HTTPConnection(urlsplit(app.url).netloc, timeout=LIMIT)
    connection.request("POST", "/realize?format=fap", NOD)
    return connection


def test_hub_cancels_the_work_for_a_client_that_has_gone(app, endless, monkeypatch) -> None:
    begun, cancelled = endless
    connection = posted(app)
    assert begun.wait(LIMIT)
    connection.close()
    assert cancelled.wait(LIMIT)
    monkeypatch.undo()
    assert app("POST", "/realize?format=fap", NOD)[0] == 200  # one at a time of each address


def test_hub_cancels_work_when_the_service_ends(endless) -> None:
    begun, cancelled = endless
    with run_service(Settings(port=0, voice="silent")) as app:
        connection = posted(app)
        assert begun.wait(LIMIT)
    assert cancelled.is_set()
    answer = connection.getresponse()
    assert (answer.status, answer.headers["Retry-After"]) == (503, "5")
    connection.close()


def test_hub_refuses_what_comes_while_the_service_ends() -> None:
    async def run() -> tuple[int, int]:
        async with Server(Settings(port=0, voice="silent")) as server:
            kept = http.client.HTTPConnection("127.0.0.1", server.port, timeout=LIMIT)

            def ask(method: str, path: str) -> int:
                kept.request(method, path, NOD)
                answer = kept.getresponse()
                answer.read()
                return answer.status

            assert await asyncio.to_thread(ask, "POST", "/check") == 200
            await server.drain()
            statuses = [
                await asyncio.to_thread(ask, *asked) for asked in (("POST", "/check"), ("GET", "/healthz"))
            ]
            kept.close()
            return tuple(statuses)

    assert asyncio.run(run()) == (503, 200)


def test_hub_ends_a_stream_of_feedback_with_the_service() -> None:
    with run_service(Settings(port=0, voice="silent")) as app:
        connection = http.client.HTTPConnection(urlsplit(app.url).netloc, timeout=LIMIT)
        connection.request("GET", "/sessions/s/feedback")
        answer = connection.getresponse()
        assert answer.status == 200
    assert answer.read() == b""
    connection.close()


def test_hub_does_not_wait_for_a_body_for_ever(open_service, monkeypatch) -> None:
    monkeypatch.setattr(hub, "PATIENCE", 0.05)
    with open_service() as app:
        connection = http.client.HTTPConnection(urlsplit(app.url).netloc, timeout=LIMIT)
        connection.putrequest("POST", "/check")
        connection.putheader("Content-Length", "5")
        connection.endheaders(b"He")
        assert connection.getresponse().status == 408
        connection.close()
