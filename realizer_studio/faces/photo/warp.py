"""The smooth warp that takes a person made of sliders to what two photographs show."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.reading import read_arrays
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.person.build import WARP
from realizer_studio.faces.photo.fit import Fit, Sight
from realizer_studio.faces.photo.shape import DISTANCE, Pose
from realizer_studio.tracking.landmarks import COUNT

KEPT = 0.5  # weight of the sliders' place beside that of a landmark in a picture
SMOOTH = 2e-4  # of the spline, metres
NEAR, FAR = 0.035, 0.13  # m from the landmarks at which the warp begins to fade, and ends
MIRROR = np.array([-1.0, 1.0, 1.0])


@dataclass(frozen=True, eq=False)
class Warp:
    """A smooth map of space: a spline through the moves of some places (biharmonic, Carr et al. 2001)."""

    places: Float64  # (k, 3) metres; mirror images of each other on both sides
    moves: Float64  # (k, 3) metres; mirror images of each other on both sides

    def __call__(self, at: Float64) -> Float64:
        """Return where places (n, 3) go; those far from the face stay."""
        from scipy.interpolate import RBFInterpolator
        from scipy.spatial import cKDTree

        spline = RBFInterpolator(self.places, self.moves, kernel="linear", degree=0, smoothing=SMOOTH)
        away = np.asarray(cKDTree(self.places).query(at)[0])
        near = np.flatnonzero(away < FAR)
        out = np.array(at, np.float64)
        out[near] += smooth(away[near], FAR, NEAR)[:, None] * spline(out[near])
        return out

    def write(self, folder: Path) -> None:
        """Write it into the folder of a face."""
        np.savez_compressed(folder / WARP, places=self.places, moves=self.moves)


def read_warp(folder: Path) -> Warp | None:
    """Return the warp of a face's folder, None if it has none.

    Raises:
        FaceError: the file is damaged.
    """
    if not (folder / WARP).is_file():
        return None
    arrays = read_arrays(folder / WARP, {"places": 2, "moves": 2})
    return Warp(arrays["places"], arrays["moves"])


def warp_of(fit: Fit, at: Float64) -> Warp:
    """Return the warp after which the base mesh (n, 3) of a fit's sliders is seen as in its pictures.

    Each landmark moves to where both pictures see it (least squares); both halves of the face become alike.
    """
    places = fit.sights[0].places
    left, right = np.tile(KEPT * np.eye(3), (COUNT, 1, 1)), np.zeros((COUNT, 3))
    for sight, pose in zip(fit.sights, fit.poses, strict=True):
        ways, off = sight.off(pose, at)
        slopes = np.einsum("kji,kin->kjn", ways, _slopes(sight, pose, at))
        np.add.at(left, sight.places.numbers, np.einsum("kjm,kjn->kmn", slopes, slopes))
        np.add.at(right, sight.places.numbers, np.einsum("kjm,kj->km", slopes, off))
    # A landmark and the mirror image of its twin are the same place of the face.
    where = places.on(at)
    twin = np.linalg.norm(where[:, None] * MIRROR - where, axis=2).argmin(axis=1)
    left, right = left[places.numbers], right[places.numbers]
    left, right = left + left[twin] * np.outer(MIRROR, MIRROR), right + right[twin] * MIRROR
    return Warp((where + where[twin] * MIRROR) / 2, np.linalg.solve(left, right[..., None])[..., 0])


def _slopes(sight: Sight, pose: Pose, at: Float64) -> Float64:
    """Return (k, 2, 3): how far places are seen to go, in metres of the picture, where they move by one."""
    near = pose(sight.places.on(at))[1]
    scale = DISTANCE / (DISTANCE - near)
    return scale[:, None, None] * (pose.rotation[:2] * ((1,), (-1,)))
