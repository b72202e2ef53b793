"""Beards and moustaches: short cards that are rooted in the skin, as brows are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import triangle_normals
from realizer.facebuild.hair.cards import Patch, ribbons
from realizer.facebuild.hair.strands import unit
from realizer.facebuild.parts import smooth
from realizer.facebuild.person.scalp import Scalp

COUNT = 950  # cards of a full beard
LONG, WIDE = 0.024, 0.0046  # m, of a card on the chin of a full beard
SHORT = 0.006  # m, of the shortest beard
SEGMENTS = 2
LEAN = 0.45, 0.22  # how far hairs stand off the skin at the root and at the tip
ROOT = 0.0002  # m that a root lies above the skin
DEEPEST = 0.004  # m that a piece of a hair is lifted


def beard(
    skin: tuple[Float64, Int32],
    scalp: Scalp,
    where: Float64,
    points: Mapping[str, Float64],
    amount: float,
    tint: Float64,
    rng: Any,
) -> Patch:
    """Return the cards of a beard.

    Args:
        skin: places (n, 3) and triangles of the skin's mesh; scalp: over the skin that is drawn.
        where: (n,) 0..1, where a beard grows.
        points: feature points, metres.
        amount: 0..1, how long it is: from SHORT to SHORT + LONG.
        tint: (COUNT, 3) sRGB, a colour for each card.
    """
    at, triangles = skin
    area = np.linalg.norm(triangle_normals(at, triangles), axis=1)
    # The strip between nose and lip is narrow, and hardly any triangle lies in it wholly.
    middle = at[triangles].mean(axis=1)
    lip = (middle[:, 1] > points["2.2"][1]) & (np.abs(middle[:, 0]) < points["8.3"][0] + 0.008)
    low = np.where(lip, 0.05, 0.3)
    weight = area * np.where(lip, 3, 1) * smooth(where[triangles].mean(axis=1), low, low + 0.35)
    pick = rng.choice(len(triangles), COUNT, p=weight / weight.sum())
    shares = rng.dirichlet((1.0, 1.0, 1.0), COUNT)
    corners = triangles[pick]
    root = (at[corners] * shares[..., None]).sum(axis=1)
    lift, ups = scalp.lift(root)
    root = root + ups * (ROOT - lift).clip(-0.002, 0.002)[:, None]
    lip, chin, corner = (points[name] for name in ("8.1", "2.1", "8.3"))
    above = (root[:, 1] > lip[1] - 0.004) & (np.abs(root[:, 0]) < corner[0] + 0.012)
    # A moustache is combed to both sides, a beard down and a little forwards.
    side = np.tanh(root[:, 0] / 0.004)
    down = np.stack([0.25 * root[:, 0] / corner[0], np.full(COUNT, -1.0), np.full(COUNT, 0.15)], 1)
    combed = np.stack([0.9 * side, np.full(COUNT, -0.75), np.zeros(COUNT)], 1)
    way = unit(np.where(above[:, None], combed, down) + 0.22 * rng.normal(size=(COUNT, 3)))
    way = unit(way - ups * (way * ups).sum(axis=1, keepdims=True))
    near_chin = smooth(np.linalg.norm((root - chin) * [1, 0.7, 1], axis=1), 0.060, 0.015)
    long = (SHORT + LONG * amount) * (0.35 + 0.65 * near_chin) * rng.uniform(0.7, 1.2, COUNT)
    long = np.where(above, np.minimum(long, 0.011 * rng.uniform(0.7, 1.1, COUNT)), long)
    s = np.linspace(0, 1, SEGMENTS + 1)
    lean = np.interp(s, (0, 1), LEAN)[:, None, None]
    steps = unit(way + lean * ups) * (long / SEGMENTS)[:, None]
    places = root + np.concatenate([np.zeros((1, COUNT, 3)), np.cumsum(steps[1:], axis=0)])
    # They lie on the skin where it turns away, under the chin above all.
    for k in range(1, SEGMENTS + 1):
        lift, ups_there = scalp.lift(places[k])
        places[k:] += ups_there * (ROOT - lift).clip(0, DEEPEST)[:, None]
    places = places.transpose(1, 0, 2)
    thin = (where[corners] * shares).sum(axis=1) < rng.uniform(0.4, 1.0, COUNT)
    width = WIDE * rng.uniform(0.7, 1.2, (COUNT, 1)) * np.array([0.8, 1.0, 0.7]) * min(1, 0.5 + amount)
    light = np.broadcast_to(0.55 + 0.45 * s, (COUNT, SEGMENTS + 1)) * rng.uniform(0.7, 1, (COUNT, 1))
    return ribbons(
        places, np.repeat(ups[:, None], SEGMENTS + 1, axis=1), width,
        np.where(thin, "wire", "tuft"), tint, light, 0.15,
        (corners, np.repeat(shares[:, None], SEGMENTS + 1, axis=1)),
    )  # fmt: skip
