"""Networks for action units, FAPs and the pose of the head from landmarks.

`training/train_action_units.py` trains them on renderings of the shipped heads. The inputs are principal
components of landmarks, relative to those of the same person at rest; a second network works without these.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from realizer.animation.axis import AU_NAMES
from realizer.core.array_types import Float32, Float64
from realizer.core.units import ANGLE_UNIT
from realizer.tables import HEAD_COLUMNS
from realizer_studio.analysis.faps_from_points import head_angles
from realizer_studio.tracking.landmarks import Landmarks

UP = np.array(
    [1.0, -1.0, -1.0]
)  # from pixels (y down, depth away from the camera) to heads (y up, z forward)
WEIGHTS = Path(__file__).with_name("weights.npz")
UNITS = (1, 2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 16, 17, 18, 20, 22, 23, 24, 25, 26, 27, 28, 43)
MEASURED_UNITS = tuple(name for name in AU_NAMES() if int(name.rstrip("LR")) in UNITS)
# Without compound FAPs, and those of pupils, nostrils, tongue, head (measured separately) and ears.
MEASURED_FAPS = tuple(k for k in range(3, 65) if k not in (27, 28, 29, 30, *range(43, 51)))
PARTS = ("shape", "traits", "eyes")  # of the components


def upright(points: Any, head: Any) -> tuple[Float64, Float64]:
    """Return the rotations (n, 3, 3) of faces, and their landmarks (n, 468, 3) aligned with a mean head.

    Size, position and rotation are fitted (Procrustes analysis; Kabsch 1976).

    Args:
        points: (n, 468, 3) pixels, as `Landmarks.points`.
        head: (468, 3) landmarks of the mean head, in distances of the outer corners of its eyes.
    """
    faces, head = np.asarray(points, np.float64) * UP, np.asarray(head, np.float64)
    faces, middle = faces - faces.mean(axis=1, keepdims=True), head.mean(axis=0)
    u, _, vt = np.linalg.svd(np.einsum("pi,npj->nij", head - middle, faces))
    vt[:, 2] *= np.linalg.det(u @ vt)[:, None]
    rotations = np.einsum("nij,njk->nki", u, vt)
    size = np.linalg.norm(faces, axis=(1, 2)) / np.linalg.norm(head - middle)
    return rotations, np.einsum("nji,npj->npi", rotations, faces) / size[:, None, None] + middle


@dataclass(frozen=True, eq=False)
class Components:
    """The principal components of a face's landmarks in n pictures."""

    values: Float64  # (n, k) principal components
    rotations: Float64  # (n, 3, 3) of the head, approximate


@dataclass(frozen=True, eq=False)
class Measured:
    """The measurements of a face in n pictures."""

    units: Float64  # (n, len(MEASURED_UNITS)) 0..1
    faps: (
        Float64  # (n, 68) FAPU; those that are not in `MEASURED_FAPS` are 0, except the rotations of the head
    )


def components(faces: Sequence[Landmarks], weights: Mapping[str, Any] | None = None) -> Components:
    """Return the components of faces."""
    weights = stored() if weights is None else weights
    rotations, shapes = upright(np.stack([face.points for face in faces]), weights["head"])
    parts = {
        "shape": shapes.reshape(len(faces), -1),
        "traits": np.stack([face.traits for face in faces]),
        "eyes": np.stack([face.eyes.ravel() for face in faces]),
    }
    values = [(parts[part] - weights[f"{part}_mean"]) @ weights[f"{part}_basis"] for part in PARTS]
    return Components(np.concatenate(values, axis=1).astype(np.float64), rotations)


def inputs(face: Components, neutral: Float64 | None) -> Float32:
    """Return the inputs of a network: components relative to the neutral face, that face, and the pose."""
    pose = 2 * head_angles(face.rotations)
    if neutral is None:
        return np.concatenate([face.values, pose], axis=1).astype(np.float32)
    neutral_rows = np.broadcast_to(neutral, face.values.shape)
    return np.concatenate([face.values - neutral_rows, neutral_rows, pose], axis=1).astype(np.float32)


def measure(face: Components, neutral: Float64 | None = None) -> Measured:
    """Return the measurements of a face; `neutral`: components (k,) of the person at rest."""
    weights, name = stored(), "alone" if neutral is None else "against"
    values = inputs(face, neutral)
    for layer in range(3):
        values = values @ weights[f"{name}_w{layer}"] + weights[f"{name}_b{layer}"]
        if layer < 2:
            values = np.maximum(values, 0)
    units, moved, turned = np.split(
        values.astype(np.float64), [len(MEASURED_UNITS), len(MEASURED_UNITS) + len(MEASURED_FAPS)], axis=1
    )
    frames = np.zeros((len(values), 68))
    frames[:, np.array(MEASURED_FAPS) - 1] = moved
    head = face.rotations @ Rotation.from_rotvec(turned).as_matrix()
    frames[:, HEAD_COLUMNS] = head_angles(head) / ANGLE_UNIT
    return Measured(np.clip(units, 0, 1), frames)


@cache
def stored() -> Mapping[str, Any]:
    """Return the trained arrays, of which those with a scale are stored as bytes."""
    with np.load(WEIGHTS) as file:
        arrays = {name: file[name] for name in file.files}
    return {
        name: array.astype(np.float32) * arrays.get(f"{name}_scale", np.float32(1))
        for name, array in arrays.items()
        if not name.endswith("_scale")
    }
