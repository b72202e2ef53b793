"""The service as an application under uvicorn, and inside another application."""

from __future__ import annotations

import http.client
import json
import time
from collections.abc import Iterator
from functools import partial
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from realizer.server.http.access import LEEWAY
from realizer.server.http.app import event_of
from tests.realizer.server.http.conftest import LIMIT, Served

NOD = '<bml id="a"><head id="n" lexeme="NOD"/></bml>'


@pytest.fixture(scope="module")
def app(open_service) -> Iterator[Served]:
    with open_service() as served:
        yield served


def events(app: Served, session: str, **headers: str) -> Iterator[tuple[str, str, str]]:
    """Yield name, id and data of the events of a session, from the beginning of the stream."""
    connection = http.client.HTTPConnection(urlsplit(app.url).netloc, timeout=LIMIT)
    connection.request("GET", f"/sessions/{session}/feedback", headers=headers)
    answer = connection.getresponse()
    assert (answer.status, answer.headers["Content-Type"].split(";")[0]) == (200, "text/event-stream")
    fields: dict[str, str] = {}
    try:
        for line in answer:
            name, _, value = line.decode().rstrip("\n").partition(": ")
            if name:
                fields[name] = fields[name] + "\n" + value if name in fields else value
            elif fields:
                yield fields["event"], fields.get("id", ""), fields["data"]
                fields = {}
    finally:
        answer.close()
        connection.close()


def test_app_serves_page_health_and_faces(app) -> None:
    assert json.loads(app("GET", "/healthz")[2])["status"] == "ok"
    assert app("GET", "/faces/ada")[2][:4] == b"glTF"
    assert app("GET", "/nothing")[0] == 404


def test_app_refuses_to_get_what_is_posted(app) -> None:
    status, headers, body = app("GET", "/realize")
    assert (status, headers["allow"]) == (405, "POST")
    assert json.loads(body) == {"error": "wanted POST /realize, got GET"}
    assert app("GET", "/sessions/show")[1]["allow"] == "DELETE"


def test_app_describes_itself(app) -> None:
    paths = json.loads(app("GET", "/openapi.json")[2])["paths"]
    assert set(paths) >= {"/realize", "/check", "/sessions/{session}/bml", "/sessions/{session}/feedback"}


def test_app_plays_over_its_websocket(app) -> None:
    with connect(app.url.replace("http", "ws") + "/ws?session=w", open_timeout=LIMIT) as socket:
        socket.send('{"type": "subscribe", "stream": "fap", "encoding": "json"}')
        socket.send(NOD)
        got = ""
        while "a:end" not in got:
            got += str(socket.recv(LIMIT))
    assert '"type":"subscribed"' in got
    assert '"type":"fap"' in got


def test_app_plays_documents_that_are_posted_and_streams_their_feedback(app) -> None:
    status, _, answer = app("POST", "/sessions/show/bml", NOD)
    assert (status, json.loads(answer)) == (202, {"session": "show"})
    got = []
    for name, number, data in events(app, "show", **{"Last-Event-ID": "0"}):
        got.append((name, number))
        if 'id="a:end"' in data:
            break
    assert [number for _, number in got] == [str(k + 1) for k in range(len(got))]
    assert {name for name, _ in got} == {"feedback"}


def test_app_speaks_a_text_that_is_posted(app) -> None:
    app("POST", "/sessions/talk/bml", "Hello there")
    feedback = (data for _, _, data in events(app, "talk", **{"Last-Event-ID": "0"}))
    assert 'id="text1:start"' in next(data for data in feedback if "blockProgress" in data)


def test_app_ends_a_session_with_its_connections(app) -> None:
    app("POST", "/sessions/over/bml", NOD)
    with connect(app.url.replace("http", "ws") + "/ws?session=over", open_timeout=LIMIT) as socket:
        assert app("DELETE", "/sessions/over")[0] == 204
        with pytest.raises(ConnectionClosed, match="the session was ended"):
            list(iter(partial(socket.recv, LIMIT), None))
    assert app.error("DELETE", "/sessions/over") == (404, "session: wanted one that is open, got 'over'")


