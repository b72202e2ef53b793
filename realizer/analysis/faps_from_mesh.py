"""FAPs measured on a deformed mesh."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from realizer.analysis.faps_from_points import faps_from_points
from realizer.core.array_types import Bool, Float32, Float64
from realizer.face.deform import deform
from realizer.face.model import Face

PROBE = 60.0  # FAPU; far enough to be measured, near enough to be proportional
ROUNDS = 4  # rotations and slides are not linear; each round removes most of the remaining error


def points_of(face: Face, vertices: Any) -> dict[str, Float32]:
    """Name -> (n, 3) metres: where the feature points of a face are, of vertices (n, n_vertices, 3)."""
    return {name: vertices[:, index] for name, index in face.feature_points.items()}


def faps_from_mesh(face: Face, vertices: Any) -> tuple[Float32, Bool]:
    """The FAPs (n, 68) of vertices (n, n_vertices, 3) of that face, and which were observed.

    Raises:
        ValueError: vertices of another shape.
    """
    vertices = np.asarray(vertices)
    if vertices.ndim != 3 or vertices.shape[1:] != face.vertices.shape:
        raise ValueError(f"vertices: wanted (n, {len(face.vertices)}, 3), got {vertices.shape}")
    return faps_from_face(face, points_of(face, vertices))


def faps_from_face(face: Face, points: Mapping[str, Any]) -> tuple[Float32, Bool]:
    """Measure all feature points of the mesh, name -> (n, 3) metres.

    Points hang together in a face: what moves one moves its neighbours too. How much, is measured on the face
    itself, each FAP alone, and taken apart again; then the face is moved by what was found, and measured
    beside what was given.

    Raises:
        ValueError: not its points.
    """
    wanted, seen = faps_from_points(points, _at_rest(face), face.fapu)
    apart = _apart(face)
    found = wanted @ apart
    for _ in range(ROUNDS):
        read, _ = faps_from_points(points_of(face, deform(face, found)), _at_rest(face), face.fapu)
        found = found + (wanted - read) @ apart
    return found.astype(np.float32), seen


def _at_rest(face: Face) -> dict[str, Float32]:
    return {name: face.vertices[index] for name, index in face.feature_points.items()}


@lru_cache(maxsize=8)
def _apart(face: Face) -> Float64:
    """(68, 68): measured values, times this, are the face's FAPs."""
    _, seen = faps_from_points(points_of(face, face.vertices[None]), _at_rest(face), face.fapu)
    local = np.flatnonzero(seen)
    local = local[(local < 47) | (local > 49)]  # turns of the head are not proportional, and hang on nothing
    probes = np.zeros((len(local), 68), np.float32)
    probes[np.arange(len(local)), local] = PROBE
    read, _ = faps_from_points(points_of(face, deform(face, probes)), _at_rest(face), face.fapu)
    apart = np.eye(68)
    # A FAP that this face does not show (its own reading stays 0) must not make the others unreadable.
    apart[np.ix_(local, local)] = np.linalg.pinv(read[:, local].astype(np.float64) / PROBE, rcond=1e-3)
    return apart
