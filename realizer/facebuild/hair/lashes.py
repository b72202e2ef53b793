"""Lashes on the edges of the lids, which turn down as the lids close."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.facebuild.hair.cards import Patch, ribbons
from realizer.facebuild.hair.strands import unit
from realizer.facebuild.hair.texture import LEVEL
from realizer.facebuild.parts import smooth

UPPER, LOWER = 46, 20  # lashes of a lid
ROWS = 4
CURL = 0.55  # how much further than its root a lash's tip goes when the lid falls
WIDE = 0.00036  # m; half of it is seen


@dataclass(frozen=True, eq=False)
class Margin:
    """The edge of a lid.

    Attributes:
        edge: vertices of the mesh from the inner to the outer corner.
        fold: vertices on the lid's outside, which move less.
        upper: whether it is the upper lid.
        centre: (3,) metres, the eyeball's.
    """

    edge: Sequence[int]
    fold: Sequence[int]
    upper: bool
    centre: Float64


def lashes(at: Float64, margin: Margin, colour: Any, length: float, rng: Any) -> Patch:
    """Return the lashes of a lid: longest in the outer half, in small groups.

    Args:
        at: (n, 3) metres, the mesh; colour: sRGB; length: relative to plain lashes.
    """
    edge = at[list(margin.edge)]
    run = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(edge, axis=0), axis=1))])
    run /= run[-1]
    count = UPPER if margin.upper else LOWER
    k = np.arange(count)
    t = 0.08 + 0.90 * (k + 0.5 + rng.uniform(-0.35, 0.35, count)) / count
    # Three lashes at a time lean together.
    lean = np.repeat(rng.uniform(-0.25, 0.25, count // 3 + 1), 3)[:count] + 0.16 * (1 - k % 3)

    def on_edge(t: Float64) -> Float64:
        return np.stack([np.interp(t, run, edge[:, axis]) for axis in range(3)], 1)

    root = on_edge(t)
    along = unit(on_edge(np.minimum(t + 0.02, 1)) - on_edge(t - 0.02))
    out = unit(root - margin.centre)
    long = (0.0026 + 0.0044 * smooth(t, 0.0, 0.70)) * (1 - 0.30 * smooth(t, 0.86, 1.0))
    long = long * length * rng.uniform(0.75, 1.15, count) * (1.0 if margin.upper else 0.50)
    fan = ((t - 0.42) * 1.1 + 0.5 * lean)[:, None]
    s = np.linspace(0, 1, ROWS)[:, None, None]
    up = np.array([0, 1.0, 0])
    rise = (-0.15 + 1.25 * s) if margin.upper else (-0.35 - 0.35 * s)
    ways = unit(out * (1 - 0.45 * s) + along * fan * (0.6 + 0.4 * s) + up * rise)
    steps = ways[:-1] * long[:, None] / (ROWS - 1)
    places = np.concatenate([np.zeros_like(root)[None], np.cumsum(steps, axis=0)]) + root + out * 0.0002
    ups = unit(np.cross(np.broadcast_to(along, ways.shape), ways))
    ups = ups * np.sign((ups * up).sum(axis=-1, keepdims=True) + 1e-9)
    j = np.clip(np.searchsorted(run, t) - 1, 0, len(edge) - 2)
    share = (t - run[j]) / (run[j + 1] - run[j])
    folds = np.array(margin.fold)
    near = folds[((root[:, None] - at[folds]) ** 2).sum(axis=2).argmin(axis=1)]
    bent = (CURL if margin.upper else 0.0) * np.linspace(0, 1, ROWS)
    shares = np.stack(
        [np.outer(1 - share, 1 + bent), np.outer(share, 1 + bent), np.tile(-bent, (count, 1))], axis=2
    )
    ends = np.array(margin.edge)
    skin = np.stack([ends[j], ends[j + 1], near], axis=1)
    tint = np.tile(np.clip(np.array(colour, float) / LEVEL, 0, 255), (count, 1))
    width = np.full((count, ROWS), WIDE if margin.upper else 0.7 * WIDE)
    return ribbons(
        places.transpose(1, 0, 2), ups.transpose(1, 0, 2), width, ["lash"] * count, tint,
        np.full((count, ROWS), 0.9), 0.0, (skin, shares),
    )  # fmt: skip
