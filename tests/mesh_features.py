"""FAPs of a deformed mesh: measured on its points, and as the features of faces on pictures see them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from realizer.core.array_types import Bool, Float32, Float64
from realizer.emotions.profile import Profile
from realizer.face.deform import deform
from realizer.face.model import Face
from realizer_studio.analysis.faps_from_points import (
    faps_from_features,
    faps_from_points,
    features_from_points,
)

__all__ = [
    "faps_from_face",
    "faps_from_mesh",
    "features_from_mesh",
    "measurable_profile",
    "points_of",
]

PROBE = 60.0  # FAPU; large enough to be measured, small enough to be linear
ROUNDS = 4  # rotations are not linear; each round removes most of the remaining error
DRAWS = 24  # random faces of a profile
LEAST = 40.0  # FAPU; smaller ranges of features are noise of their definitions


def points_of(face: Face, vertices: Any) -> dict[str, Float32]:
    """Return name -> (n, 3) of the feature points in vertices (n, n_vertices, 3), in metres."""
    return {name: vertices[:, index] for name, index in face.feature_points.items()}


def faps_from_mesh(face: Face, vertices: Any) -> tuple[Float32, Bool]:
    """Return the FAPs (n, 68) of vertices (n, n_vertices, 3) of a face, and which of them were observed.

    Raises:
        ValueError: vertices of another shape.
    """
    vertices = np.asarray(vertices)
    if vertices.ndim != 3 or vertices.shape[1:] != face.vertices.shape:
        raise ValueError(f"vertices: wanted (n, {len(face.vertices)}, 3), got {vertices.shape}")
    return faps_from_face(face, points_of(face, vertices))


def faps_from_face(face: Face, points: Mapping[str, Any]) -> tuple[Float32, Bool]:
    """Return the FAPs (n, 68) of the feature points of a face, and which of them were observed.

    A FAP also moves neighbouring points. This crosstalk is measured for each FAP alone and removed; the
    result is refined by deforming the face and comparing its points with the given ones.

    Args:
        points: name -> (n, 3) in metres.

    Raises:
        ValueError: points that the face does not have.
    """
    wanted, seen = faps_from_points(points, points_at_rest(face), face.fapu)
    inverse = _inverse_crosstalk(face)
    faps = wanted @ inverse
    for _ in range(ROUNDS):
        read, _ = faps_from_points(points_of(face, deform(face, faps)), points_at_rest(face), face.fapu)
        faps = faps + (wanted - read) @ inverse
    return faps.astype(np.float32), seen


def points_at_rest(face: Face) -> dict[str, Float32]:
    """Return name -> (3,) of the feature points of a face at rest, in metres."""
    return {name: face.vertices[index] for name, index in face.feature_points.items()}


@lru_cache(maxsize=8)
def _inverse_crosstalk(face: Face) -> Float64:
    """Return the (68, 68) matrix that turns measured values into FAPs."""
    _, seen = faps_from_points(points_of(face, face.vertices[None]), points_at_rest(face), face.fapu)
    local = np.flatnonzero(seen)
    local = local[(local < 47) | (local > 49)]  # without the rotations of the head
    probes = np.zeros((len(local), 68), np.float32)
    probes[np.arange(len(local)), local] = PROBE
    read, _ = faps_from_points(points_of(face, deform(face, probes)), points_at_rest(face), face.fapu)
    inverse = np.eye(68)
    # The pseudo-inverse ignores FAPs that this face does not show.
    inverse[np.ix_(local, local)] = np.linalg.pinv(read[:, local].astype(np.float64) / PROBE, rcond=1e-3)
    return inverse


def features_from_mesh(face: Face, vertices: Any) -> tuple[Float32, Bool]:
    """Return the FAPs (n, 68) that the 15 features of vertices determine, and which they are (3.2)."""
    features = features_from_points(points_of(face, np.asarray(vertices)), points_at_rest(face), face.fapu)
    return faps_from_features(features)


def measurable_profile(profile: Profile, face: Face) -> Profile:
    """Return the profile that features measure on a face that shows this one: its ranges in feature space.

    Features measure the outer lips, and both lids together; a FAP also moves the points of others.
    """
    shown = np.stack([profile.frame(), *(profile.draw(seed) for seed in range(DRAWS))])
    values, _ = features_from_mesh(face, deform(face, shown))
    low, high = values.min(axis=0), values.max(axis=0)
    moved = np.flatnonzero(np.maximum(-low, high) > LEAST)
    return Profile(profile.name, profile.source, {k + 1: (low[k], high[k]) for k in moved.tolist()})
