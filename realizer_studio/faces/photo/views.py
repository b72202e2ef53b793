"""The two photographs of a person, with landmarks and irises."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from realizer.core.array_types import Float64
from realizer.core.errors import FaceError
from realizer_studio.analysis.faps_from_points import head_angles
from realizer_studio.tracking.detector import detect
from realizer_studio.tracking.landmarks import (
    IRIS_MIDDLE,
    LEFT_EYE,
    RIGHT_EYE,
    Landmarks,
    eye_region,
    landmarks,
)
from realizer_studio.tracking.network import Region, TrackingError
from realizer_studio.tracking.pictures import read_picture
from realizer_studio.tracking.regressor import stored, upright

if TYPE_CHECKING:
    from PIL.Image import Image

FRONT, SIDE = "from the front", "from the side, turned by 30 to 60 degrees or by 90"
SURE = 0.95  # least presence of a face with reliable landmarks; it falls below at 70 degrees
STRAIGHT, TURNED = 15.0, 25.0  # degrees: maximum from the front, minimum from the side
SECOND = 0.5  # ratio of the sides of two faces, below which the smaller one is in the background
SMALL = 120  # pixels from forehead to chin, at least
GREY = 3  # of 255; largest difference between the channels of a grey picture


@dataclass(frozen=True, eq=False)
class View:
    """A photograph of a face."""

    image: Image  # RGB; a view from the side is mirrored if the face looks to the picture's left
    points: Float64 | None  # (468, 2) pixels, or None in profile, where landmarks are unreliable
    region: Region  # of the face
    turn: float  # degrees to its left, approximate; 90 in profile
    irises: Float64  # (2, 2) pixels, the centres of the irises
    iris: float  # pixels, their mean diameter


def read_views(front: Path, side: Path) -> tuple[View, View]:
    """Read the photographs of a person from the front and from the side.

    Raises:
        FaceError: a file is no picture, is grey, or has no face, several faces, or one of wrong size or turn.
    """
    one, other = _read(front, FRONT), _read(side, SIDE)
    if one.points is None or abs(one.turn) > STRAIGHT:
        swapped = "; are the two exchanged?" if abs(other.turn) <= STRAIGHT else ""
        raise FaceError(
            f"{front}: wanted a face {FRONT}, got one turned by {abs(one.turn):.0f} degrees{swapped}"
        )
    if abs(other.turn) < TURNED:
        raise FaceError(f"{side}: wanted a face {SIDE}, got one turned by {abs(other.turn):.0f} degrees")
    return one, other


def _read(path: Path, expected: str) -> View:
    try:
        image = read_picture(path)
    except TrackingError as error:
        raise FaceError(str(error)) from None
    small = np.asarray(image.resize((64, 64)), int)
    if np.ptp(small, axis=2).max() <= GREY:
        raise FaceError(f"{path}: wanted a picture in colour, got a grey one, which does not tell the skin's")
    view = _view(image, path, expected)
    if view.turn >= 0:
        return view
    from PIL import ImageOps

    return _view(ImageOps.mirror(image), path, expected) if expected == SIDE else view


def _view(image: Image, path: Path, expected: str) -> View:
    regions = sorted(detect(image, small=False), key=lambda region: -region.side)
    if not regions:
        raise FaceError(f"{path}: wanted a face {expected}, found none")
    count = sum(region.side > SECOND * regions[0].side for region in regions)
    if count > 1:
        raise FaceError(f"{path}: wanted one face, found {count}; cut the picture around one of them")
    face = landmarks(image, landmarks(image, regions[0], refine=True).region)
    if face.presence < SURE:
        return View(image, None, regions[0], 90.0, face.irises, 0.0)
    height = float(np.ptp(face.points[:, 1]))
    if height < SMALL:
        raise FaceError(f"{path}: wanted a face at least {SMALL} pixels high, got one of {height:.0f}")
    rotations, _ = upright(face.points[None], stored()["head"])
    turn = float(np.degrees(head_angles(rotations)[0, 1]))
    return View(image, face.points[:, :2], face.region, turn, face.irises, _iris(face))


def _iris(face: Landmarks) -> float:
    """Return the mean diameter of both irises in pixels, from four points on the rim of each."""
    both = zip((LEFT_EYE, RIGHT_EYE), face.eyes, strict=True)
    rims = [eye_region(face.points, corners).to_picture(eye[IRIS_MIDDLE:]) for corners, eye in both]
    return float(2 * np.mean([np.linalg.norm(rim[1:] - rim[0], axis=1) for rim in rims]))
