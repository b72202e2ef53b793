"""Shapes of faces, without the pose of the head."""

from typing import Any

import numpy as np

from realizer.core.array_types import Float64

UP = np.array([1.0, -1.0, -1.0])  # pixels go down, and depths away from the camera; heads look along +z


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


def head_angles(rotations: Any) -> Float64:
    """Return (n, 3) radians of FAPs 48 to 50: pitch down, yaw to the face's left, roll to its right."""
    rotations = np.asarray(rotations, np.float64)
    pitch = np.arcsin(np.clip(-rotations[:, 1, 2], -1, 1))
    yaw = np.arctan2(rotations[:, 0, 2], rotations[:, 2, 2])
    return np.stack([pitch, yaw, np.arctan2(rotations[:, 1, 0], rotations[:, 1, 1])], axis=1)
