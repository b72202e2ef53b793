"""Measures rules and expressions: `python benchmarks/knowledge.py` prints medians in ms.

The program applies the rules of co-occurrence to 250 frames, and adds expressions to a text of 1,000 words.
"""

from __future__ import annotations

import random

import numpy as np
from stopwatch import handle_help, median, noise

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
    known = bounds(rules())
    return known.scored(aus, known.moving(aus))


def main() -> None:
    handle_help(__doc__)
    print(noise())
    dice = np.random.default_rng(1)
    every = dice.random((len(AU_NAMES()), 250), np.float32)
    print(f"rules on 250 frames of {len(every)} units  {median(lambda: apply_rules(every)):6.3f} ms")
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
