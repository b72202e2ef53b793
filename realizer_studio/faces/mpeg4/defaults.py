"""Default parameters of the MPEG-4 deformer for a head without shapes."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, Literal

import numpy as np
from scipy.sparse.csgraph import dijkstra

from realizer.core.array_types import Bool, Float64, Int32
from realizer.core.errors import FaceError
from realizer.face.mesh_geometry import edge_graph, half_edges, part_triangles
from realizer.tables import csv_rows, faps
from realizer_studio.faces.mpeg4.zones import Setup, Triple, Zone

# The feature points above the slit between lips or lids, and those below it.
SLITS = {
    "upper_lip": (("8.1", "8.5", "8.6", "2.2", "2.6", "2.7"), ("8.2", "8.7", "8.8", "2.3", "2.8", "2.9")),
    "upper_lid_left": (("3.1", "3.13"), ("3.3", "3.9")),
    "upper_lid_right": (("3.2", "3.14"), ("3.4", "3.10")),
}


@dataclass(frozen=True)
class _Default:
    fap: int
    falloff: Literal["ease", "smooth", "cosine", "linear"]
    from_point: str
    to_point: str
    factor: float
    x: float
    y: float
    z: float
    ease: float
    mask: str
    slide: float
    radial: float
    about: str


_table = cache(partial(csv_rows, "zones.csv", _Default, __package__))


def default_setup(
    vertices: Float64, triangles: Int32, points: Mapping[str, Triple], skin: tuple[int, int]
) -> Setup:
    """Return the parameters computed from the feature points and the skin's mesh.

    Args:
        vertices: (n, 3) metres; triangles: (m, 3); points: feature point -> metres.
        skin: (first, last + 1) vertices of the skin.

    Raises:
        FaceError: a feature point that a zone needs is missing, or two lie on each other.
    """
    sides = split_sides(np.asarray(vertices, np.float64), triangles, points, skin)
    zones: dict[int, Zone] = {}
    masks: dict[int, Int32] = {}
    synced = set()
    for row in _table():
        zone = _zone(row, points)
        twin = faps()[row.fap - 1].mirror
        zones[row.fap] = zone
        if twin != row.fap:
            zones[twin] = zone.mirrored(twin)
            synced |= {row.fap, twin}
        for fap, side in ((row.fap, "left"), (twin, "right")):
            if row.mask:
                masks[fap] = sides[f"{row.mask}_{side}" if "lid" in row.mask else row.mask]
    return Setup(dict(points), zones, masks, frozenset(synced))


def _zone(row: _Default, points: Mapping[str, Triple]) -> Zone:
    a, b = _position(points, row.from_point), _position(points, row.to_point)
    pivots = [_position(points, name) for name in row.about.split()]
    pivot = np.mean(pivots, axis=0) if pivots else np.zeros(3)
    return Zone(
        fap=row.fap,
        falloff=row.falloff,
        size=row.factor * float(np.linalg.norm(b - a)),
        scale=(row.x, row.y, row.z),
        ease=row.ease,
        use_mask=bool(row.mask),
        slide=row.slide,
        radial=row.radial,
        pivot=(float(pivot[0]), float(pivot[1]), float(pivot[2])),
    )


def _position(points: Mapping[str, Triple], name: str) -> Float64:
    if name not in points:
        raise FaceError(f"feature point {name} is missing: the default zones need it; add it")
    return np.asarray(points[name], np.float64)


def split_sides(
    vertices: Float64, triangles: Int32, points: Mapping[str, Triple], skin: tuple[int, int]
) -> dict[str, Int32]:
    """Divide the skin's vertices between upper and lower lip, and upper and lower lids.

    A vertex belongs to the side whose feature points are nearer, measured over the skin.

    Returns:
        upper_lip, lower_lip, upper_lid_left, lower_lid_left, upper_lid_right, lower_lid_right -> vertices.
    """
    out = {}
    graph = _graph(vertices, triangles, skin)
    at = vertices[slice(*skin)]
    for name, (above, below) in SLITS.items():
        to_upper, to_lower = (
            _surface_distance(graph, at, [_position(points, p) for p in group]) for group in (above, below)
        )
        upper: Bool = to_upper <= to_lower
        out[name] = (np.flatnonzero(upper) + skin[0]).astype(np.int32)
        out[name.replace("upper", "lower")] = (np.flatnonzero(~upper) + skin[0]).astype(np.int32)
    return out


def _graph(vertices: Float64, triangles: Int32, skin: tuple[int, int]) -> Any:
    """Return the sparse graph of the skin's edges and their lengths; doubled vertices are connected."""
    at = vertices[slice(*skin)]
    # A texture seam doubles its vertices: an edge connects the two of each pair.
    _, group = np.unique(np.round(at, 6), axis=0, return_inverse=True)
    order = np.argsort(group.ravel(), kind="stable")
    doubled = np.flatnonzero(np.diff(group.ravel()[order]) == 0)
    seams = np.stack([order[doubled], order[doubled + 1]], 1)
    return edge_graph(at, np.concatenate([half_edges(part_triangles(triangles, skin)), seams]))


def _surface_distance(graph: Any, at: Float64, targets: list[Float64]) -> Float64:
    """Return each vertex's distance over the skin to the nearest target, (skin,) metres."""
    sources = [int(np.argmin(np.linalg.norm(at - target, axis=1))) for target in targets]
    return np.asarray(dijkstra(graph, directed=False, indices=sources, min_only=True), np.float64)
