"""Action units, FAPs and the pose of the head from landmarks, by networks that we train on our own heads.

`training/train_action_units.py` trains them. The principal components of what `landmarks` sees are
compared with those of the same person at rest; without a picture of it, a second network does its best.
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

UP = np.array([1.0, -1.0, -1.0])  # pixels go down, and depths away from the camera; heads look along +z
WEIGHTS = Path(__file__).with_name("weights.npz")
UNITS = (1, 2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 16, 17, 18, 20, 22, 23, 24, 25, 26, 27, 28, 43)
SEEN_UNITS = tuple(name for name in AU_NAMES() if int(name.rstrip("LR")) in UNITS)
# Not the compound ones, and those of pupils, nostrils, tongue, head (which is measured apart) and ears.
SEEN_FAPS = tuple(k for k in range(3, 65) if k not in (27, 28, 29, 30, *range(43, 51)))
PARTS = ("shape", "traits", "eyes")  # of the components


def upright(points: Any, head: Any) -> tuple[Float64, Float64]:
    """Return the rotations (n, 3, 3) of faces and their landmarks (n, 468, 3) as they lie on a mean head.

    Size, place and rotation are those that fit the head best (Procrustes analysis; Kabsch 1976).

    Args:
        points: (n, 468, 3) pixels, as `Landmarks.points`.
        head: (468, 3) landmarks of the mean head; 1 is the distance of the outer corners of its eyes.
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
    """What is seen of a face in n pictures, in few numbers."""

    values: Float64  # (n, k) principal components
    rotations: Float64  # (n, 3, 3) of the head, roughly


@dataclass(frozen=True, eq=False)
class Measured:
    """What n pictures of a face show."""

    units: Float64  # (n, len(SEEN_UNITS)) 0..1
    faps: Float64  # (n, 68) FAPU; those that are not in `SEEN_FAPS` are 0, except the rotations of the head


def components(faces: Sequence[Landmarks], weights: Mapping[str, Any] | None = None) -> Components:
    """Return the components of faces."""
    weights = stored() if weights is None else weights
    rotations, shapes = upright(np.stack([face.points for face in faces]), weights["head"])
    seen = {
        "shape": shapes.reshape(len(faces), -1),
        "traits": np.stack([face.traits for face in faces]),
        "eyes": np.stack([face.eyes.ravel() for face in faces]),
    }
    values = [(seen[part] - weights[f"{part}_mean"]) @ weights[f"{part}_basis"] for part in PARTS]
    return Components(np.concatenate(values, axis=1).astype(np.float64), rotations)


def inputs(seen: Components, neutral: Float64 | None) -> Float32:
    """Return what a network takes: components relative to the neutral face, that face, and the pose."""
    pose = 2 * head_angles(seen.rotations)
    if neutral is None:
        return np.concatenate([seen.values, pose], axis=1).astype(np.float32)
    rest = np.broadcast_to(neutral, seen.values.shape)
    return np.concatenate([seen.values - rest, rest, pose], axis=1).astype(np.float32)


def measure(seen: Components, neutral: Float64 | None = None) -> Measured:
    """Return what pictures of a face show; `neutral`: components (k,) of the person at rest."""
    weights, name = stored(), "alone" if neutral is None else "against"
    values = inputs(seen, neutral)
    for layer in range(3):
        values = values @ weights[f"{name}_w{layer}"] + weights[f"{name}_b{layer}"]
        if layer < 2:
            values = np.maximum(values, 0)
    units, moved, turned = np.split(
        values.astype(np.float64), [len(SEEN_UNITS), len(SEEN_UNITS) + len(SEEN_FAPS)], axis=1
    )
    frames = np.zeros((len(values), 68))
    frames[:, np.array(SEEN_FAPS) - 1] = moved
    head = seen.rotations @ Rotation.from_rotvec(turned).as_matrix()
    frames[:, HEAD_COLUMNS] = head_angles(head) / ANGLE_UNIT
    return Measured(np.clip(units, 0, 1), frames)


@cache
def stored() -> Mapping[str, Any]:
    """Return the trained arrays; those with a scale are kept as bytes."""
    with np.load(WEIGHTS) as file:
        arrays = {name: file[name] for name in file.files}
    return {
        name: array.astype(np.float32) * arrays.get(f"{name}_scale", np.float32(1))
        for name, array in arrays.items()
        if not name.endswith("_scale")
    }
