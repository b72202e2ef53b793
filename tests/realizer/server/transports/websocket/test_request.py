"""The requests of WebSockets, and HTTP responses."""

from __future__ import annotations

import pytest
from websockets.datastructures import Headers
from websockets.http11 import Request

from realizer.server.http.http_site import HttpResponse
from realizer.server.http.requests import headers_of, query_of, response_to, session_of
from realizer.server.runtime.session_registry import JoinError


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
