"""Measures whether the memory of a service stays flat while its sessions speak.

Run: python benchmarks/soak.py [--minutes 60] [--sessions 20] [options of serve]

Each session is a client that plays a document of speech, head, face and gaze and waits for its end before it
sends the next one, so that no backlog grows; it receives the FAP frames and the sound too. The journal is
SQLite. The resident memory is printed each minute, and at the end its slope from the fourth part of the time
on, in % an hour of the memory.
"""

from __future__ import annotations

import argparse
import asyncio
import random
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from sessions import resident, running_service

from realizer.client import connect

WORDS = [
    "the",
    "weather",
    "is",
    "fine",
    "today",
    "and",
    "we",
    "walk",
    "along",
    "river",
    "to",
    "see",
    "old",
    "bridge",
    "with",
    "its",
    "seven",
    "arches",
]
DOCUMENT = """<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="b{n}">
  <speech id="s"><text>{text}.</text></speech>
  <head id="h" lexeme="NOD" start="s:start"/>
  <faceLexeme id="f" lexeme="SMILE" amount="0.6" start="s:start" end="s:end"/>
</bml>"""


async def speak(url: str, number: int, until: float, counts: dict[str, int]) -> None:
    """Play documents in a session of its own until a time of the monotonic clock."""
    words = random.Random(number)
    async with connect(f"{url}?session=soak-{number}") as client:
        listeners = [asyncio.create_task(drain(stream)) for stream in (client.faps(fps=25), client.sound())]
        while time.monotonic() < until:
            text = " ".join(words.choices(WORDS, k=words.randint(4, 14)))
            await client.play(DOCUMENT.format(n=counts["documents"], text=text))
            counts["documents"] += 1
        for listener in listeners:
            listener.cancel()


async def drain(stream: object) -> None:
    async for _ in stream:  # type: ignore[attr-defined]
        pass


async def soak(url: str, service: int, sessions: int, minutes: float) -> list[float]:
    """Return the resident memory in MB at the end of each minute."""
    begin, counts, rows = time.monotonic(), {"documents": 0}, [resident(service)]
    speakers = [
        asyncio.create_task(speak(url, number, begin + 60 * minutes, counts)) for number in range(sessions)
    ]
    print(f"minute 0: {rows[0]:.0f} MB", flush=True)
    for minute in range(1, round(minutes) + 1):
        await asyncio.sleep(max(0.0, begin + 60 * minute - time.monotonic()))
        rows.append(resident(service))
        print(f"minute {minute}: {rows[-1]:.1f} MB, {counts['documents']} documents", flush=True)
    await asyncio.gather(*speakers)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--sessions", type=int, default=20)
    options, rest = parser.parse_known_args()
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "realizer", "serve", "--port", "0"]
        command += ["--journal", str(Path(folder) / "journal.sqlite"), *rest]
        with running_service(command) as (url, service):
            rows = asyncio.run(soak(url, service, options.sessions, options.minutes))
    settled = rows[len(rows) // 4 :]
    slope = float(np.polyfit(np.arange(len(settled)), settled, 1)[0]) if len(settled) > 1 else 0.0
    print(f"slope {slope:+.2f} MB a minute, {slope * 60 / settled[0]:+.0%} an hour of {settled[0]:.0f} MB")


if __name__ == "__main__":
    main()
