"""Lashes, beards and moustaches: cards that are rooted in the skin.

A hair's root follows the triangle of the skin in which it lies. The rest of the hair has a fixed offset from
the root, which rotates with the head: stretched skin moves hairs apart, and does not stretch them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import triangle_normals
from realizer_studio.faces.hair.cards import LEVEL, Patch, ribbons
from realizer_studio.faces.hair.strands import unit
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.person.scalp import Scalp

BEARD_CARDS = 1900  # cards of a full beard
LONG, WIDE = 0.024, 0.0046  # m, of a card on the chin of a full beard
SHORT = 0.006  # m, of the shortest beard
SEGMENTS = 2
LEAN = 0.45, 0.22  # slope of hairs away from the skin at root and tip
ROOT = 0.0002  # m; height of roots above the skin
DEEPEST = 0.004  # m by which a piece of a hair is lifted at most


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
        skin: vertices (n, 3) and triangles of the skin's mesh; scalp: of the subdivided skin.
        where: (n,) 0..1, the weight of a beard.
        points: feature points, metres.
        amount: 0..1, for lengths from SHORT to SHORT + LONG.
        tint: (BEARD_CARDS, 3) sRGB, a colour for each card.
    """
    at, triangles = skin
    area = np.linalg.norm(triangle_normals(at, triangles), axis=1)
    # The strip between nose and lip is narrow: few triangles lie completely in it.
    middle = at[triangles].mean(axis=1)
    lip = (middle[:, 1] > points["2.2"][1]) & (np.abs(middle[:, 0]) < points["8.3"][0] + 0.008)
    low = np.where(lip, 0.15, 0.2)
    weight = area * np.where(lip, 5, 1) * smooth(where[triangles].mean(axis=1), low, low + 0.35)
    # Stratified sampling, because independent random positions would leave holes.
    even = (np.arange(BEARD_CARDS) + rng.uniform(0, 1, BEARD_CARDS)) / BEARD_CARDS
    pick = np.searchsorted(np.cumsum(weight / weight.sum()), even).clip(0, len(triangles) - 1)
    shares = rng.dirichlet((1.0, 1.0, 1.0), BEARD_CARDS)
    corners = triangles[pick]
    root = (at[corners] * shares[..., None]).sum(axis=1)
    lift, normals = scalp.lift(root)
    root = root + normals * (ROOT - lift).clip(-0.002, 0.002)[:, None]
    lip, chin, corner = (points[name] for name in ("8.1", "2.1", "8.3"))
    above = (root[:, 1] > lip[1] - 0.004) & (np.abs(root[:, 0]) < corner[0] + 0.012)
    # A moustache is combed sideways, a beard down and a little forwards.
    side = np.tanh(root[:, 0] / 0.004)
    down = np.stack(
        [0.25 * root[:, 0] / corner[0], np.full(BEARD_CARDS, -1.0), np.full(BEARD_CARDS, 0.15)], 1
    )
    combed = np.stack([0.9 * side, np.full(BEARD_CARDS, -0.75), np.zeros(BEARD_CARDS)], 1)
    direction = unit(np.where(above[:, None], combed, down) + 0.22 * rng.normal(size=(BEARD_CARDS, 3)))
    direction = unit(direction - normals * (direction * normals).sum(axis=1, keepdims=True))
    near_chin = smooth(np.linalg.norm((root - chin) * [1, 0.7, 1], axis=1), 0.060, 0.015)
    long = (SHORT + LONG * amount) * (0.35 + 0.65 * near_chin) * rng.uniform(0.7, 1.2, BEARD_CARDS)
    long = np.where(above, np.minimum(long, 0.011 * rng.uniform(0.7, 1.1, BEARD_CARDS)), long)
    s = np.linspace(0, 1, SEGMENTS + 1)
    lean = np.interp(s, (0, 1), LEAN)[:, None, None]
    steps = unit(direction + lean * normals) * (long / SEGMENTS)[:, None]
    positions = root + np.concatenate([np.zeros((1, BEARD_CARDS, 3)), np.cumsum(steps[1:], axis=0)])
    # Hairs are lifted onto the skin where it turns away from them, above all under the chin.
    for k in range(1, SEGMENTS + 1):
        lift, local_normals = scalp.lift(positions[k])
        positions[k:] += local_normals * (ROOT - lift).clip(0, DEEPEST)[:, None]
    positions = positions.transpose(1, 0, 2)
    least = np.where(above, 0.3, 1) * rng.uniform(0.4, 1.0, BEARD_CARDS)
    thin = (where[corners] * shares).sum(axis=1) < least
    width = WIDE * rng.uniform(0.7, 1.2, (BEARD_CARDS, 1)) * np.array([0.8, 1.0, 0.7]) * min(1, 0.5 + amount)
    light = np.broadcast_to(0.55 + 0.45 * s, (BEARD_CARDS, SEGMENTS + 1)) * rng.uniform(
        0.7, 1, (BEARD_CARDS, 1)
    )
    return ribbons(
        positions, np.repeat(normals[:, None], SEGMENTS + 1, axis=1), width,
        np.where(thin, "tuft", "crew"), tint, light, 0.15,
        (corners, np.repeat(shares[:, None], SEGMENTS + 1, axis=1)),
    )  # fmt: skip


