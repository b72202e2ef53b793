"""The answers of all workers to one request: sums, refusals, silent workers."""

from __future__ import annotations

import asyncio
import json
import socket

import pytest

from realizer.server.http.metrics import GAUGES, Metrics
from realizer.server.runtime import worker_aggregation as module
from realizer.server.runtime.worker_aggregation import aggregate, is_for_all_workers

REQUEST = b"GET /metrics?token=x HTTP/1.1\r\nHost: here\r\nAuthorization: Bearer y\r\n\r\n"


def answer(status: str, body: str) -> bytes:
    head = f"HTTP/1.1 {status}\r\nContent-Type: text/plain\r\nContent-Length: {len(body)}\r\n"
    return f"{head}X-Content-Type-Options: nosniff\r\n\r\n{body}".encode()


def of(number: int) -> bytes:
    return answer("200 OK", Metrics(worker=number).text(dict.fromkeys(GAUGES, number + 1), {}))


def health(sessions: int, status: str = "ok") -> bytes:
    return answer("200 OK", json.dumps({"status": status, "sessions": sessions, "connections": 2}))


def asked(*answers: bytes | None, request: bytes = REQUEST) -> tuple[bytes, list[bytes]]:
    """Return a client's answer if the workers answer so (None: not at all), and their requests."""
    heard: list[bytes] = []
    kept: list[socket.socket] = []

    async def give(number: int, given: socket.socket) -> None:
        one = given.dup()
        kept.append(one)
        one.setblocking(False)

        async def work() -> None:
            loop = asyncio.get_running_loop()
            heard.append(await loop.sock_recv(one, 10_000))
            if (said := answers[number]) is not None:
                for k in range(0, len(said), 1000):  # in several writes
                    await loop.sock_sendall(one, said[k : k + 1000])
                one.close()

        tasks.append(asyncio.create_task(work()))

    async def run() -> bytes:
        ours, theirs = socket.socketpair()
        with ours, theirs:
            ours.sendall(request)
            if not request.endswith(b"\r\n\r\n"):
                ours.shutdown(socket.SHUT_WR)
            theirs.setblocking(False)
            await aggregate(theirs, len(answers), give)
            await asyncio.gather(*tasks)
            theirs.close()
            return b"".join(iter(lambda: ours.recv(10_000), b""))

    tasks: list[asyncio.Task[None]] = []
    got = asyncio.run(run())
    for one in kept:
        one.close()
    return got, heard


def test_aggregate_passes_the_request_to_each_worker() -> None:
    got, heard = asked(of(0), of(1))
    assert heard == [REQUEST, REQUEST]
    head, _, body = got.partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 200 OK\r\n")
    assert b"nosniff" in head
    assert b"Content-Length: %d\r\n" % len(body) in head
    assert b"\nrealizer_sessions 3.0\n" in body


def test_aggregate_returns_the_refusal_of_a_worker() -> None:
    refusal = answer("401 Unauthorized", "token: wanted one")
    assert asked(of(0), refusal)[0] == refusal


def test_aggregate_leaves_out_silent_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "PATIENCE", 0.2)
    got, _ = asked(of(0), None)
    assert b'realizer_worker_sessions{worker="0"} 1.0\n' in got
    assert b'worker="1"' not in got
    assert asked(b"")[0].startswith(b"HTTP/1.1 503 ")


def test_aggregate_sums_health_and_names_silent_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "HASTE", 0.2)
    request = REQUEST.replace(b"/metrics", b"/healthz")

    def health_of(*answers: bytes | None) -> tuple[bytes, object]:
        head, _, body = asked(*answers, request=request)[0].partition(b"\r\n\r\n")
        assert b"Content-Length: %d" % len(body) in head
        return head[9:12], json.loads(body)

    whole = {"status": "ok", "sessions": 3, "connections": 4, "workers": 2}
    assert health_of(health(1), health(2)) == (b"200", whole)
    degraded = {**whole, "status": "degraded"}
    assert health_of(health(1), health(2, "degraded")) == (b"200", degraded)
    partly = {"status": "partly", "sessions": 1, "connections": 2, "workers": 3, "silent": [1, 2]}
    assert health_of(health(1), None, b"") == (b"200", partly)
    got, _ = asked(None, b"", request=request)
    assert got.startswith(b"HTTP/1.1 503 ")
    assert got.endswith(b"no worker answers")
    assert b"Content-Length: %d\r\n" % len(b"no worker answers") in got


def test_aggregate_ignores_half_a_request() -> None:
    assert asked(of(0), request=b"GET /metrics HTTP/1.1\r\nHost") == (b"", [])


@pytest.mark.parametrize(
    ("line", "all_"),
    [
        ("GET /metrics HTTP/1.1", True),
        ("GET /metrics?token=x HTTP/1.1", True),
        ("GET /metrics?networker=1 HTTP/1.1", True),
        ("GET /metrics?worker=1 HTTP/1.1", False),
        ("GET /metrics?token=x&worker=1 HTTP/1.1", False),
        ("GET /metricsx HTTP/1.1", False),
        ("GET /healthz HTTP/1.1", True),
        ("GET /healthz?worker=0 HTTP/1.1", False),
        ("GET /ws?session=metrics HTTP/1.1", False),
        ("POST /metrics HTTP/1.1", False),
        ("", False),
    ],
)
def test_is_for_all_workers_needs_a_request_without_a_worker(line: str, all_: bool) -> None:
    assert is_for_all_workers(line) is all_
