"""Highlights on the eyes, as vertices that follow each frame."""

from typing import Any

import numpy as np

from realizer.core.array_types import Float32, Int32
from realizer.face.mesh_geometry import fit_ball
from realizer.face.model import Face
from realizer.render.light import Light, unit

EYES = ("left_eye", "right_eye")
ROUND = 10  # corners
LIFT = 1.004  # of the eye's radius: above its surface, below the lids


class EyeHighlights:
    """A cap of `ROUND` triangles on each eye, white; the eye turns under it, closed lids hide it.

    Eyes have too few vertices to shade anything so small.
    """

    def __init__(self, face: Face, light: Light, towards_camera: Float32) -> None:
        middle = unit(unit(light.key.direction) + light.glint * towards_camera)
        aside = unit(np.cross([0, 1, 0], middle))
        above = np.cross(middle, aside)
        turn = np.linspace(0, 2 * np.pi, ROUND, endpoint=False)[:, None]
        edge = np.cos(light.glint_width) * middle + np.sin(light.glint_width) * (
            np.cos(turn) * aside + np.sin(turn) * above
        )
        self._directions = np.vstack([middle, edge]).astype(np.float32)
        self._eyes = [_Ball(face, *face.parts[name]) for name in EYES if name in face.parts]
        corner = np.arange(ROUND)
        cap = np.stack([np.zeros(ROUND, np.int64), 1 + corner, 1 + (corner + 1) % ROUND], axis=1)
        caps = [cap + k * (ROUND + 1) for k in range(len(self._eyes))]
        self.triangles: Int32 = np.concatenate([np.zeros((0, 3), np.int64), *caps]).astype(np.int32)

    def to_json(self) -> dict[str, Any]:
        """Return the highlights as numbers, for clients that draw the face themselves.

        A cap's middle is towards key + `Light.glint` x the camera, its edge `Light.glint_width` away; its
        points lie `radius` from the centre, which is the sum of the weights times the vertices from `first`.
        """
        return {
            "corners": ROUND,
            "eyes": [
                {
                    "first": ball.first,
                    "weights": [round(float(w), 6) for w in ball.weights],
                    "radius": round(float(ball.radius) * LIFT, 7),
                }
                for ball in self._eyes
            ],
        }

    def __call__(self, vertices: Float32) -> Float32:
        """Return the caps' points (n, 3) float32 metres, for the head's vertices (n_vertices, 3)."""
        caps = [ball.centre(vertices) + self._directions * ball.radius * LIFT for ball in self._eyes]
        return np.concatenate([np.zeros((0, 3), np.float32), *caps]).astype(np.float32)


class _Ball:
    """An eyeball's radius, and its centre as a fixed mixture of its vertices: true however it moves."""

    def __init__(self, face: Face, first: int, last: int) -> None:
        points = face.vertices[first:last].astype(np.float64)
        local = points - points.mean(axis=0)  # for the sake of the numbers
        centre, _ = fit_ball(local)
        mixture = np.vstack([local.T, np.ones(len(local))])
        self.weights: Float32 = np.linalg.lstsq(mixture, [*centre, 1.0], rcond=None)[0].astype(np.float32)
        # The bulge of the cornea counts, if the eye has one.
        self.radius = np.float32(np.linalg.norm(local - centre, axis=1).max())
        self.first, self._range = first, slice(first, last)

    def centre(self, vertices: Float32) -> Float32:
        centre: Float32 = self.weights @ vertices[self._range]
        return centre
