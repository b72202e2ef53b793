"""The scalp: where hair grows, and the height of places above it."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import vertex_normals

CROWN, CHIN = 0.1087, -0.1002  # m; heights of the head that the hairline was drawn on
# The hair leaves the ear free: an ellipse in the side view, drawn from the ear's top and lobe (10.1, 10.5).
EAR_ABOVE, EAR_BEHIND, EAR_TALL, EAR_WIDE, EAR_LEAN = 0.02, 0.066, 0.62, 0.36, 0.22
EARS_FROM = 0.03  # m from the middle
NEAR = 8  # vertices that a place on the skull is mixed from
FLAP = 0.006  # m; what protrudes that far from its surroundings is an ear


class Scalp:
    """The skull under the skin's surface and the line where hair begins.

    Attributes:
        middle: (3,) metres, the skull's.
    """

    def __init__(
        self, at: Float64, triangles: Int32, points: Mapping[str, Float64], line: Any, rise: Any
    ) -> None:
        """`line`: (degrees, metres above the eyes) on the head it was drawn on; `rise`: metres to add.

        Args:
            at: (n, 3) metres, the skin's vertices; triangles: (m, 3).
        """
        from scipy.spatial import cKDTree

        self.at = at
        self.ups = vertex_normals(at, triangles)
        self._line, self._rise = np.array(line, float).T, np.array(rise, float).T
        top, back = points["11.4"], points["11.6"]
        self._above, self._below = top[1] / CROWN, points["2.1"][1] / CHIN
        self.middle = np.array([0, top[1] * 0.14, back[2] * 0.48])
        self._axis = back[2] * 0.40
        high, lobe = points["10.1"], points["10.5"]
        tall = high[1] - lobe[1]
        middle = (high[1] + lobe[1]) / 2
        self._ear = middle + EAR_ABOVE * tall, high[2] - EAR_BEHIND * tall, EAR_TALL * tall, EAR_WIDE * tall
        ways = self.at - self.middle
        away = np.linalg.norm(ways, axis=1)
        ways /= away[:, None]
        around = cKDTree(ways).query_ball_point(ways, 0.10)
        nearest = np.array([away[mine].min() for mine in around])
        bone = (away < nearest + FLAP) | (np.abs(ways[:, 0]) < 0.6)
        self._bone, self._away = cKDTree(ways[bone]), away[bone]
        self._skin, self._skull = cKDTree(self.at), cKDTree(self.at[bone])
        self._bones = np.flatnonzero(bone)

    def degrees(self, at: Float64) -> Float64:
        """Return the direction of places about the head in degrees from the front, 0..180."""
        return np.asarray(np.degrees(np.arctan2(np.abs(at[:, 0]), at[:, 2] - self._axis)))

    def high(self, at: Float64) -> Float64:
        """Return about how far places are above the hairline, metres; negative in the face."""
        degrees = self.degrees(at)

        def line(where: Any) -> Any:
            return self._stretched(where, self._line) + np.interp(where, *self._rise) * self._above

        steep = np.abs(line(degrees + 2) - line(degrees - 2)) / (4 * np.pi / 180 * 0.08)
        height = (at[:, 1] - line(degrees)) / np.sqrt(1 + steep**2)
        return np.asarray(np.minimum(height, self.off_ear(at)))

    def off_ear(self, at: Float64) -> Float64:
        """Return about how far places are from the bald spot around an ear, metres; negative in it."""
        y, z, tall, wide = self._ear
        # The ear leans back: its ellipse does too.
        lean = at[:, 1] - y
        around = np.hypot(lean / tall, (at[:, 2] - z + EAR_LEAN * lean) / wide)
        return np.where(np.abs(at[:, 0]) > EARS_FROM, (around - 1) * wide, np.inf)

    def height(self, line: Any, at: Float64) -> Float64:
        """Return the height (n,) above the eyes of a line (degrees, metres on its own head) over places."""
        return np.asarray(self._stretched(self.degrees(at), np.array(line, float).T))

    def _stretched(self, degrees: Any, line: Float64) -> Any:
        height = np.interp(degrees, *line)
        return height * np.where(height > 0, self._above, self._below)

    def skull(self, ways: Float64) -> Float64:
        """Return where unit vectors (n, 3) from the middle leave the skull, without ears: (n, 3) metres."""
        off, near = self._bone.query(ways, NEAR)
        share = 1 / (np.asarray(off) + 0.02) ** 2
        away = (self._away[near] * share).sum(axis=1) / share.sum(axis=1)
        return np.asarray(self.middle + ways * away[:, None])

    def lift(self, at: Float64) -> tuple[Float64, Float64]:
        """Return the height of places above the skin, without ears, (n,) metres, and its normal (n, 3)."""
        off, near = self._skull.query(at, 3)
        near = self._bones[near]
        share = 1 / (np.asarray(off) + 1e-4)
        share /= share.sum(axis=1, keepdims=True)
        ups = (self.ups[near] * share[..., None]).sum(axis=1)
        ups /= np.maximum(np.linalg.norm(ups, axis=1, keepdims=True), 1e-9)
        each = ((at[:, None] - self.at[near]) * self.ups[near]).sum(axis=2)
        return np.asarray((each * share).sum(axis=1)), np.asarray(ups)

    def distance(self, at: Float64) -> Float64:
        """Return the distance of each place from the nearest vertex of the skin, (n,) metres."""
        return np.asarray(self._skin.query(at)[0])
