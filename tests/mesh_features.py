"""What the features of faces on pictures see of a deformed mesh."""

from __future__ import annotations

from typing import Any

import numpy as np

from realizer.analysis.faps_from_mesh import points_at_rest, points_of
from realizer.analysis.faps_from_points import faps_from_features, features_from_points
from realizer.core.array_types import Bool, Float32
from realizer.emotions.profile import Profile
from realizer.face.deform import deform
from realizer.face.model import Face

__all__ = ["features_from_mesh", "measurable_profile"]

DRAWS = 24  # random faces of a profile
LEAST = 40.0  # FAPU; smaller ranges of features are noise of their definitions


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
