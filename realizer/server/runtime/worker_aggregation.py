"""Aggregation of the workers' metrics and health."""

import asyncio
import json
import logging
import re
import socket
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping

from realizer.server.http.metrics import sum_samples

log = logging.getLogger(__name__)

# Workers that have not answered by then are left out; health checks do not wait long themselves.
PATIENCE, HASTE = 3.0, 1.0  # s
LONGEST = 16 * 1024  # bytes of the head of a request
LARGEST = 2**20  # bytes of an answer
OK = re.compile(rb"HTTP/1\.[01] 200 ")
LENGTH = re.compile(rb"(?im)^(Content-Length:\s*)\d+")
UNAVAILABLE = (
    b"HTTP/1.1 503 Service Unavailable\r\nContent-Type: text/plain; charset=utf-8\r\n"
    b"Content-Length: 17\r\nRetry-After: 5\r\nConnection: close\r\n\r\nno worker answers"
)


def _combined_health(texts: Mapping[int, str], workers: int) -> str:
    """Return the sums of the workers' `/healthz`, and which workers are silent.

    The status is "partly" if some are, or else that of a worker that is not "ok".
    """
    sums: Counter[str] = Counter()
    for text in texts.values():
        sums.update({name: n for name, n in json.loads(text).items() if isinstance(n, int)})
    silent = [number for number in range(workers) if number not in texts]
    worst = next((status for text in texts.values() if (status := json.loads(text)["status"]) != "ok"), "ok")
    health: dict[str, object] = {"status": "partly" if silent else worst, **sums, "workers": workers}
    return json.dumps(health | ({"silent": silent} if silent else {}))


# Path -> (answers by worker, number of workers) -> their combination.
_COMBINE: Mapping[str, Callable[[Mapping[int, str], int], str]] = {
    "/metrics": lambda texts, workers: sum_samples(texts),
    "/healthz": _combined_health,
}


def is_for_all_workers(line: str) -> bool:
    """Return whether the first line of a request is for all workers: no session's, and naming no worker."""
    path, query = _request_target(line)
    return path in _COMBINE and not re.search(r"(^|&)worker=", query)


def _request_target(line: str) -> tuple[str, str]:
    method, _, rest = line.partition(" ")
    path, _, query = rest.partition(" ")[0].partition("?")
    return (path, query) if method == "GET" else ("", "")


async def aggregate(
    client: socket.socket, workers: int, give: Callable[[int, socket.socket], Awaitable[None]]
) -> None:
    """Answer a request for the metrics, or the health, of all workers.

    Each worker gets the request with its token and checks it itself. If one refuses it, so does the answer.
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
            words = str(error) or "it takes too long"
            log.warning("worker %d does not answer for %s: %s", number, path, words)
            return None

    answers = {k: a for k, a in enumerate(await asyncio.gather(*map(ask, range(workers)))) if a}
    await loop.sock_sendall(client, _combined(answers, path, workers))


async def _ask_worker(
    request: bytes, number: int, give: Callable[[int, socket.socket], Awaitable[None]]
) -> bytes:
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


def _combined(answers: Mapping[int, bytes], path: str, workers: int) -> bytes:
    """Return one answer for those of the workers, by their numbers: the first refusal if there is one."""
    if not answers:
        return UNAVAILABLE
    for answer in answers.values():
        if not OK.match(answer):
            return answer
    parts = {number: answer.partition(b"\r\n\r\n") for number, answer in answers.items()}
    texts = {number: text.decode() for number, (_, _, text) in parts.items()}
    body = _COMBINE[path](texts, workers).encode()
    head, end, _ = next(iter(parts.values()))
    return LENGTH.sub(rb"\g<1>%d" % len(body), head) + end + body
