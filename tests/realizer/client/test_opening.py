"""Opening of connections: versions, tokens and refusals of the real service."""

from __future__ import annotations

import asyncio

import pytest

from realizer.client import ClientError, connect
from realizer.core.settings import Settings
from realizer.server.serve import Server
from tests.realizer.client.service import LIMIT, WAIT, serving


def test_connect_refuses_a_service_of_another_version(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("realizer.client.connection.PROTOCOL", 2)

    async def test(url: str) -> None:
        with pytest.raises(ClientError, match="wanted version 1 of the protocol, got 2") as caught:
            async with connect(url):
                pass
        assert caught.value.code == "version"

    serving(test)


def test_connect_sends_its_token() -> None:
    secret = "a-token-of-many-letters-and-0123456789"

    async def run() -> None:
        settings = Settings(port=0, voice="silent", token=secret)
        async with asyncio.timeout(LIMIT), Server(settings) as server:
            async with connect(server.url, token=secret) as client:
                assert (await client.play(WAIT.format("b"))).id == "b:end"
            for token in (None, "another"):
                with pytest.raises(ClientError, match="token"):
                    async with connect(server.url, token=token):
                        pass

    asyncio.run(run())


def test_connect_raises_the_refusal_of_an_address() -> None:
    async def test(url: str) -> None:
        for bad, says in (
            (f"{url}?session=a b", "session: wanted 1..64 letters"),
            (
                f"{url}?session=a&seen=abc",
                "seen: wanted the number of the last feedback that came, got 'abc'",
            ),
            (url.replace("/ws", "/other"), "wanted a WebSocket at /ws, /check, /design, /label, /studio"),
            (url.replace("ws:", "http:"), "http"),
        ):
            with pytest.raises(ClientError, match=says):
                async with connect(bad.replace(" ", "%20")):
                    pass

    serving(test)


def test_connect_raises_os_error_where_nothing_listens() -> None:
    async def run() -> None:
        async with Server(Settings(port=0, voice="silent")) as server:
            url = server.url
        with pytest.raises(OSError, match="Connect") as caught:
            async with connect(url):
                pass
        assert str(caught.value).endswith(f": wanted a service at {url}; `realizer serve` starts one")

    asyncio.run(run())


def test_connect_refuses_what_is_no_address() -> None:
    with pytest.raises(TypeError, match="url: wanted a string"):
        connect(8765)  # type: ignore[arg-type]
