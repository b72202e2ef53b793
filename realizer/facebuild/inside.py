"""How deep places lie inside a surface, by the nearest point of it and the normal there.

The sign is that of the angle-weighted normal (Baerentzen and Aanaes 2005, "Signed distance computation using
the angle weighted pseudonormal"), which is right at edges and corners, too.
"""

from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import FINE, edges_of, nearest_points, triangle_normals

AROUND = 16  # number of nearest triangles to look at
SAME = 1e-7  # m
MOST = 0.004  # m from a triangle's middle to its corners that are looked at


def without_rim(triangles: Int32) -> Int32:
    """Return the triangles (k, 3) that do not touch the rim of their surface, beyond which is no inside."""
    pairs, counts = edges_of(triangles)
    return triangles[~np.isin(triangles, pairs[counts == 1]).any(axis=1)]


def depths(places: Float64, at: Float64, triangles: Int32, near: float) -> tuple[Float64, Float64]:
    """Return how deep places (k, 3) lie behind triangles (m, 3) of vertices `at`, and how they get out.

    Returns:
        (k,) metres, negative in front of the surface, -inf farther than `near` from it; and (k, 3) metres,
        the way to the nearest point of the surface.
    """
    from scipy.spatial import cKDTree
    from trimesh import triangles as shapes

    angles: Any = shapes.angles
    depth, way = np.full(len(places), -np.inf), np.zeros(places.shape)
    corners = at[triangles]
    nearby: Any = cKDTree(corners.mean(axis=1)).query(places, AROUND, distance_upper_bound=near + MOST)
    away, found = nearby
    close = np.flatnonzero(np.isfinite(away[:, 0]))
    if not len(close):
        return depth, way
    known = np.isfinite(away[close])
    found = np.where(known, found[close], found[close, :1])
    here = places[close]
    points = nearest_points(corners[found], here, FINE)
    off = np.linalg.norm(points - here[:, None], axis=2)
    least = off.min(axis=1)
    # All triangles that have the nearest point, each by its angle there.
    touch = known & (off < least[:, None] + SAME)
    at_corner = np.linalg.norm(corners[found] - points[:, :, None], axis=3) < SAME
    at_angle = (np.nan_to_num(angles(FINE * corners))[found] * at_corner).sum(axis=2)
    angle = np.where(at_corner.any(axis=2), at_angle, np.pi)
    ups = triangle_normals(at, triangles)
    ups /= np.maximum(np.linalg.norm(ups, axis=1), 1e-18)[:, None]
    up = ((touch * angle)[..., None] * ups[found]).sum(axis=1)
    out = points[np.arange(len(close)), off.argmin(axis=1)] - here
    inside = (out * up).sum(axis=1) > 0
    depth[close] = np.where(least > near, -np.inf, np.where(inside, least, -least))
    way[close] = out
    return depth, way
