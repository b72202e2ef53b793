"""Requests for the site, the metrics and the health of a service."""

from __future__ import annotations

import asyncio

import pytest

from realizer.core.settings import Settings
from realizer.server.http.access import AccessControl
from realizer.server.http.http_site import HttpResponse
from realizer.server.http.requests import HttpRequests
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
        b"wanted a WebSocket at /ws, /check, /studio, /label, got plain HTTP at /ws\n",
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
