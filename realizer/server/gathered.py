"""A request in, which each worker answers for itself; one answer for all of them out."""

from __future__ import annotations

import asyncio
import logging
import re
import socket
from collections.abc import Awaitable, Callable

from realizer.server.metrics import summed

__all__ = ["gathered", "is_for_all"]

log = logging.getLogger(__name__)

# A worker that has not answered by then is left out.
PATIENCE = 3.0  # s
LONGEST = 16 * 1024  # bytes of a request before its end
LARGEST = 2**20  # bytes of an answer
OK = re.compile(rb"HTTP/1\.[01] 200 ")
LENGTH = re.compile(rb"(?im)^(Content-Length:\s*)\d+")
UNAVAILABLE = b"HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"


def is_for_all(line: str) -> bool:
    """Whether the first line of a request asks what all workers have counted, and not one that it names."""
    method, _, rest = line.partition(" ")
    path, _, query = rest.partition(" ")[0].partition("?")
    return method == "GET" and path == "/metrics" and not re.search(r"(^|&)worker=", query)


async def gathered(
    client: socket.socket, workers: int, give: Callable[[int, socket.socket], Awaitable[None]]
) -> None:
    """Answer a request for the metrics of all workers.

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

    async def ask(number: int) -> bytes | None:
        try:
            async with asyncio.timeout(PATIENCE):
                return await _asked(request, number, give)
        except (OSError, TimeoutError) as error:
            log.warning("worker %d tells nothing of its metrics: %s", number, error or "it takes too long")
            return None

    answers = await asyncio.gather(*map(ask, range(workers)))
    await loop.sock_sendall(client, _one({k: answer for k, answer in enumerate(answers) if answer}))


async def _asked(request: bytes, number: int, give: Callable[[int, socket.socket], Awaitable[None]]) -> bytes:
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


def _one(answers: dict[int, bytes]) -> bytes:
    """The answers of workers, by their numbers, as one; the first refusal where there is one."""
    if not answers:
        return UNAVAILABLE
    refusal = next((answer for answer in answers.values() if not OK.match(answer)), None)
    if refusal is not None:
        return refusal
    parted = {number: answer.partition(b"\r\n\r\n") for number, answer in answers.items()}
    body = summed({number: text.decode() for number, (_, _, text) in parted.items()}).encode()
    head, end, _ = next(iter(parted.values()))
    return LENGTH.sub(rb"\g<1>%d" % len(body), head) + end + body
