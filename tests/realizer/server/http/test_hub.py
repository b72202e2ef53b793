"""The sessions of an application: their start, the tokens of clients, and bodies of requests."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

pytest.importorskip("starlette", reason="needs the asgi extra")

from realizer.core.settings import Settings, SettingsError
from realizer.server.http.app import create_app
from tests.realizer.server.http.conftest import LIMIT, Served

NOD = '<bml id="a"><head id="n" lexeme="NOD"/></bml>'


@pytest.fixture(scope="module")
def app(serve) -> Iterator[Served]:
    with serve(create_app(Settings(voice="silent"))) as served:
        yield served


@pytest.mark.parametrize("path", ["/check", "/realize", "/sessions/s/bml"])
def test_hub_refuses_bodies_that_are_empty_or_too_long(app, path) -> None:
    assert app.error("POST", path, " ") == (400, "body: wanted BML or a text to speak, got nothing")
    status, words = app.error("POST", path, "x" * (2**20 + 1))
    assert status == 413
    assert words.startswith("body: wanted at most")


def test_hub_asks_for_a_token(serve) -> None:
    with serve(create_app(Settings(voice="silent", token="secret"))) as app:
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
