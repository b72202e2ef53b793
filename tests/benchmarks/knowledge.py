"""What the knowledge of faces costs: `python tests/benchmarks/knowledge.py` prints medians in ms.

Rules of co-occurrence on 250 frames, and a text of 1,000 words, beside the noise of the machine.
"""

from __future__ import annotations

import random

import numpy as np
from stopwatch import helped, median, noise

from realizer.animation.axis import AU_NAMES
from realizer.animation.cooccurrence import bounds
from realizer.core.array_types import Float32
from realizer.knowledge.enrich import Enricher
from realizer.tables.cooccurrence import rules

SENTENCES = (
    "Are you really sure about it?", "This is nonsense!", "There was a terrible accident on the road.",
    "Yes.", "I am not afraid of you, but of what comes after you.", "Go away!",
    "The train leaves at nine and arrives at noon.",
)  # fmt: skip


def apply_rules(aus: Float32) -> Float32:
    live = np.flatnonzero(aus.any(axis=1))
    known = bounds(rules(), tuple(live.tolist()))
    return known.scored(aus[live], known.moving(aus[live]))


def main() -> None:
    helped(__doc__)
    print(noise())
    dice = np.random.default_rng(1)
    every = dice.random((len(AU_NAMES()), 250), np.float32)
    few = np.where(dice.random((len(AU_NAMES()), 1)) < 0.2, every, 0).astype(np.float32)
    for says, aus in (("all", every), ("a fifth", few)):
        spent = median(lambda aus=aus: apply_rules(aus))  # type: ignore[misc]
        print(f"rules on 250 frames, {says} of {len(aus)} units up  {spent:6.3f} ms")
    chosen = random.Random(1)
    text = ""
    while len(text.split()) < 1000:
        text += chosen.choice(SENTENCES) + " "
    block = Enricher().text(text)
    placed = sum(bool(getattr(node, "because", None)) for node in block.behaviours)
    spent = median(lambda: Enricher().text(text))
    print(f"enrich {len(text.split())} words, {placed} expressions  {spent:6.1f} ms")


if __name__ == "__main__":
    main()
