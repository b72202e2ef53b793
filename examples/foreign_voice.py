"""Speech of another voice, with the times of its words: the face speaks it, and says what was heard.

  realizer serve
  python examples/foreign_voice.py ws://127.0.0.1:8765/ws speech.wav words.csv

words.csv has lines such as `0.12,Hello`: seconds, word. Without it, lips follow the sound alone.
"""

from __future__ import annotations

import asyncio
import csv
import sys
from pathlib import Path

from realizer.client import ClientError, connect


def read_words(path: str) -> list[tuple[float, str]]:
    with Path(path).open(encoding="utf-8", newline="") as file:
        return [(float(start), word) for start, word in csv.reader(file)]


async def main(address: str, sound: str, table: str | None = None) -> None:
    words = None if table is None else read_words(table)
    async with connect(address) as client:
        try:
            end = await client.say(Path(sound).read_bytes(), words=words)
        except ClientError as error:  # such as words behind the end of the sound
            sys.exit(f"the service refused the sound: {error}")
        print(f"spoken until {end.global_time:.2f} s")


if __name__ == "__main__":
    if len(sys.argv) <= 2:
        sys.exit(__doc__)
    try:
        asyncio.run(main(*sys.argv[1:4]))
    except OSError as error:  # such as no service
        sys.exit(str(error))
