"""The view of a lamp that casts shadows."""

from typing import Any

import numpy as np

from realizer.core.array_types import Float32, Float64

SIDE = 256  # texels
NEAR, ASIDE = 0.0015, 0.0035  # m before the surface where light is looked for; more where that is aslant,
SOFT = 0.003  # and m over which what is behind something grows dark


class LampView:
    """The box around a head as a lamp far away sees it.

    Attributes:
        matrix: (3, 4) float32; matrix @ (x, y, z, 1) = texels to the right and down, and depth from 0 (near
            the lamp) to 1.
    """

    def __init__(self, direction: Any, low: Any, high: Any) -> None:
        """Make the view towards -direction of a box from corner `low` to `high`, metres."""
        back = np.asarray(direction, np.float64) / np.linalg.norm(direction)
        right = np.cross([0, 1, 0], back) if abs(back[1]) < 0.99 else np.array([1.0, 0, 0])
        right /= np.linalg.norm(right)
        axes = np.stack([right, np.cross(right, back), -back])  # down is right x back
        middle, half = (np.add(low, high)) / 2, np.linalg.norm(np.subtract(high, low)) / 2
        scale = np.array([SIDE / 2, SIDE / 2, 1 / 2]) / half
        offset = np.array([SIDE / 2, SIDE / 2, 1 / 2]) - scale * (axes @ middle)
        self.matrix: Float32 = np.hstack([axes * scale[:, None], offset[:, None]]).astype(np.float32)

    def project(self, points: Float32) -> Float64:
        """Return texels and depth (n, 3) of points (n, 3)."""
        return np.asarray(points @ self.matrix[:, :3].T + self.matrix[:, 3], np.float64)
