"""The base mesh with its identity and expression shapes."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.features import fapu_of
from realizer.face.mesh_geometry import neighbour_mean
from realizer.face.model import Fapu
from realizer.facebuild.person.makehuman import BaseMesh

Shape = Callable[[str], Float64]
UP, LEFT, FORWARD = np.array([0, 1.0, 0]), np.array([1.0, 0, 0]), np.array([0, 0, 1.0])


class Ground:
    """The data from which all fields are made.

    Attributes:
        at: (n, 3) metres, the base mesh with its identity.
        points: feature point -> base vertex.
        shape: name of a face unit -> (n, 3) metres.
        average: (n, n) sparse; a vertex's neighbours and itself in equal parts.
    """

    def __init__(self, mesh: BaseMesh, at: Float64, points: Mapping[str, int], shape: Shape) -> None:
        self.mesh, self.at, self.points, self.shape = mesh, at, points, shape
        n = len(at)
        quads = mesh.quads["body"]
        sides = np.concatenate([quads[:, [k, (k + 1) % 4]] for k in range(4)])
        self.average = neighbour_mean(n, sides)
        self.body = np.zeros(n, bool)
        self.body[np.unique(quads)] = True

    def point(self, name: str) -> Float64:
        """Return the place of a feature point, (3,) metres."""
        return np.asarray(self.at[self.points[name]])

    def fapu(self) -> Fapu:
        """Return the person's distances; pupils stand before the middle of the lids."""
        places = {name: np.asarray(self.at[vertex], np.float32) for name, vertex in self.points.items()}
        for name, high, low in (("3.5", "3.1", "3.3"), ("3.6", "3.2", "3.4")):
            places[name] = np.asarray((places[high] + places[low]) / 2, np.float32)
        return fapu_of(places)

    def smoothed(self, field: Float64, times: int = 1) -> Float64:
        """Return a field of the body with its kinks softened."""
        for _ in range(times):
            field = np.asarray(self.average @ field)
        return field

    def ellipsoid(self, centre: Any, radii: Any, plateau: float = 0.0) -> Float64:
        """Return the influence (n,) of an ellipsoid: 1 at the centre, 0 outside (Paul 2010, 4.3.3)."""
        away = np.linalg.norm((self.at - np.asarray(centre)) / np.asarray(radii), axis=1)
        away = np.clip((away - plateau) / (1 - plateau), 0, 1)
        return np.where(self.body, (1 + np.cos(np.pi * away)) / 2, 0.0)


def scaled(field: Float64, vertex: int, direction: Any) -> Float64:
    """Return the field scaled to a move of exactly 1 along the direction at the vertex."""
    here = float(field[vertex] @ np.asarray(direction))
    if abs(here) < 1e-9:
        raise ValueError(f"a field that leaves its feature point's vertex {vertex} still cannot be scaled")
    return np.asarray(field / here)
