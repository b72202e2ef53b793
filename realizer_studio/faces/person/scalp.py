"""The scalp: the region where hair grows, and heights above it."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import vertex_normals

CROWN, CHIN = 0.1087, -0.1002  # m; heights of the head for which the hairlines were drawn
# The hairless ellipse around an ear in the side view, relative to the ear's top and lobe (10.1, 10.5).
EAR_ABOVE, EAR_BEHIND, EAR_TALL, EAR_WIDE, EAR_LEAN = 0.02, 0.066, 0.62, 0.36, 0.22
EARS_FROM = 0.03  # m from the middle
NEAR = 8  # vertices from which a point of the skull is interpolated
FLAP = 0.006  # m; vertices that protrude that far from their surroundings belong to an ear


class Scalp:
    """The skull below the skin's surface and the line where hair begins.

    Attributes:
        middle: (3,) metres, the skull's.
    """

    def __init__(
        self, at: Float64, triangles: Int32, points: Mapping[str, Float64], line: Any, rise: Any
    ) -> None:
        """
        Args:
            at: (n, 3) metres, the skin's vertices; triangles: (m, 3).
            line: rows of degrees and metres above the eyes, on the head for which it was drawn.
            rise: rows of degrees and metres that are added to the line.
        """
        self.at = at
        self.normals = vertex_normals(at, triangles)
        self._line, self._rise = np.array(line, float).T, np.array(rise, float).T
        top, back = points["11.4"], points["11.6"]
        self._above, self._below = top[1] / CROWN, points["2.1"][1] / CHIN
        self.middle = np.array([0, top[1] * 0.14, back[2] * 0.48])
        self._axis = back[2] * 0.40
        high, lobe = points["10.1"], points["10.5"]
        tall = high[1] - lobe[1]
        middle = (high[1] + lobe[1]) / 2
        self._ear = middle + EAR_ABOVE * tall, high[2] - EAR_BEHIND * tall, EAR_TALL * tall, EAR_WIDE * tall
        directions = self.at - self.middle
        radius = np.linalg.norm(directions, axis=1)
        directions /= radius[:, None]
        around = cKDTree(directions).query_ball_point(directions, 0.10)
        nearest = np.array([radius[group].min() for group in around])
        bone = (radius < nearest + FLAP) | (np.abs(directions[:, 0]) < 0.6)
        self._bone, self._radius = cKDTree(directions[bone]), radius[bone]
        self._skin, self._skull = cKDTree(self.at), cKDTree(self.at[bone])
        self._bones = np.flatnonzero(bone)

    def degrees(self, at: Float64) -> Float64:
        """Return the directions of points around the head in degrees from the front, 0..180."""
        return np.asarray(np.degrees(np.arctan2(np.abs(at[:, 0]), at[:, 2] - self._axis)))

    def high(self, at: Float64) -> Float64:
        """Return the approximate distance of points above the hairline in metres, negative in the face."""
        degrees = self.degrees(at)

        def line(where: Any) -> Any:
            return self._stretched(where, self._line) + np.interp(where, *self._rise) * self._above

        steep = np.abs(line(degrees + 2) - line(degrees - 2)) / (4 * np.pi / 180 * 0.08)
        height = (at[:, 1] - line(degrees)) / np.sqrt(1 + steep**2)
        return np.asarray(np.minimum(height, self.ear_distance(at)))

    def ear_distance(self, at: Float64) -> Float64:
        """Return the approximate distance of points from the bald ellipse of an ear, m; negative inside."""
        y, z, tall, wide = self._ear
        # The ellipse leans back with the ear.
        lean = at[:, 1] - y
        around = np.hypot(lean / tall, (at[:, 2] - z + EAR_LEAN * lean) / wide)
        return np.where(np.abs(at[:, 0]) > EARS_FROM, (around - 1) * wide, np.inf)

    def height(self, line: Any, at: Float64) -> Float64:
        """Return the height (n,) above the eyes, at points, of a line as given to the constructor."""
        return np.asarray(self._stretched(self.degrees(at), np.array(line, float).T))

    def _stretched(self, degrees: Any, line: Float64) -> Any:
        height = np.interp(degrees, *line)
        return height * np.where(height > 0, self._above, self._below)

    def skull(self, directions: Float64) -> Float64:
        """Return the points (n, 3) of the skull, without ears, in directions (n, 3) from its middle."""
        distance, nearest = self._bone.query(directions, NEAR)
        weight = 1 / (np.asarray(distance) + 0.02) ** 2
        radius = (self._radius[nearest] * weight).sum(axis=1) / weight.sum(axis=1)
        return np.asarray(self.middle + directions * radius[:, None])

    def lift(self, at: Float64) -> tuple[Float64, Float64]:
        """Return the height of points above the skin, without ears, (n,) metres, and its normal (n, 3)."""
        distance, nearest = self._skull.query(at, 3)
        nearest = self._bones[nearest]
        weight = 1 / (np.asarray(distance) + 1e-4)
        weight /= weight.sum(axis=1, keepdims=True)
        normals = (self.normals[nearest] * weight[..., None]).sum(axis=1)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
        each = ((at[:, None] - self.at[nearest]) * self.normals[nearest]).sum(axis=2)
        return np.asarray((each * weight).sum(axis=1)), np.asarray(normals)

    def distance(self, at: Float64) -> Float64:
        """Return the distance of each point from the nearest vertex of the skin, (n,) metres."""
        return np.asarray(self._skin.query(at)[0])
