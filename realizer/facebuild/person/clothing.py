"""Clothing cut from and lifted above the body."""

from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.mesh_geometry import edges_of, vertex_normals
from realizer.facebuild.decimate import decimate
from realizer.facebuild.parts import Part, smooth
from realizer.facebuild.submesh import Submesh

COLLAR = 0.486  # of the face's height, hairline to chin: how far below the chin the collar is in front
TILT = 0.42  # of the plane of the collar, which rises backwards


POINT = 0.045  # m from the middle that a pointed collar reaches its full height


def under_collar(at: Float64, chin: Float64, face: float, low: float = 0.0, point: float = 0.0) -> Float64:
    """Return how far points lie below the neckline, in metres.

    Args:
        chin: (3,) metres; face: metres from hairline to chin.
        low, point: metres by which the collar is lower, and by which its middle in front extends down.
    """
    front = np.maximum(1 - np.abs(at[:, 0]) / POINT, 0) * smooth(at[:, 2] - chin[2], -0.09, -0.05)
    collar = chin[1] - COLLAR * face - low - point * front
    return np.asarray(collar - (at[:, 1] + TILT * (at[:, 2] + 0.01)))


def shirt(skin: Submesh, base: Float64, low: Float64, colour: list[float]) -> Part:
    """Return a shirt: the body below the neckline, lifted. `low`: (n,) metres of its vertices below that."""
    some = (low > -0.03)[skin.triangles].any(axis=1)
    low = low[np.unique(skin.triangles[some])]
    piece = skin.with_triangles(some)
    piece, mix = piece.clipped(low)
    low = np.asarray(mix @ low)
    at = piece.positions(base)
    ups = vertex_normals(at, piece.triangles)
    thick = 0.0028 + 0.0016 * smooth(low, 0.010, 0.004)
    piece = piece.moved(ups * thick[:, None])
    tint = np.repeat(np.array([colour], float), len(piece), 0)
    tint *= (1 - 0.22 * smooth(low, 0.012, 0.009))[:, None]
    return Part("shirt", piece, piece.positions(base), piece.triangles, tint, np.zeros(len(piece)))


# Baked light under which nothing is ever seen, and metres that surfaces may change by where vertices go.
HIDDEN = 0.27
UNSEEN, PLAIN, BUST, CLOTH, DEEP_CLOTH = 0.003, 0.0006, 0.0005, 0.0008, 0.003


def decimate_hidden(part: Part, keep: Any, plain: Any, chin: float, floor: float) -> Part:
    """Return skin, shirt or tongue with fewer vertices where hidden, or evenly curved and far from the face.

    Args:
        part: with baked occlusion.
        keep: (n,) vertices that stay; plain: (n,) those of ears and scalp.
        chin, floor: metres, heights of the chin and of the bust's lower end.
    """
    at, light = part.vertices, np.asarray(part.occlusion)
    if part.name == "skin":
        tolerance = np.where(light < HIDDEN, UNSEEN, 0)
        tolerance = np.maximum(tolerance, np.where(plain, PLAIN, 0))
        tolerance = np.maximum(tolerance, np.where(at[:, 1] < chin - 0.012, BUST, 0))
        pairs, count = edges_of(part.triangles)
        tolerance[pairs[count == 1].ravel()] = 0
    elif part.name == "shirt":
        tolerance = np.where(at[:, 1] < floor + 0.05, DEEP_CLOTH, CLOTH)
    else:
        tolerance = np.full(len(at), BUST)
    return part.subset(*decimate(at, part.triangles, np.where(keep, 0, tolerance)))
