"""The regions of a face that action units move: both halves at the mouth, the skin, and what grows on it."""

import numpy as np

from realizer.core.array_types import Bool, Float64, Int32
from realizer.core.errors import FaceError
from realizer.face.au.model import Mouth
from realizer.face.mesh_geometry import corner_shares, edge_graph, half_edges, nearest_points, part_triangles
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


# All other parts of a face move with the head alone, or grow on the skin.
MOVED, GROWN = ("skin", "hair"), ("brows", "lashes", "tears")
NEAR = 0.0015  # m; closer parts grow on the skin
AROUND = 16  # number of nearest triangles to look at


def skin(face: Face) -> Bool:
    """Return which vertices (n,) units move directly; what grows on the skin follows it."""
    mine = np.zeros(len(face.vertices), bool)
    for part in MOVED:
        if part in face.parts:
            mine[slice(*face.parts[part])] = True
    return mine


def attached_parts(face: Face) -> list[tuple[int, int, Int32, Float64]]:
    """Return the parts that grow on the skin: first and last vertex, and their `skin_roots`."""
    return [(*face.parts[part], *skin_roots(face, part)) for part in GROWN if part in face.parts]


def skin_roots(face: Face, part: str) -> tuple[Int32, Float64]:
    """Return three vertices of skin for each vertex of the part, (n, 3), and their shares, (n, 3).

    Vertices off the skin, such as a lash's tip, follow the nearest vertex of the part that is on the skin.
    """
    from scipy.sparse.csgraph import dijkstra
    from scipy.spatial import cKDTree

    skin = part_triangles(face.triangles, face.parts["skin"]) + face.parts["skin"][0]
    corners = face.vertices[skin].astype(np.float64)
    first, last = face.parts[part]
    at = face.vertices[first:last].astype(np.float64)
    near = np.asarray(cKDTree(corners.mean(axis=1)).query(at, min(AROUND, len(skin)))[1]).reshape(len(at), -1)
    places = nearest_points(corners[near], at)
    off = np.linalg.norm(places - at[:, None], axis=2)
    best = off.argmin(axis=1)
    each = np.arange(len(at))
    hit, place, off = near[each, best], places[each, best], off[each, best]
    share = corner_shares(corners[hit], place)
    # Parts far from the skin are bound to their nearest place on it as well.
    edges = half_edges(part_triangles(face.triangles, face.parts[part]))
    attached = np.flatnonzero(off < NEAR)
    root = each.copy()
    if len(attached) and len(edges):
        graph = edge_graph(at, edges)
        away, _, source = dijkstra(
            graph, directed=False, indices=attached, min_only=True, return_predecessors=True
        )
        root[np.isfinite(away)] = source[np.isfinite(away)]
    return skin[hit[root]], share[root]
