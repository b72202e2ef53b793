"""Requests by other methods, and bytes that are no request, at the real transport."""

from __future__ import annotations

import asyncio
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from realizer.core.settings import Settings
from realizer.server.serve import Server

LIMIT = 60  # s; a hung test ends


def answers(*requests: bytes) -> list[bytes]:
    """Return what the service answers to each request on a connection of its own."""

    async def ask(port: int, request: bytes) -> bytes:
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        for part in (request[:2], request[2:]):
            writer.write(part)
            await writer.drain()
        answer = await reader.read()
        writer.close()
        return answer

    async def run() -> list[bytes]:
        async with asyncio.timeout(LIMIT), Server(Settings(port=0, voice="silent")) as server:
            return [await ask(server.port, request) for request in requests]

    return asyncio.run(run())


def request(method: str, target: str = "/", body: str = "") -> bytes:
    head = f"{method} {target} HTTP/1.1\r\nHost: localhost\r\nContent-Length: {len(body)}\r\n\r\n"
    return (head + body).encode()


def test_protocol_answers_a_post_with_a_hint() -> None:
    for answer in answers(
        request("POST", body="hello"), request("POST", "/realize", "<bml id='b'/>" * 10_000)
    ):
        assert answer.startswith(b"HTTP/1.1 404 ")
        assert b"send BML through the WebSocket at /ws" in answer


@pytest.mark.parametrize("method", ["HEAD", "PUT", "DELETE", "OPTIONS", "PATCH", "CONNECT", "TRACE"])
def test_protocol_refuses_other_methods(method: str) -> None:
    (answer,) = answers(request(method))
    head, _, body = answer.partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 405 ")
    assert b"\r\nAllow: GET" in head
    assert body == (b"" if method == "HEAD" else b"wanted GET\n")


def test_protocol_answers_a_get_that_comes_in_parts() -> None:
    (answer,) = answers(request("GET", "/healthz"))
    assert answer.startswith(b"HTTP/1.1 200 ")


@settings(max_examples=10, deadline=None)
@given(st.lists(st.binary(max_size=40) | st.text("/%.?[]:#@", max_size=20).map(str.encode), min_size=40))
def test_protocol_answers_any_bytes_without_an_error(targets: list[bytes]) -> None:
    for answer in answers(
        *(b"GET /" + target + b" HTTP/1.1\r\nHost: localhost\r\n\r\n" for target in targets)
    ):
        assert re.match(rb"HTTP/1\.1 [24]\d\d |$", answer)
