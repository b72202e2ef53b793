"""Points of a face's skin found under pixels, to follow them as it moves."""

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import flat_cross, part_triangles
from realizer.face.model import Face


def locate_on_skin(
    face: Face, places: Float64, right: Float64, towards: Float64, longest: float
) -> tuple[Int32, Float64] | None:
    """Return the triangle of skin at each place, (n, 3) vertices, and the shares of its corners, (n, 3).

    Args:
        places: (n, 2) metres, along `right` and up.
        right, towards: (3,) level unit vectors: the picture's x, and from the head to the viewer.
        longest: metres; skin whose edges there are longer (by their median) does not count.

    Returns:
        None if a place is beside the skin or the skin is too coarse.
    """
    skin = face.parts.get("skin", (0, len(face.vertices)))
    low, high = places.min(axis=0), places.max(axis=0)
    mine = part_triangles(face.triangles, skin) + skin[0]
    flat = np.stack([face.vertices @ right, face.vertices[:, 1]], axis=1)
    depth = face.vertices @ towards
    a, b, c = (flat[mine[:, k]] for k in range(3))
    turn = flat_cross(b - a, c - a)
    most, least = np.maximum(np.maximum(a, b), c), np.minimum(np.minimum(a, b), c)
    near = (turn > 1e-12) & (most >= low).all(axis=1) & (least <= high).all(axis=1)
    mine, a, b, c, turn = mine[near], a[near], b[near], c[near], turn[near]
    if not len(mine):
        return None
    p = places[:, None]
    v = flat_cross(p - a, c - a) / turn
    w = flat_cross(b - a, p - a) / turn
    inside = (v >= -1e-6) & (w >= -1e-6) & (v + w <= 1 + 1e-6)
    heights = depth[mine[:, 0]] * (1 - v - w) + depth[mine[:, 1]] * v + depth[mine[:, 2]] * w
    best = np.where(inside, heights, -np.inf).argmax(axis=1)
    row = np.arange(len(places))
    if not inside[row, best].all():
        return None
    hit = mine[best]
    edges = np.linalg.norm(face.vertices[hit] - face.vertices[np.roll(hit, 1, axis=1)], axis=2)
    if np.median(edges) > longest:
        return None
    v, w = v[row, best], w[row, best]
    return hit.astype(np.int32), np.stack([1 - v - w, v, w], axis=1)
