"""Aggregation of the workers' metrics and health."""

from __future__ import annotations

import asyncio
import json
import logging
import re
import socket
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping

from realizer.server.http.metrics import sum_samples

log = logging.getLogger(__name__)

# A worker that has not answered by then is left out.
PATIENCE = 3.0  # s
# Of who asks whether all is well: such checks do not wait long themselves.
HASTE = 1.0  # s
LONGEST = 16 * 1024  # bytes of a request before its end
LARGEST = 2**20  # bytes of an answer
OK = re.compile(rb"HTTP/1\.[01] 200 ")
LENGTH = re.compile(rb"(?im)^(Content-Length:\s*)\d+")
UNAVAILABLE = (
    b"HTTP/1.1 503 Service Unavailable\r\nContent-Type: text/plain; charset=utf-8\r\n"
    b"Content-Length: 17\r\nConnection: close\r\n\r\nno worker answers"
)


def _combined_health(texts: Mapping[int, str], workers: int) -> str:
    """What `/healthz` tells of all: the sums, and who does not serve; it is well while one does."""
    sums: Counter[str] = Counter()
    for text in texts.values():
        sums.update({name: n for name, n in json.loads(text).items() if isinstance(n, int)})
    silent = [number for number in range(workers) if number not in texts]
    told: dict[str, object] = {"status": "partly" if silent else "ok", **sums, "workers": workers}
    return json.dumps(told | ({"silent": silent} if silent else {}))


# What is asked of all workers -> what their answers come to.
_SUMS: Mapping[str, Callable[[Mapping[int, str], int], str]] = {
    "/metrics": lambda texts, workers: sum_samples(texts),
    "/healthz": _combined_health,
}


def is_for_all_workers(line: str) -> bool:
    """Whether the first line of a request asks what all workers can tell, and not one that it names."""
    path, query = _request_target(line)
    return path in _SUMS and not re.search(r"(^|&)worker=", query)


def _request_target(line: str) -> tuple[str, str]:
    """Path and query of the first line of a request; ("", "") of one that does not only look."""
    method, _, rest = line.partition(" ")
    path, _, query = rest.partition(" ")[0].partition("?")
    return (path, query) if method == "GET" else ("", "")


async def aggregate(
    client: socket.socket, workers: int, give: Callable[[int, socket.socket], Awaitable[None]]
) -> None:
    """Answer a request for the metrics, or the health, of all workers.

    Each gets it as it came, with its token, over a socket of our own, and lets in whom it would let in: what
    it refuses is refused.

    Args:
        give: hands a socket to the worker of that number, as it hands over a client's.
    """
    loop = asyncio.get_running_loop()
    request = b""
    while b"\r\n\r\n" not in request:
        data = await loop.sock_recv(client, LONGEST)
        if not data or len(request) > LONGEST:
            return
        request += data

    path, _ = _request_target(request.partition(b"\r\n")[0].decode("latin-1"))

    async def ask(number: int) -> bytes | None:
        try:
            async with asyncio.timeout(HASTE if path == "/healthz" else PATIENCE):
                return await _ask_worker(request, number, give)
        except (OSError, TimeoutError) as error:
            log.warning("worker %d tells nothing for %s: %s", number, path, str(error) or "it takes too long")
            return None

    answers = await asyncio.gather(*map(ask, range(workers)))
    told = {k: answer for k, answer in enumerate(answers) if answer}
    await loop.sock_sendall(client, _combine(told, lambda texts: _SUMS[path](texts, workers)))


async def _ask_worker(
    request: bytes, number: int, give: Callable[[int, socket.socket], Awaitable[None]]
) -> bytes:
    """What one worker answers."""
    loop = asyncio.get_running_loop()
    ours, theirs = socket.socketpair()
    with ours:
        ours.setblocking(False)
        with theirs:
            await give(number, theirs)
        await loop.sock_sendall(ours, request)
        answer = b""
        while (data := await loop.sock_recv(ours, 2**16)) and len(answer) < LARGEST:
            answer += data
    return answer


def _combine(answers: Mapping[int, bytes], come_to: Callable[[Mapping[int, str]], str]) -> bytes:
    """The answers of workers, by their numbers, as one; the first refusal where there is one."""
    if not answers:
        return UNAVAILABLE
    refusal = next((answer for answer in answers.values() if not OK.match(answer)), None)
    if refusal is not None:
        return refusal
    parted = {number: answer.partition(b"\r\n\r\n") for number, answer in answers.items()}
    body = come_to({number: text.decode() for number, (_, _, text) in parted.items()}).encode()
    head, end, _ = next(iter(parted.values()))
    return LENGTH.sub(rb"\g<1>%d" % len(body), head) + end + body
