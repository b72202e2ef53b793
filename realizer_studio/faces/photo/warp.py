"""The smooth warp from a person described by sliders to the shape in two photographs."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

from realizer.core.array_types import Float64
from realizer.face.reading import read_arrays
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.person.person_build import WARP
from realizer_studio.faces.photo.photo_fit import Fit, Observation
from realizer_studio.faces.photo.shape import DISTANCE, Pose
from realizer_studio.tracking.landmarks import COUNT

PRIOR_WEIGHT = 0.5  # weight of the sliders' position relative to that of a landmark in a picture
SMOOTH = 2e-4  # of the spline, metres
NEAR, FAR = 0.035, 0.13  # m from the landmarks where the warp begins to fade, and ends
MIRROR = np.array([-1.0, 1.0, 1.0])


@dataclass(frozen=True, eq=False)
class Warp:
    """A smooth map of space: a biharmonic spline through displacements of points (Carr et al. 2001)."""

    positions: Float64  # (k, 3) metres; mirror images of each other on both sides
    moves: Float64  # (k, 3) metres; mirror images of each other on both sides

    def __call__(self, at: Float64) -> Float64:
        """Return the warped points (n, 3); points far from the face are unchanged."""
        spline = RBFInterpolator(self.positions, self.moves, kernel="linear", degree=0, smoothing=SMOOTH)
        distance = np.asarray(cKDTree(self.positions).query(at)[0])
        near = np.flatnonzero(distance < FAR)
        out = np.array(at, np.float64)
        out[near] += smooth(distance[near], FAR, NEAR)[:, None] * spline(out[near])
        return out

    def write(self, folder: Path) -> None:
        """Write it into the folder of a face."""
        np.savez_compressed(folder / WARP, places=self.positions, moves=self.moves)


def read_warp(folder: Path) -> Warp | None:
    """Return the warp of a face folder, or None if it has none.

    Raises:
        FaceError: the file is damaged.
    """
    if not (folder / WARP).is_file():
        return None
    arrays = read_arrays(folder / WARP, {"places": 2, "moves": 2})
    return Warp(arrays["places"], arrays["moves"])


def warp_of(fit: Fit, at: Float64) -> Warp:
    """Return the warp from the base mesh (n, 3) of a fit's sliders to the shape in its pictures.

    Each landmark moves to its least-squares position in both pictures; the warp is symmetric.
    """
    anchors = fit.observations[0].anchors
    left, right = np.tile(PRIOR_WEIGHT * np.eye(3), (COUNT, 1, 1)), np.zeros((COUNT, 3))
    for observation, pose in zip(fit.observations, fit.poses, strict=True):
        directions, distances = observation.residuals(pose, at)
        slopes = np.einsum("kji,kin->kjn", directions, _slopes(observation, pose, at))
        np.add.at(left, observation.anchors.numbers, np.einsum("kjm,kjn->kmn", slopes, slopes))
        np.add.at(right, observation.anchors.numbers, np.einsum("kjm,kj->km", slopes, distances))
    # The equations of a landmark and of the mirror image of its twin are added.
    landmarks = anchors.positions(at)
    twin = np.linalg.norm(landmarks[:, None] * MIRROR - landmarks, axis=2).argmin(axis=1)
    left, right = left[anchors.numbers], right[anchors.numbers]
    left, right = left + left[twin] * np.outer(MIRROR, MIRROR), right + right[twin] * MIRROR
    return Warp((landmarks + landmarks[twin] * MIRROR) / 2, np.linalg.solve(left, right[..., None])[..., 0])


def _slopes(observation: Observation, pose: Pose, at: Float64) -> Float64:
    """Return the derivatives (k, 2, 3) of landmarks in the picture, in metres, by their positions."""
    near = pose(observation.anchors.positions(at))[1]
    scale = DISTANCE / (DISTANCE - near)
    return scale[:, None, None] * (pose.rotation[:2] * ((1,), (-1,)))
