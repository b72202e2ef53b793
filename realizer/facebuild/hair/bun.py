"""A bun wound of strands."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.facebuild.hair.cards import Patch, ribbons
from realizer.facebuild.hair.strands import unit
from realizer.facebuild.hair.style import Style
from realizer.facebuild.person.scalp import Scalp

ROWS, TURNS, RINGS = 6, 26, 7


def bun(scalp: Scalp, style: Style, tints: Callable[[int], Float64], rng: Any) -> Patch:
    """Return cards that wind around a flattened ball at the end of the parting."""
    pole = unit(np.array(style.parting[0], float))
    radii = np.array(style.bun, float)
    crest = scalp.skull(pole[None])[0]
    side = unit(np.cross([0, 1.0, 0], pole))
    frame = np.stack([side, np.cross(pole, side), pole])
    centre = crest + pole * radii[2] * 0.72
    places, ups, widths, lights = [], [], [], []
    s = np.linspace(0, 1, ROWS + 1)
    for ring in range(RINGS):
        polar = np.pi * (0.10 + 0.78 * (ring + 0.5) / RINGS)
        count = max(4, round(TURNS * np.sin(polar) / 2))
        for k in range(count):
            turn = 2 * np.pi * ((k + rng.uniform(0, 1)) / count) + s * rng.uniform(1.3, 1.9)
            lean = polar + (s - 0.5) * rng.uniform(-0.35, 0.75)
            lock = 1 + 0.06 * rng.uniform(-1, 1) + 0.07 * np.sin(np.pi * s) - 0.05
            ball = np.stack([np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.cos(lean)], 1)
            places.append(centre + (ball * radii * lock[:, None]) @ frame)
            ups.append(unit((ball / radii) @ frame))
            widths.append(radii[0] * 0.42 * rng.uniform(0.7, 1.2) * (0.6 + 0.4 * np.sin(np.pi * s)))
            lights.append((0.55 + 0.45 * np.sin(np.pi * s)) * rng.uniform(0.7, 1.0))
    number = len(places)
    return ribbons(
        np.array(places), np.array(ups), np.array(widths), ["dense"] * number, tints(number),
        np.array(lights), style.gloss,
    )  # fmt: skip
