"""Cards as they are made: strips along strands, and what each of their vertices follows."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import grid
from realizer.facebuild.hair.strands import unit
from realizer.facebuild.hair.texture import place

ROUND = 0.25  # how far the normals of a card turn to its sides, as if it were a lock


@dataclass(frozen=True, eq=False)
class Patch:
    """Cards at rest: c vertices and t triangles."""

    places: Float64  # (c, 3) metres
    ups: Float64  # (c, 3) unit normals
    uv: Float64  # (c, 2) place in the maps
    colours: Float64  # (c, 3) sRGB 0..255
    occlusion: Float64  # (c,) 0..1
    gloss: Float64  # (c,) 0..1
    triangles: Int32  # (t, 3)
    skin: Int32  # (c, 3) vertices of the mesh that a vertex's root lies between; -1 for hair on the skull
    shares: Float64  # (c, 3) of those in its root; they sum to 1, or are 0 for hair on the skull


def joined(patches: Sequence[Patch]) -> Patch:
    """Return patches as one."""
    counts = np.cumsum([0] + [len(patch.places) for patch in patches])
    values: dict[str, Any] = {
        field.name: np.concatenate([getattr(patch, field.name) for patch in patches])
        for field in fields(Patch)
        if field.name != "triangles"
    }
    turned = [patch.triangles + first for patch, first in zip(patches, counts, strict=False)]
    return Patch(triangles=np.concatenate(turned).astype(np.int32), **values)


def ribbons(
    places: Float64,
    ups: Float64,
    width: Float64,
    strips: Any,
    colours: Float64,
    occlusion: Float64,
    gloss: float,
    skin: tuple[Int32, Float64] | None = None,
) -> Patch:
    """Return a card along each line.

    Args:
        places, ups: (s, k, 3) along the lines, root first, and the normals of the surface there.
        width: (s, k) metres.
        strips: (s,) of the picture.
        colours: (s, 3); occlusion: (s, k).
        skin: vertices (s, 3) around the roots, and their shares (s, k, 3).
    """
    count, rows = places.shape[:2]
    ways = unit(np.gradient(places, axis=1))
    aside = unit(np.cross(ways, ups))
    ups = unit(np.cross(aside, ways))
    sides = np.array([-0.5, 0.5])[:, None, None, None]
    at = places + sides * aside * width[..., None]
    tilt = unit(ups + sides * 2 * ROUND * aside)
    # A narrow end shows less of the picture: hairs keep their direction and width.
    across = 0.5 + sides[..., 0] * (width / width.max(axis=1, keepdims=True))
    along = np.linspace(0, 1, rows)
    uv = np.stack([place(strip, across[:, k], along) for k, strip in enumerate(strips)], axis=1)
    # Vertices in the order line, row, side.
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
