"""468 landmarks of a face, with depth, and its irises."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from realizer.core.array_types import Float64
from realizer.tracking.network import network
from realizer.tracking.region import Region

if TYPE_CHECKING:
    from PIL.Image import Image

MODEL, IRIS_MODEL = "face_landmark", "iris_landmark"
COUNT = 468
POINTS, PRESENCE, IRISES = "conv2d_21", "conv2d_31", "output_iris"
MIN_PRESENCE = 0.5
# Corners of the eyes in the order of the picture, of someone who faces it: right eye outer and inner, left
# eye inner and outer.
RIGHT_EYE, LEFT_EYE = (33, 133), (362, 263)
MARGIN, EYE_MARGIN = 1.5, 2.3  # of a region, relative to the points


@dataclass(frozen=True, eq=False, slots=True)
class Landmarks:
    """A face in a picture.

    Attributes:
        points: (468, 3) pixels: x right, y down, and depth away from the camera.
        presence: 0..1, how likely there is a face.
    """

    points: Float64
    presence: float

    @property
    def region(self) -> Region:
        """The region in which the face of the next picture is looked for."""
        return Region.around(self.points[:, :2], self.points[RIGHT_EYE[0]], self.points[LEFT_EYE[1]], MARGIN)


def landmarks(picture: Image, region: Region) -> Landmarks:
    """Return the landmarks of the face in a region of a picture."""
    model = network(MODEL)
    outputs = model(region.cut(picture, model.size))
    points = region.place(outputs[POINTS].reshape(COUNT, 3) / model.size)
    return Landmarks(points, 1 / (1 + math.exp(-float(np.clip(outputs[PRESENCE].item(), -50, 50)))))


def irises(picture: Image, face: Landmarks) -> Float64:
    """Return the middles of the irises (2, 2) in pixels, of the left and the right eye."""
    model, middles = network(IRIS_MODEL), []
    for (first, last), mirrored in ((LEFT_EYE, True), (RIGHT_EYE, False)):
        corners = face.points[[first, last], :2]
        around = Region.around(corners, corners[0], corners[1], EYE_MARGIN)
        eye = Region(around.x, around.y, around.side, around.angle, mirrored)
        iris = model(eye.cut(picture, model.size))[IRISES].reshape(5, 3)
        middles.append(eye.place(iris[:1] / model.size)[0, :2])
    return np.array(middles)
