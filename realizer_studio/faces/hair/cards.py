"""Hair cards: strips along strands, the vertices that they follow, and their texture."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32, UInt8
from realizer.face.mesh_geometry import grid
from realizer_studio.faces.hair.strands import unit
from realizer_studio.faces.skin.skin_atlas import HAIR

ROUND = 0.25  # lean of a card's normals to its sides, which makes it look like a lock


@dataclass(frozen=True, eq=False)
class Patch:
    """Cards at rest: c vertices and t triangles."""

    positions: Float64  # (c, 3) metres
    normals: Float64  # (c, 3) unit normals
    uv: Float64  # (c, 2) texture coordinates in the maps
    colours: Float64  # (c, 3) sRGB 0..255
    occlusion: Float64  # (c,) 0..1
    gloss: Float64  # (c,) 0..1
    triangles: Int32  # (t, 3)
    skin: Int32  # (c, 3) vertices of the mesh around a vertex's root; -1 for hair on the skull
    shares: Float64  # (c, 3) their weights; they sum to 1, or are 0 for hair on the skull


def joined(patches: Sequence[Patch]) -> Patch:
    """Return the concatenation of patches."""
    counts = np.cumsum([0] + [len(patch.positions) for patch in patches])
    values: dict[str, Any] = {
        field.name: np.concatenate([getattr(patch, field.name) for patch in patches])
        for field in fields(Patch)
        if field.name != "triangles"
    }
    turned = [patch.triangles + first for patch, first in zip(patches, counts, strict=False)]
    return Patch(triangles=np.concatenate(turned).astype(np.int32), **values)


def ribbons(
    positions: Float64,
    normals: Float64,
    width: Float64,
    strips: Any,
    colours: Float64,
    occlusion: Float64,
    gloss: float,
    skin: tuple[Int32, Float64] | None = None,
) -> Patch:
    """Return a card along each line.

    Args:
        positions, normals: (s, k, 3) along the lines, root first, and normals of the surface.
        width: (s, k) metres.
        strips: (s,) names in `STRIPS`.
        colours: (s, 3); occlusion: (s, k).
        skin: vertices (s, 3) around the roots, and their weights (s, k, 3).
    """
    count, rows = positions.shape[:2]
    tangents = unit(np.gradient(positions, axis=1))
    sideways = unit(np.cross(tangents, normals))
    normals = unit(np.cross(sideways, tangents))
    sides = np.array([-0.5, 0.5])[:, None, None, None]
    at = positions + sides * sideways * width[..., None]
    tilt = unit(normals + sides * 2 * ROUND * sideways)
    # A narrow end shows less of the texture, so that hairs keep their direction and width.
    across = 0.5 + sides[..., 0] * (width / width.max(axis=1, keepdims=True))
    along = np.linspace(0, 1, rows)
    uv = np.stack([strip_uv(strip, across[:, k], along) for k, strip in enumerate(strips)], axis=1)
    # The order of vertices is line, row, side.
    order = (1, 2, 0)
    sheet = grid(rows, 2)[:, ::-1]
    triangles = (sheet + (np.arange(count) * rows * 2)[:, None, None]).reshape(-1, 3)
    total = count * rows * 2
    rooted, shares = skin or (np.full((count, 3), -1), np.zeros((count, rows, 3)))
    return Patch(
        at.transpose(*order, 3).reshape(-1, 3),
        tilt.transpose(*order, 3).reshape(-1, 3),
        uv.transpose(*order, 3).reshape(-1, 2),
        np.repeat(colours, rows * 2, axis=0),
        np.repeat(occlusion.reshape(-1), 2),
        np.full(total, gloss),
        triangles.astype(np.int32),
        np.repeat(rooted, rows * 2, axis=0).astype(np.int32),
        np.repeat(shares.reshape(-1, 3), 2, axis=0),
    )


SEED = 23
LEVEL = 0.80  # mean brightness of a strand, 0..1


@dataclass(frozen=True, slots=True)
class Strip:
    """A part of the texture that cards show.

    It is about as large as a card in pictures, because minified fine strands blur to grey.
    """

    left: float  # 0..1 of the texture
    top: float
    right: float
    bottom: float
    strands: int  # number of strands
    width: float  # of a strand, as a share of the strip's
    sway: float = 0.06  # amplitude of a strand's waves, as a share of the strip's width
    waves: float = 0.7  # number of waves
    ends: float = 0.75  # share of the height after which strands end
    begins: float = 0.03  # share of the height before which strands begin
    tip: float = 0.3  # convergence of strands at the end, 0..1
    filled: bool = False  # strands reach the strip's sides and its end
    dashes: int = 0  # pieces into which each strand is cut; 0 for uncut strands


STRIPS: Mapping[str, Strip] = {
    "dense": Strip(0.00, 0.0, 0.13, 1.0, 50, 0.060, begins=0.24),
    "locks": Strip(0.13, 0.0, 0.26, 1.0, 34, 0.065, 0.10, 1.0, 0.55, 0.30, 0.5),
    "loose": Strip(0.26, 0.0, 0.38, 1.0, 17, 0.055, 0.12, 1.0, 0.45, 0.12, 0.5),
    "cap": Strip(0.38, 0.0, 0.54, 1.0, 140, 0.034, 0.03, 0.6, 1.0, 0.40, 0.0, filled=True),
    "crop": Strip(0.54, 0.0, 0.66, 1.0, 26, 0.050, 0.05, 2.0, 1.0, 0.10, 0.0, filled=True, dashes=22),
    "coils": Strip(0.66, 0.0, 0.80, 0.5, 26, 0.055, 0.14, 4.0, 0.50, 0.15, 0.2),
    "crew": Strip(0.66, 0.5, 0.80, 1.0, 30, 0.060, 0.10, 0.8, 0.45, 0.20, 0.5),
    "sparse": Strip(0.80, 0.0, 0.90, 0.35, 6, 0.060, 0.14, 0.8, 0.35, 0.30, 0.3),
    "wisps": Strip(0.90, 0.0, 1.00, 0.35, 11, 0.060, 0.14, 0.8, 0.35, 0.30, 0.4),
    "tuft": Strip(0.80, 0.35, 0.90, 0.70, 14, 0.070, 0.12, 0.8, 0.40, 0.20, 0.6),
    "wire": Strip(0.90, 0.35, 1.00, 0.70, 9, 0.070, 0.16, 1.5, 0.40, 0.25, 0.4),
    "brow": Strip(0.80, 0.70, 0.85, 0.95, 5, 0.09, 0.14, 0.4, 0.50, 0.25, 0.5),
    "lash": Strip(0.86, 0.70, 0.88, 0.95, 1, 0.45, 0.0, 0.0, 0.85, 0.0, 0.0),
}
MARGIN = 0.06  # empty share of a strip at each side
INSET = 0.004  # distance of cards from the ends of a strip, as a share of the texture's height


def strip_uv(strip: str, across: Float64, along: Float64) -> Float64:
    """Return texture coordinates (..., 2) of positions across a strip and along its hairs, 0..1 each."""
    part = STRIPS[strip]
    x = part.left + (part.right - part.left) * np.asarray(across, float)
    y = part.top + INSET + (part.bottom - part.top - 2 * INSET) * np.asarray(along, float)
    u, v = np.broadcast_arrays(
        HAIR.left + (HAIR.right - HAIR.left) * x, HAIR.top + (HAIR.bottom - HAIR.top) * y
    )
    return np.stack([u, v], axis=-1)


def hair_texture(size: int) -> UInt8:
    """Return the texture (size, size, 4) sRGB with alpha: strands in grey, brightest 255, mean `LEVEL`."""
    rng = np.random.default_rng(SEED)
    out = np.zeros((size, size, 4))
    out[..., :3] = LEVEL
    for strip in STRIPS.values():
        left, top, right, bottom = (
            round(s * size) for s in (strip.left, strip.top, strip.right, strip.bottom)
        )
        if left < right and top < bottom:
            out[top:bottom, left:right] = _strip(strip, bottom - top, right - left, rng)
    return np.asarray(np.rint(out.clip(0, 1) * 255), np.uint8)


def _strip(strip: Strip, height: int, width: int, rng: np.random.Generator) -> Float64:
    """Return the texture (height, width, 4) of a strip, 0..1."""
    v = (np.arange(height) + 0.5)[:, None] / height
    x = (np.arange(width) + 0.5) / width
    tone, alpha = np.full((height, width), LEVEL), np.zeros((height, width))
    margin = 0.0 if strip.filled else MARGIN
    wide = max(strip.width, 1.1 / width)
    for middle in rng.permutation(np.linspace(margin, 1 - margin, strip.strands + 2)[1:-1]):
        turn, size, bend = rng.uniform(0, 2 * np.pi), rng.uniform(0.4, 1), rng.uniform(-1, 1)
        sway = strip.sway * size * np.sin(2 * np.pi * strip.waves * v * rng.uniform(0.8, 1.2) + turn)
        to = 0.5 + (middle - 0.5) * (1 - strip.tip * v**2)
        centre = to + (sway + strip.sway * 0.5 * bend * v) * np.minimum(1, 4 * v + 0.3)
        centre = centre.clip(margin + wide / 2, 1 - margin - wide / 2)
        begin = strip.begins * rng.uniform(0, 1) ** (1.0 if strip.filled else 2.0)
        end = 1.1 if strip.filled else strip.ends + (1 - strip.ends) * rng.uniform(0, 1)
        # A strand is thin at its root and tip.
        taper = np.clip((end - v) / 0.30, 0, 1) ** 0.6 * np.clip(0.35 + (v - begin) / 0.16, 0, 1)
        on = np.clip((v - begin) / 0.08, 0, 1) * (v < end)
        if strip.dashes:
            on = on * np.clip(0.9 + 3 * np.sin(2 * np.pi * strip.dashes * (v + rng.uniform(0, 1))), 0, 1)
        half = wide / 2 * rng.uniform(0.75, 1.25) * np.maximum(taper, 0.25)
        cover = np.clip((half - np.abs(x - centre)) * width + 0.5, 0, 1) * on * np.clip(taper * 1.6, 0, 1)
        light = LEVEL + 0.22 * rng.uniform(-1, 1)
        # A strand is round: brighter along its middle.
        light = light * (0.90 + 0.16 * np.clip(1 - np.abs(x - centre) / half, 0, 1))
        tone += cover * (light - tone)
        alpha = np.maximum(alpha, cover)
    return np.stack([tone, tone, tone, alpha], axis=-1)
