"""The surface that separates the upper and the lower half of a face at the mouth."""

import numpy as np

from realizer.core.array_types import Bool, Float64, Int32
from realizer.core.errors import FaceError
from realizer.face.au.model import Mouth
from realizer.face.mesh_geometry import edge_graph, half_edges, part_triangles
from realizer.face.model import Face

UPPER = ("2.2", "2.6", "2.7", "8.1", "8.5", "8.6")
LOWER = ("2.3", "2.8", "2.9", "8.2", "8.7", "8.8")
REACH = 0.012  # m from the line between the lips; farther points are clearly above or below
KNOTS = 7
SOFT = (4e-4, 1e-4)  # m over which a vertex may stand on the wrong side: first much, then little
DEEP = 0.020  # m behind the lips; further back there is no telling the halves of the mouth apart


def halves(face: Face) -> tuple[Int32, Bool]:
    """Return vertices about the mouth, and which of them belong to the upper half.

    A vertex belongs to the lip that is nearer along the surface: lips that touch are far apart that way.

    Returns:
        (k,) indices and (k,) booleans.
    """
    from scipy.sparse.csgraph import dijkstra

    first, last = face.parts["skin"]
    at = face.vertices[first:last].astype(np.float64)
    graph = edge_graph(at, half_edges(part_triangles(face.triangles, face.parts["skin"])))
    seeds = [[face.feature_points[name] - first for name in names] for names in (UPPER, LOWER)]
    away = [dijkstra(graph, directed=False, indices=mine, min_only=True, limit=0.05) for mine in seeds]
    near = np.flatnonzero(np.minimum(*away) < 2 * REACH).astype(np.int32)
    return (near + first).astype(np.int32), np.asarray(away[0][near] < away[1][near])


def shares(face: Face, mouth: Mouth) -> Float64:
    """Return the share of each vertex in the upper half, (n,): on the lips by the mesh's topology."""
    at = face.vertices.astype(np.float64)
    share = mouth.upper(at)
    index, upper = halves(face)
    inner = np.abs(at[index, 0]) < mouth.x[-1]
    share[index[inner]] = upper[inner]
    return share


def fit_mouth(face: Face) -> Mouth:
    """Return the plane through the mouth's corners, bent until the lips' vertices are on their own sides.

    Raises:
        FaceError: feature points of the mouth that do not go from the middle to the left corner.
    """
    from scipy.optimize import least_squares

    points = {name: np.asarray(place, np.float64) for name, place in face.points.items()}
    middle, half = ((points[upper] + points[lower]) / 2 for upper, lower in (("2.2", "2.3"), ("2.6", "2.8")))
    line = np.array([middle, half, points["2.4"], points["8.3"]])
    line[0, 0] = 0
    if (np.diff(line[:, 0]) <= 0).any():
        raise FaceError(f"{face.name}: wanted feature points 2.2, 2.6, 2.4 and 8.3 further and further left")
    index, upper = halves(face)
    at = face.vertices[index].astype(np.float64)
    at[:, 0] = np.abs(at[:, 0])
    x = np.linspace(0, line[-1, 0], KNOTS)
    y, z = (np.interp(x, line[:, 0], line[:, k]) for k in (1, 2))
    reach = np.abs(at[:, 1] - np.interp(at[:, 0], x, y)) < REACH
    reach &= (at[:, 0] < x[-1]) & (np.interp(at[:, 0], x, z) - at[:, 2] < DEEP)
    at, wanted = at[reach], upper[reach].astype(np.float64)
    best = np.concatenate([y, np.zeros(KNOTS)])
    start = best.copy()
    for soft in SOFT:

        def miss(free: Float64, soft: float = soft) -> Float64:
            mouth = Mouth(x, free[:KNOTS], z, free[KNOTS:])
            side = 1 / (1 + np.exp(np.clip(-mouth.above(at) / soft, -50, 50)))
            return np.concatenate(
                [side - wanted, 30 * (free[:KNOTS] - start[:KNOTS]), 0.05 * np.diff(free[KNOTS:])]
            )

        best = least_squares(miss, best, x_scale=np.r_[[3e-4] * KNOTS, [0.3] * KNOTS]).x
    return Mouth(x, best[:KNOTS], z, best[KNOTS:])