UPPER, LOWER = 60, 26  # lashes of a lid
LASH_ROWS = 4
CURL = 0.55  # additional movement of a lash's tip, relative to its root, when the lid falls
LASH_WIDE = 0.00046  # m; half of it is visible


@dataclass(frozen=True, eq=False)
class Margin:
    """The edge of a lid."""

    edge: Sequence[int]  # vertices of the mesh from the inner to the outer corner
    fold: Sequence[int]  # vertices on the outside of the lid, which move less
    upper: bool  # whether it is the upper lid
    centre: Float64  # (3,) metres, the eyeball's


def lashes(at: Float64, margin: Margin, colour: Any, length: float, rng: Any) -> Patch:
    """Return the lashes of a lid, longest in the outer half and in small groups.

    Args:
        at: (n, 3) metres, the mesh; colour: sRGB; length: relative to default lashes.
    """
    edge = at[list(margin.edge)]
    run = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(edge, axis=0), axis=1))])
    run /= run[-1]
    count = UPPER if margin.upper else LOWER
    k = np.arange(count)
    t = 0.08 + 0.90 * (k + 0.5 + rng.uniform(-0.35, 0.35, count)) / count
    # Lashes lean in groups of three.
    lean = np.repeat(rng.uniform(-0.25, 0.25, count // 3 + 1), 3)[:count] + 0.16 * (1 - k % 3)

    def on_edge(t: Float64) -> Float64:
        return np.stack([np.interp(t, run, edge[:, axis]) for axis in range(3)], 1)

    root = on_edge(t)
    along = unit(on_edge(np.minimum(t + 0.02, 1)) - on_edge(t - 0.02))
    out = unit(root - margin.centre)
    long = (0.0026 + 0.0044 * smooth(t, 0.0, 0.70)) * (1 - 0.30 * smooth(t, 0.86, 1.0))
    long = long * length * rng.uniform(0.75, 1.15, count) * (1.0 if margin.upper else 0.50)
    fan = ((t - 0.42) * 1.1 + 0.5 * lean)[:, None]
    s = np.linspace(0, 1, LASH_ROWS)[:, None, None]
    up = np.array([0, 1.0, 0])
    rise = (-0.15 + 1.25 * s) if margin.upper else (-0.35 - 0.35 * s)
    directions = unit(out * (1 - 0.45 * s) + along * fan * (0.6 + 0.4 * s) + up * rise)
    steps = directions[:-1] * long[:, None] / (LASH_ROWS - 1)
    positions = np.concatenate([np.zeros_like(root)[None], np.cumsum(steps, axis=0)]) + root + out * 0.0002
    normals = unit(np.cross(np.broadcast_to(along, directions.shape), directions))
    normals = normals * np.sign((normals * up).sum(axis=-1, keepdims=True) + 1e-9)
    j = np.clip(np.searchsorted(run, t) - 1, 0, len(edge) - 2)
    share = (t - run[j]) / (run[j + 1] - run[j])
    folds = np.array(margin.fold)
    near = folds[((root[:, None] - at[folds]) ** 2).sum(axis=2).argmin(axis=1)]
    bent = (CURL if margin.upper else 0.0) * np.linspace(0, 1, LASH_ROWS)
    shares = np.stack(
        [np.outer(1 - share, 1 + bent), np.outer(share, 1 + bent), np.tile(-bent, (count, 1))], axis=2
    )
    ends = np.array(margin.edge)
    skin = np.stack([ends[j], ends[j + 1], near], axis=1)
    tint = np.tile(np.clip(np.array(colour, float) / LEVEL, 0, 255), (count, 1))
    width = np.full((count, LASH_ROWS), LASH_WIDE if margin.upper else 0.7 * LASH_WIDE)
    return ribbons(
        positions.transpose(1, 0, 2), normals.transpose(1, 0, 2), width, ["lash"] * count, tint,
        np.full((count, LASH_ROWS), 0.9), 0.0, (skin, shares),
    )  # fmt: skip
