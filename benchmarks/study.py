"""How often the intervals of a study hold the accuracy of simulated judges, and what pixels alone tell.

    python benchmarks/study.py [--runs 100] [--kit DIR]

Judges are right with a known mean accuracy, which differs between them. With --kit, also: how often a program
that compares the pixels of the faces to choose from, and takes the one in the middle, is right.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np
from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1]))

from realizer_studio.study.answers import read_answers
from realizer_studio.study.items import Item
from realizer_studio.study.kit import key_of
from realizer_studio.study.results import confusion, matching
from tests.studies import key, matches, named, simulated, write

JUDGES, ACCURACIES, SPREADS = (8, 25), (0.5, 0.7, 0.9), (0.0, 0.1)


def held(items: Sequence[Item], judges: int, accuracy: float, spread: float, runs: int) -> int:
    """Return in how many runs the interval of the right answers, or of the hit rates, holds the accuracy."""
    found, chance, count = key(items), np.random.default_rng(0), 0
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(runs):
            rows = simulated(found, judges, accuracy, spread, chance)
            answers = read_answers([write(Path(folder) / "answers.csv", rows)], found)
            line = dict(zip((table := matching(answers)).columns, table.rows[0], strict=True))
            count += line["from"] <= accuracy <= line["to"]
    return count


def unbiased(accuracy: float) -> float:
    """Return the unbiased hit rate of judges who take wrong names, eight of them, equally often."""
    wrong = (1 - accuracy) / 8
    return accuracy**2 / (accuracy + 5 * wrong)


def held_rates(judges: int, accuracy: float, runs: int) -> int:
    found, chance, count = key(named(6)), np.random.default_rng(0), 0
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(runs):
            rows = simulated(found, judges, accuracy, 0.0, chance)
            answers = read_answers([write(Path(folder) / "answers.csv", rows)], found)
            *_, low, high = confusion(answers).rows[-1]
            count += low <= unbiased(accuracy) <= high
    return count


def middle(kit: Path) -> float:
    """Return the share of matching items in which the face nearest to the two others is the right one."""
    truths = json.loads(key_of(kit).read_text("utf-8"))["items"].values()
    hits = []
    for truth in truths:
        if truth["kind"] == "visual" and "check" not in truth:
            files = list(truth["options"])
            pixels = [np.asarray(Image.open(kit / name), np.float64) for name in files]
            apart = [sum(np.abs(one - other).mean() for other in pixels) for one in pixels]
            hits.append(truth["options"][files[int(np.argmin(apart))]] == "right")
    return float(np.mean(hits))


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    options.add_argument("--runs", type=int, default=100)
    options.add_argument("--kit", type=Path)
    given = options.parse_args()
    for judges, accuracy, spread in product(JUDGES, ACCURACIES, SPREADS):
        inside = held(matches(36), judges, accuracy, spread, given.runs)
        print(f"matching, {judges} judges of {accuracy} +- {spread}: held in {inside} of {given.runs}")
    for judges, accuracy in product(JUDGES, ACCURACIES):
        inside = held_rates(judges, accuracy, given.runs)
        print(f"naming, unbiased hit rate of {judges} judges of {accuracy}: held in {inside} of {given.runs}")
    if given.kit:
        print(f"the face in the middle of the three is right in {middle(given.kit):.0%}")
