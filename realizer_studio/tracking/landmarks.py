"""A network for 468 landmarks of a face with depth, and the contours of its eyes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from realizer.core.array_types import Float32, Float64
from realizer_studio.tracking.network import Region, network

if TYPE_CHECKING:
    from PIL.Image import Image

MODEL, EYE_MODEL = "face_landmark", "iris_landmark"
COUNT = 468
POINTS, PRESENCE, TRAITS = "conv2d_21", "conv2d_31", "p_re_lu_17"
CONTOUR, IRIS = "output_eyes_contours_and_brows", "output_iris"
IRIS_MIDDLE = 71  # row of `Landmarks.eyes`
MIN_PRESENCE = 0.5
NEW_PRESENCE = 0.9  # of a face that was not in the previous picture; letters of a title reach 0.65
# Corners of the eyes from left to right in a frontal picture: right eye outer and inner, left eye inner and
# outer.
RIGHT_EYE, LEFT_EYE = (33, 133), (362, 263)
MARGIN, EYE_MARGIN = 1.5, 2.3  # of a region, relative to the points


@dataclass(frozen=True, eq=False, slots=True)
class Landmarks:
    """A face in a picture."""

    points: Float64  # (468, 3) pixels: x right, y down, and depth away from the camera
    presence: float  # 0..1, the probability of a face
    traits: Float32  # (1152,) outputs of the last inner layer, which also depend on wrinkles and teeth
    # (2, 76, 2) points of the left and the right eye, 71 of contour and brow and 5 of the iris, in
    # coordinates 0..1 of the square around the eye, which is mirrored for the left one.
    eyes: Float32

    @property
    def region(self) -> Region:
        """The region in which the face is searched in the next picture."""
        return face_region(self.points)

    @property
    def irises(self) -> Float64:
        """The centres of the left and the right iris (2, 2) in pixels."""
        squares = (eye_region(self.points, corners) for corners in (LEFT_EYE, RIGHT_EYE))
        both = zip(squares, self.eyes, strict=True)
        return np.array([square.to_picture(eye[[IRIS_MIDDLE]])[0] for square, eye in both])


def face_region(points: Float64) -> Region:
    """Return the region around the landmarks (468, 3) of a face."""
    return Region.around(points[:, :2], points[RIGHT_EYE[0]], points[LEFT_EYE[1]], MARGIN)


def eye_region(points: Float64, corners: tuple[int, int]) -> Region:
    """Return the square around an eye with two landmarks as corners; that of the left eye is mirrored."""
    first, last = points[list(corners), :2]
    return replace(Region.around([first, last], first, last, EYE_MARGIN), mirrored=corners == LEFT_EYE)


def landmarks(picture: Image, region: Region, refine: bool = False) -> Landmarks:
    """Return the landmarks of the face in a region of a picture.

    With `refine`, the landmarks are computed again in their own region, which is better than the detector's.
    """
    model = network(MODEL, TRAITS)
    outputs = model(region.cut(picture, model.size))
    points = region.to_picture(outputs[POINTS].reshape(COUNT, 3) / model.size)
    presence = 1 / (1 + math.exp(-float(np.clip(outputs[PRESENCE].item(), -50, 50))))
    if refine and presence >= MIN_PRESENCE:
        return landmarks(picture, face_region(points))
    eyes = np.stack([_eye(picture, eye_region(points, corners)) for corners in (LEFT_EYE, RIGHT_EYE)])
    return Landmarks(points, presence, outputs[TRAITS].ravel().copy(), eyes)


def _eye(picture: Image, region: Region) -> Float32:
    model = network(EYE_MODEL)
    outputs = model(region.cut(picture, model.size))
    rows = np.concatenate([outputs[name].reshape(-1, 3)[:, :2] for name in (CONTOUR, IRIS)])
    return np.asarray(rows / model.size, np.float32)
