"""Measures the time from a document to its first feedback and to the first frame of its plan, over a socket.

Run: python benchmarks/serve.py
"""

from __future__ import annotations

import asyncio
import json
import random
import statistics
import subprocess
import sys
import time

from stopwatch import handle_help, noise
from websockets.asyncio.client import connect

from realizer.protocol.wire import unpack

ROUNDS = 30
FPS = 25
BEHAVIOURS = "".join(f'<faceLexeme id="f{k}" lexeme="SMILE" amount="0.9" end="0.6"/>' for k in range(20))
DOCUMENTS = {
    "one nod": '<head id="n" lexeme="NOD"/>',
    "20 behaviours": BEHAVIOURS,
    "speech": '<speech id="s"><text>Hello, how are you today?</text></speech>',
}


async def measure(url: str, body: str) -> tuple[list[float], list[float], list[float]]:
    """Return milliseconds to the first feedback, to the block start, and to the first frame after it."""
    first, planned, shown = [], [], []
    chance = random.Random(0)
    async with connect(url, compression=None) as socket:
        await socket.send(json.dumps({"type": "subscribe", "stream": "fap", "fps": FPS}))
        for k in range(ROUNDS):
            await asyncio.sleep(chance.random() / FPS)  # at a random time between two frames
            start = time.perf_counter()
            await socket.send(f'<bml id="b{k}" composition="REPLACE">{body}</bml>')
            predictions: list[float] = []
            block_start = None
            async for message in socket:
                now = 1000 * (time.perf_counter() - start)
                if isinstance(message, bytes):
                    if block_start is not None and unpack(message).time >= block_start:
                        shown.append(now)
                        break
                elif "predictionFeedback" in message and f'"b{k}"' in message:
                    predictions.append(now)
                elif f'"b{k}:start"' in message:
                    planned.append(now)
                    block_start = float(message.partition('globalTime="')[2].partition('"')[0])
            first.append(predictions[0])
    return first, planned, shown


async def main() -> None:
    handle_help(__doc__)
    print(noise())
    # The service is a separate process; otherwise its time would include that of the client.
    command = [sys.executable, "-m", "realizer", "serve", "--port", "0"]
    service = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert service.stdout is not None
    url = service.stdout.readline().split()[2].rstrip(",")
    try:
        print(f"ms, median of {ROUNDS}; a frame waits for its time: {1000 / FPS / 2:.0f} ms on average")
        for name, body in DOCUMENTS.items():
            first, planned, shown = map(statistics.median, await measure(url, body))
            print(f"{name:14} first feedback {first:5.1f}   block start {planned:5.1f}   frame {shown:5.1f}")
    finally:
        service.terminate()
        service.wait(10)


if __name__ == "__main__":
    asyncio.run(main())
