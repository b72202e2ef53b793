"""Measures how long one client makes another one of the same service wait.

Run: python benchmarks/neighbour.py [PATTERN ...] [--size 9900] [--seconds 12]

A neighbour gets 25 FAP frames a second and sends a ping each 20 ms. Beside it a client sends nothing, then
one document of each pattern of `tests/worst_documents.py` (as large as the limits allow), 600,000 pongs, and
1,000 texts to /check. Printed are how late the neighbour's worst frame and its worst answer to a ping were,
how late /healthz answered, and how soon the document was planned or refused.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import sys
import time
import urllib.request
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from websockets.asyncio.client import ClientConnection, connect

from tests.programs import serving
from tests.worst_documents import PATTERNS, document

FPS, PING = 25.0, 0.02
LIMIT = 1 << 20  # bytes of a document
PONGS = bytes([0x8A, 0x80, *os.urandom(4)]) * 1000


class Neighbour:
    """A client that notes when its frames and its answers came."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.reset()

    def reset(self) -> None:
        """Forget what has come."""
        self.last = time.monotonic()
        self.frame = self.ping = self.health = 0.0  # s, how late the worst was

    async def read(self) -> None:
        """Note each frame and each answer."""
        async for message in self.socket:
            now = time.monotonic()
            if isinstance(message, bytes):
                self.frame, self.last = max(self.frame, now - self.last - 1 / FPS), now
            elif message.startswith("{") and (answer := json.loads(message))["type"] == "pong":
                self.ping = max(self.ping, now - float(answer["id"]))

    async def ask(self) -> None:
        """Send pings."""
        while True:
            await self.socket.send(json.dumps({"type": "ping", "id": str(time.monotonic())}))
            await asyncio.sleep(PING)

    async def get(self, url: str) -> None:
        """Get a URL again and again."""
        while True:
            began = time.monotonic()
            await asyncio.to_thread(lambda: urllib.request.urlopen(url, timeout=60).read())
            self.health = max(self.health, time.monotonic() - began)
            await asyncio.sleep(0.1)


def largest(pattern: str, size: int) -> str:
    """Return the largest document of a pattern within the limits."""
    while len(text := document(pattern, size)) > LIMIT:
        size = size * 19 // 20
    return text


async def play(address: str, text: str, seconds: float) -> str:
    """Send a document; return when it was planned or refused."""
    async with connect(address, max_size=None, ping_interval=None) as socket:
        began, planned = time.monotonic(), "not planned"
        await socket.send(text)
        try:
            async with asyncio.timeout(seconds):
                async for message in socket:
                    words = str(message)
                    is_plan = (
                        'status="LURKING"' in words or 'status="IN_EXEC"' in words or 'id="worst"' in words
                    )
                    if planned == "not planned" and is_plan and 'status="IN_PREP"' not in words:
                        planned = f"{time.monotonic() - began:.2f} s"
        except TimeoutError:
            pass
        return planned


async def flood(address: str, seconds: float) -> str:
    """Send pongs, as fast as they are read."""
    async with connect(address, max_size=None, ping_interval=None) as socket:
        try:
            async with asyncio.timeout(seconds):
                for _ in range(600):
                    socket.transport.write(PONGS)
                    await asyncio.sleep(0.001)
                await asyncio.sleep(seconds)
        except TimeoutError:
            pass
    return ""


async def check(address: str, seconds: float) -> str:
    """Have many texts checked."""
    text, count = document("linked", 200), 0
    async with connect(address.replace("/ws", "/check"), max_size=None, ping_interval=None) as socket:
        try:
            async with asyncio.timeout(seconds):
                for _ in range(1000):
                    await socket.send(text)
                    await socket.recv()
                    count += 1
        except TimeoutError:
            pass
    return f"{count} texts"


async def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("pattern", nargs="*", default=["nothing", *PATTERNS, "pongs", "check"])
    parser.add_argument("--size", type=int, default=9900)
    parser.add_argument("--seconds", type=float, default=12.0)
    given = parser.parse_args()
    print("beside            frame late   ping   /healthz   planned")
    for pattern in given.pattern:
        with serving() as (address, _):
            async with connect(address, max_size=None, ping_interval=None) as socket:
                await socket.send('{"type":"subscribe","stream":"fap","encoding":"binary","fps":25}')
                neighbour = Neighbour(socket)
                url = address.replace("ws", "http", 1).replace("/ws", "/healthz")
                work = (neighbour.read(), neighbour.ask(), neighbour.get(url))
                tasks = [asyncio.create_task(task) for task in work]
                await asyncio.sleep(4)
                neighbour.reset()
                match pattern:
                    case "nothing":
                        await asyncio.sleep(given.seconds)
                        found = ""
                    case "pongs":
                        found = await flood(address, given.seconds)
                    case "check":
                        found = await check(address, given.seconds)
                    case _:
                        found = await play(address, largest(pattern, given.size), given.seconds)
                for task in tasks:
                    task.cancel()
                print(
                    f"{pattern:16} {1000 * neighbour.frame:8.0f} ms {1000 * neighbour.ping:4.0f} ms"
                    f"  {1000 * neighbour.health:5.0f} ms   {found}",
                    flush=True,
                )


if __name__ == "__main__":
    asyncio.run(main())
