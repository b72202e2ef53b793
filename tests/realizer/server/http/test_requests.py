"""Requests for the site, the metrics and the health of a service; their parts, and HTTP responses."""

from __future__ import annotations

import asyncio
import re

import pytest
from websockets.datastructures import Headers
from websockets.http11 import Request

from realizer.core.settings import Settings
from realizer.server.http.access import AccessControl
from realizer.server.http.http_site import HttpResponse
from realizer.server.http.requests import HttpRequests, headers_of, query_of, response_to, session_of
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError


def answer(target: str, settings: Settings | None = None, **headers: str) -> HttpResponse:
    settings = settings or Settings()

    async def run() -> HttpResponse:
        sessions = SessionHost(settings)
        await sessions.start()
        try:
            return await HttpRequests(sessions, settings, AccessControl(settings)).answer(target, headers)
        finally:
            await sessions.close()

    return asyncio.run(run())


def test_requests_for_a_socket_without_one_say_what_was_wanted() -> None:
    refused = answer("/ws?session=a")
    assert (refused.status, refused.body) == (
        426,
        b"wanted a WebSocket at /ws, /check, /design, /label, /studio, got plain HTTP at /ws\n",
    )


def test_requests_for_health_count_the_sessions() -> None:
    assert b'"sessions": 0' in answer("/healthz").body


def test_requests_for_metrics_of_another_worker_are_not_found() -> None:
    assert answer("/metrics?worker=0").status == 200
    assert answer("/metrics?worker=3").body == b"worker: wanted a number of 0..0, got '3'\n"


def test_requests_for_metrics_need_the_token() -> None:
    settings = Settings(token="secret")
    with pytest.raises(JoinError, match="token: wanted that of this service") as refused:
        answer("/metrics", settings)
    assert refused.value.status == 401
    assert answer("/metrics", settings, authorization="Bearer secret").status == 200
    assert answer("/healthz", settings).status == 200


@pytest.mark.parametrize(
    ("query", "session", "seen"),
    [
        ("", None, None),
        ("?session=show", "show", None),
        ("?session=show&seen=0", "show", 0),
        ("?session=a&session=b&seen=1&seen=12", "b", 12),
        ("?session=", None, None),
        ("?token=x&session=a%20b", "a b", None),
    ],
)
def test_session_of_reads_the_address(query: str, session: str | None, seen: int | None) -> None:
    assert session_of(f"/ws{query}") == (session, seen)


@pytest.mark.parametrize("seen", ["", "abc", "-1", "1.5", "9" * 16])
def test_session_of_refuses_a_bad_number_in_seen(seen: str) -> None:
    with pytest.raises(JoinError, match="seen: wanted the number of the last feedback that came") as refused:
        session_of(f"/ws?session=show&seen={seen}")
    assert refused.value.status == 400


def test_session_of_refuses_a_misspelt_parameter() -> None:
    text = "the address has an unknown parameter 'seesion', did you mean session?"
    with pytest.raises(JoinError, match=re.escape(text)) as refused:
        session_of("/ws?seesion=show")
    assert refused.value.status == 400
    assert session_of("/ws?session=show&nocache=7") == ("show", None)


def test_headers_of_and_query_of_take_the_last_of_one_name() -> None:
    assert query_of("/metrics?worker=1&worker=&x") == {"worker": "", "x": ""}
    several = Headers([("X-One", "1"), ("x-one", "2"), ("Host", "here")])
    assert headers_of(Request("/", several)) == {"x-one": "2", "host": "here"}


def test_response_to_has_type_and_length_and_closes() -> None:
    response = response_to(HttpResponse(404, "text/plain", b"no\n", (("Cache-Control", "no-cache"),)))
    assert (response.status_code, response.reason_phrase, response.body) == (404, "Not Found", b"no\n")
    assert response.headers["Content-Length"] == "3"
    assert response.headers["Cache-Control"] == "no-cache"
    assert response.headers["X-Content-Type-Options"] == "nosniff"
    assert response.headers["Connection"] == "close"
