"""A table of results of many texts: how long each takes to say, and how far the face moves.

  python examples/batch_table.py texts.txt results.csv

For films of many documents, by several processes, there is `realizer batch`.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import realizer


def main(texts: str, table: str) -> None:
    lines = [line for line in Path(texts).read_text("utf-8").splitlines() if line.strip()]
    with Path(table).open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["text", "seconds", "words", "jaw", "head", "warnings"])
        for line in lines:
            r = realizer.realize(realizer.enrich(line), seed=1)
            jaw = r.faps.values[:, 2].max()  # FAP 3, in units of the mouth-nose distance / 1024
            turns = r.faps.values[:, 47:50]  # FAPs 48 to 50: pitch, yaw and roll, in 1e-5 rad
            head = (turns.max(axis=0) - turns.min(axis=0)).max() * 1e-5
            rows.writerow(
                [line, f"{r.duration:.2f}", len(line.split()), round(jaw), f"{head:.3f}", len(r.warnings)]
            )
    print(f"{len(lines)} texts in {table}")


if __name__ == "__main__":
    if len(sys.argv) <= 2:
        sys.exit(__doc__)
    main(*sys.argv[1:3])
