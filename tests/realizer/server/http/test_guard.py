"""Requests that are refused: by whom they are read, their words, and when to try again."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from realizer.server.runtime.session_registry import JoinError
from tests.realizer.server.http.conftest import Served

NOD = '<bml id="a"><head id="n" lexeme="NOD"/></bml>'


@pytest.fixture(scope="module")
def app(open_service) -> Iterator[Served]:
    with open_service() as served:
        yield served


def test_guard_refuses_bad_names_and_other_origins(app) -> None:
    assert app.error("POST", "/sessions/a%20b/bml", NOD)[0] == 400
    assert app.error("GET", "/sessions/s/feedback?seen=x")[0] == 400
    assert app.error("POST", "/check", NOD, Origin="http://evil.example")[0] == 403
    assert app.error("POST", "/check", NOD, Host="evil.example")[0] == 403
    assert app("PUT", "/check", NOD)[0] == 405


def test_guard_answers_a_wrong_method_in_words(app) -> None:
    assert app.error("PUT", "/check", NOD) == (405, "wanted POST /check, got PUT")
    for path in ("/", "/nothing", "/healthz"):
        status, headers, body = app("POST", path, NOD)
        assert (status, body) == (405, f"wanted GET or HEAD {path}, got POST\n".encode())
        assert set(headers["allow"].split(", ")) == {"GET", "HEAD"}


def test_guard_says_in_words_that_it_has_a_fault(app, monkeypatch, caplog) -> None:
    monkeypatch.setattr("realizer.server.http.app.document_of", None)
    assert app.error("POST", "/realize", NOD) == (500, "an error of the service: its log says which")
    assert "there is no answer to POST /realize" in caplog.text
    assert b"realizer_http_failures_total 1" in app("GET", "/metrics")[2]


def test_guard_says_when_to_try_again(app, monkeypatch) -> None:
    for status, retry in ((503, True), (429, True), (503, False), (400, True)):

        def refuse(*_: object, code: int = status, again: bool = retry, **__: object) -> None:
            raise JoinError(code, "no", retry=again)

        monkeypatch.setattr("realizer.server.http.app.document_of", refuse)
        got, headers, _ = app("POST", "/realize", NOD)
        assert (got, "retry-after" in headers) == (status, retry and status != 400)
