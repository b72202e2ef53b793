"""Cameras with their presets, and the projection of points to pixels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, Float64
from realizer.core.errors import UnknownLookError
from realizer.face.model import Face


@dataclass(frozen=True, slots=True)
class Framing:
    """A preset: the direction of the camera, and the heights of hairline and chin in the picture.

    Attributes:
        yaw: degrees around the head; positive is the character's left.
        hairline, chin: heights of feature points 11.1 and 2.1, as fractions of the picture from the top.
        distance: metres from the origin between the eyes; nearer cameras make noses big.
    """

    yaw: float = 0.0
    hairline: float = 0.22
    chin: float = 0.72
    distance: float = 1.8


# "front" must not change: hairline to chin is half of the height, with the centre 47 % from the top.
PRESETS: Mapping[str, Framing] = {
    "front": Framing(),
    "three-quarter": Framing(yaw=-35),
    "profile": Framing(yaw=-90),
    "close": Framing(hairline=0.08, chin=0.90, distance=1.5),
}


HEAD = 0.66  # width by height of the narrowest picture that holds the head; as in the page's stage.js


@dataclass(frozen=True, eq=False, slots=True)
class Camera:
    """A camera at the height of its target.

    Attributes:
        position, target: (3,) float64 metres.
        fovy: angle of the picture's height in radians.
        near, far: distances of the clipping planes in metres.
    """

    name: str
    position: Float64
    target: Float64
    fovy: float
    near: float
    far: float

    @property
    def towards(self) -> Float32:
        """The direction from the head towards the camera, (3,) float32, length 1."""
        back = self.position - self.target
        return (back / np.linalg.norm(back)).astype(np.float32)

    @property
    def pose(self) -> Float64:
        """The matrix (4, 4) from camera to world; as in OpenGL, the camera looks along -z, and +y is up."""
        pose = np.eye(4)
        back = np.asarray(self.towards, np.float64)
        right = np.cross([0, 1, 0], back)
        right /= np.linalg.norm(right)
        pose[:3, :4] = np.stack([right, np.cross(back, right), back, self.position], axis=1)
        return pose

    def project(self, points: Any, size: tuple[int, int]) -> tuple[Float64, Float64]:
        """Return the pixels (n, 2) of points (n, 3) from the top left corner, and their depths (n,) in m."""
        width, height = size
        right, up, back = (
            self.pose[:3, :3].T @ (np.asarray(points, np.float64) - self.position).reshape(-1, 3).T
        )
        scale = height / 2 / math.tan(self.fovy / 2)
        return np.stack([width / 2 - scale * right / back, height / 2 + scale * up / back], axis=1), -back

    def fitted(self, size: tuple[int, int]) -> Camera:
        """Return the camera with a wider angle for a picture that is too narrow for the head, (w, h)."""
        wider = max(1.0, HEAD * size[1] / size[0])
        return replace(self, fovy=2 * math.atan(wider * math.tan(self.fovy / 2)))

    def to_json(self) -> dict[str, Any]:
        """Return the camera as JSON for the page; `fovy` is in degrees, as in WebGL libraries."""
        return {
            "name": self.name,
            "position": [round(float(x), 6) for x in self.position],
            "target": [round(float(x), 6) for x in self.target],
            "up": [0, 1, 0],
            "fovy": round(math.degrees(self.fovy), 5),
            "near": self.near,
            "far": self.far,
        }


def camera_names(face: Face) -> tuple[str, ...]:
    """Return the presets of every face, then the face's own."""
    return (*PRESETS, *(name for name in face.cameras if name not in PRESETS))


def camera_for(face: Face, name: str = "front") -> Camera:
    """Return the camera of that name for this face.

    Raises:
        UnknownLookError: no such camera; the text lists the known ones.
    """
    if name in face.cameras:
        framing = Framing(**face.cameras[name])
    elif name in PRESETS:
        framing = PRESETS[name]
    else:
        raise UnknownLookError(f"camera: wanted one of {', '.join(camera_names(face))}, got {name!r}")
    yaw = math.radians(framing.yaw)
    back = np.array([math.sin(yaw), 0.0, math.cos(yaw)])
    right = np.array([math.cos(yaw), 0.0, -math.sin(yaw)])
    hairline, chin = (np.asarray(face.points[p], np.float64) for p in ("11.1", "2.1"))
    # A point at height y and depth d is (y - eye) / (d tan(fovy / 2)) above the picture's centre, in halves
    # of its height. Two points determine the two unknowns eye and fovy.
    high, low = 1 - 2 * framing.hairline, 1 - 2 * framing.chin
    depths = [framing.distance - float(p @ back) for p in (hairline, chin)]
    tangent = (hairline[1] - chin[1]) / (high * depths[0] - low * depths[1])
    eye = hairline[1] - high * depths[0] * tangent
    sideways = _sideways(face, right, framing.yaw)
    target = right * sideways + np.array([0.0, eye, 0.0])
    low_corner, high_corner = face.bounds
    reach = float(np.max(np.abs([low_corner, high_corner])))
    return Camera(
        name=name,
        position=target + back * framing.distance,
        target=target,
        fovy=2 * math.atan(tangent),
        near=max(0.05, framing.distance - 2 * reach),
        far=framing.distance + 4 * reach,
    )


def _sideways(face: Face, right: Float64, yaw: float) -> float:
    """Return the metres of the centre along `right`: half-way between the outermost points above the chin.

    From the front it is at the chin, so that hair does not shift the face.
    """
    if yaw == 0:
        return float(np.asarray(face.points["2.1"], np.float64) @ right)
    head = face.vertices[face.vertices[:, 1] > face.points["2.1"][1]]
    across = head @ right
    return float(across.min() + across.max()) / 2
