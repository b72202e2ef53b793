"""Stimuli of an experiment: each emotion at two strengths on two faces, with the times of every word.

  python examples/experiment.py stimuli

Everything random comes from seeds, so the same command writes the same bytes. The table `stimuli.csv` has a
row for each film; the `.TextGrid` beside it opens in Praat.
"""

from __future__ import annotations

import csv
import itertools
import sys
from pathlib import Path

import realizer

EMOTIONS = ("joy", "anger", "sadness")
STRENGTHS = (0.5, 1.0)
FACES = ("ada", "ben")
TEXT = "They will come back tomorrow."
DOCUMENT = """<bml id="b" xmlns:r="urn:bml-realizer:1">
  <speech id="s" start="0.5"><text>{text}</text></speech>
  <r:emotion id="e" name="{emotion}" intensity="{strength}" start="0" end="s:end+0.5"/>
</bml>"""


def main(folder: str, suffix: str = ".mp4") -> None:
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    with (target / "stimuli.csv").open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["file", "face", "emotion", "strength", "seed", "seconds"])
        for seed, (face, emotion, strength) in enumerate(itertools.product(FACES, EMOTIONS, STRENGTHS)):
            bml = DOCUMENT.format(text=TEXT, emotion=emotion, strength=strength)
            r = realizer.realize(bml, face=face, seed=seed)
            name = f"{seed:02}-{face}"  # does not tell the answer to those who rate
            r.save(target / f"{name}{suffix}", size=(256, 256))
            r.save(target / f"{name}.textgrid")
            rows.writerow([name + suffix, face, emotion, strength, seed, f"{r.duration:.3f}"])


if __name__ == "__main__":
    if len(sys.argv) <= 1:
        sys.exit(__doc__)
    main(*sys.argv[1:3])
