"""The picture of strands that all cards of a face share, drawn into a corner of its albedo map."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from realizer.core.array_types import Float64, UInt8
from realizer.facebuild.skin.atlas import HAIR

SEED = 23
LEVEL = 0.80  # mean brightness of a strand, 0..1


@dataclass(frozen=True, slots=True)
class Strip:
    """A column of the picture: what a card shows.

    Attributes:
        first, last: its sides, 0..1 across the picture.
        strands: how many; width: of one, as a share of the strip's.
        sway: how far a strand strays, as a share of the strip's width; waves: how often.
        ends: the part of the height after which strands end.
        begins: the part of the height before which strands begin.
        tip: how far strands meet at the end, 0..1.
    """

    first: float
    last: float
    strands: int
    width: float
    sway: float = 0.06
    waves: float = 0.7
    ends: float = 0.75
    begins: float = 0.03
    tip: float = 0.3


STRIPS: Mapping[str, Strip] = {
    "dense": Strip(0.00, 0.16, 60, 0.050, begins=0.12),
    "locks": Strip(0.16, 0.32, 40, 0.055, 0.10, 1.0, 0.55, 0.16, 0.5),
    "loose": Strip(0.32, 0.45, 17, 0.050, 0.12, 1.0, 0.45, 0.12, 0.5),
    "sparse": Strip(0.45, 0.56, 8, 0.058, 0.14, 0.8, 0.35, 0.30, 0.3),
    "cap": Strip(0.56, 0.72, 90, 0.055, 0.03, 0.6, 1.0, 0.40, 0.0),
    "coils": Strip(0.72, 0.86, 16, 0.065, 0.16, 5.0, 0.50, 0.08, 0.2),
    "brow": Strip(0.86, 0.92, 3, 0.15, 0.14, 0.4, 0.50, 0.25, 0.5),
    "lash": Strip(0.92, 0.95, 1, 0.45, 0.0, 0.0, 0.85, 0.0, 0.0),
    "stubble": Strip(0.95, 1.00, 3, 0.14, 0.10, 0.5, 0.70, 0.20, 0.0),
}
MARGIN = 0.06  # share of a strip that stays empty at each side


def place(strip: str, across: Float64, along: Float64) -> Float64:
    """Return u, v (..., 2) in the maps of places in a strip: across it and along its hairs, 0..1 each."""
    column = STRIPS[strip]
    left, top, right, bottom = HAIR
    u = column.first + (column.last - column.first) * np.asarray(across, float)
    v = 0.004 + 0.992 * np.asarray(along, float)
    u, v = np.broadcast_arrays(left + (right - left) * u, top + (bottom - top) * v)
    return np.stack([u, v], axis=-1)


def hair_texture(size: int) -> UInt8:
    """Return the picture (size, size, 4) sRGB with alpha: strands in grey, brightest 255, mean `LEVEL`."""
    rng = np.random.default_rng(SEED)
    out = np.zeros((size, size, 4))
    out[..., :3] = LEVEL
    for name, strip in STRIPS.items():
        first, last = round(strip.first * size), round(strip.last * size)
        out[:, first:last] = _strip(strip, size, last - first, rng, name == "cap")
    return np.asarray(np.rint(out.clip(0, 1) * 255), np.uint8)


def _strip(strip: Strip, height: int, width: int, rng: np.random.Generator, whole: bool) -> Float64:
    """Return the picture (height, width, 4) of a strip, 0..1; `whole`: strands reach its sides and end."""
    v = (np.arange(height) + 0.5)[:, None] / height
    x = (np.arange(width) + 0.5) / width
    tone, seen = np.full((height, width), LEVEL), np.zeros((height, width))
    margin = 0.0 if whole else MARGIN
    wide = max(strip.width, 1.1 / width)
    for middle in rng.permutation(np.linspace(margin, 1 - margin, strip.strands + 2)[1:-1]):
        turn, size, bend = rng.uniform(0, 2 * np.pi), rng.uniform(0.4, 1), rng.uniform(-1, 1)
        sway = strip.sway * size * np.sin(2 * np.pi * strip.waves * v * rng.uniform(0.8, 1.2) + turn)
        to = 0.5 + (middle - 0.5) * (1 - strip.tip * v**2)
        centre = to + (sway + strip.sway * 0.5 * bend * v) * np.minimum(1, 4 * v + 0.3)
        centre = centre.clip(margin + wide / 2, 1 - margin - wide / 2)
        begin = strip.begins * rng.uniform(0, 1) ** (1.0 if whole else 2.0)
        end = 1.1 if whole else strip.ends + (1 - strip.ends) * rng.uniform(0, 1)
        # Thin at the root and at the tip.
        taper = np.clip((end - v) / 0.30, 0, 1) ** 0.6 * np.clip(0.35 + (v - begin) / 0.16, 0, 1)
        on = np.clip((v - begin) / 0.08, 0, 1) * (v < end)
        half = wide / 2 * rng.uniform(0.75, 1.25) * np.maximum(taper, 0.25)
        cover = np.clip((half - np.abs(x - centre)) * width + 0.5, 0, 1) * on * np.clip(taper * 1.6, 0, 1)
        light = LEVEL + 0.22 * rng.uniform(-1, 1)
        # A strand is round: brighter along its middle.
        light = light * (0.90 + 0.16 * np.clip(1 - np.abs(x - centre) / half, 0, 1))
        tone += cover * (light - tone)
        seen = np.maximum(seen, cover)
    return np.stack([tone, tone, tone, seen], axis=-1)
