"""Measures the text layer: `python benchmarks/text.py` prints processor time per 1,000 characters.

The limit of 1 ms is meant for a machine on which nothing else runs.
"""

from __future__ import annotations

import time

from stopwatch import handle_help

from realizer.text.spoken import spoken_text

LIMIT = 1.0  # ms per 1,000 characters
TEXTS = {
    "prose": "This is a simple text without a link, and with more words for you to read aloud. ",
    "numbers": "It costs $12.50 on May 5, 2024, which is 20% less than the 15.60 that others ask here. ",
    "answer": "**Sure!** Here is what *I* would do:\n\n1. Open [the page](https://x.org/a/b) and log in.\n"
    "2. Choose `Settings`, then wait about five minutes until everything is there.\n\nThat is all 😀. ",
    "emphasis": "**Sure!** Here is what *I* would do, and it is not much: open [the page](https://x.org). ",
}


def main() -> None:
    handle_help(__doc__)
    for name, text in TEXTS.items():
        text *= 20_000 // len(text)
        best = float("inf")
        for _ in range(5):
            begin = time.process_time()
            spoken_text(text)
            best = min(best, time.process_time() - begin)
        per_thousand = 1000 * best / (len(text) / 1000)
        print(f"{name:10} {per_thousand:6.3f} ms per 1,000 characters (limit {LIMIT} ms)")


if __name__ == "__main__":
    main()