def test_app_checks_documents(app) -> None:
    faulty = '<bml id="a"><head id="n" lexeme="NOPE"/></bml>'
    (finding,) = json.loads(app("POST", "/check", faulty)[2])
    at = faulty.index('"NOPE"') + 1
    assert (finding["line"], finding["column"] - at in (0, 1), finding["id"]) == (1, True, "a:n")
    assert json.loads(app("POST", "/check", NOD)[2]) == []


def test_app_says_where_there_is_a_websocket(app) -> None:
    status, headers, body = app("GET", "/ws?session=a")
    assert (status, headers["upgrade"]) == (426, "websocket")
    assert body.startswith(b"wanted a WebSocket at /ws, /check, ")
    assert body.endswith(b", got plain HTTP at /ws\n")
    with pytest.raises(InvalidStatus) as refused:
        connect(app.url.replace("http", "ws") + "/nothing", open_timeout=LIMIT)
    assert refused.value.response.status_code == 404
    assert b"got a WebSocket at /nothing" in refused.value.response.body


@pytest.mark.parametrize("path", ["/check", "/realize", "/sessions/s/bml"])
@pytest.mark.parametrize("sign", ["\0", "\x1b", "\ufffe"])
def test_app_answers_a_text_with_signs_that_xml_cannot_hold(app, path, sign) -> None:
    status, _, answer = app("POST", path, f"Hello{sign}there")
    assert status in (200, 202) or (status, json.loads(answer)["error"]) == (
        400,
        f"body: wanted characters XML can hold, got U+{ord(sign):04X} at 5",
    )


def test_app_plays_documents_in_their_own_encoding(app) -> None:
    said = '<bml id="a"><speech id="s"><text>Größe</text><sync id="é"/></speech></bml>'
    app("POST", "/sessions/latin/bml", f'<?xml version="1.0" encoding="iso-8859-1"?>{said}'.encode("latin-1"))
    feedback = (data for _, _, data in events(app, "latin", **{"Last-Event-ID": "0"}))
    assert "\ufffd" not in next(data for data in feedback if "Feedback" in data)


def test_app_closes_a_websocket_that_fails(app, monkeypatch, caplog) -> None:
    monkeypatch.setattr("realizer.server.http.page_tools.lint", None)
    with connect(app.url.replace("http", "ws") + "/check", open_timeout=LIMIT) as socket:
        socket.send("<bml/>")
        with pytest.raises(ConnectionClosed, match=r"1011.*internal error"):
            socket.recv(LIMIT)
    assert "the WebSocket at /check failed" in caplog.text


def test_app_limits_the_connections_of_an_address(open_service) -> None:
    with open_service(max_connections=1) as app, connect(app.url.replace("http", "ws") + "/ws"):
        for method, path in (("POST", "/sessions/s/bml"), ("GET", "/sessions/s/feedback")):
            status, headers, body = app(method, path, NOD if method == "POST" else b"")
            assert (status, headers["retry-after"]) == (429, "5")
            assert b"1 connections from 127.0.0.1 are open: wanted fewer" in body


def test_app_ends_a_stream_of_feedback_when_its_token_expires(open_service) -> None:
    jwt = pytest.importorskip("jwt")
    with open_service(jwt_key="secret" * 6) as app:
        token = jwt.encode({"exp": time.time() - LEEWAY + 1.0}, "secret" * 6, "HS256")
        assert list(events(app, "s", Authorization=f"Bearer {token}")) == []


def test_event_of_names_elements_and_messages() -> None:
    assert event_of('<blockProgress r:seq="7">\n</blockProgress>') == (
        'event: feedback\nid: 7\ndata: <blockProgress r:seq="7">\ndata: </blockProgress>\n\n'
    )
    assert event_of('{"type":"gap"}') == 'event: gap\ndata: {"type":"gap"}\n\n'
