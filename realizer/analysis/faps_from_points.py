"""FAPs and facial features from tracked feature points."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from realizer import tables
from realizer.core.array_types import Bool, Float32, Float64
from realizer.core.units import ANGLE_UNIT
from realizer.emotions.profile import Profile
from realizer.tables.facial_features import facial_features

if TYPE_CHECKING:
    from realizer.face.model import Fapu

Points = Mapping[str, Any]  # name such as "2.1" -> (n, 3) or (3,) metres

# Points on the skull; corners of the eyes are next best, if a tracker has no others.
SKULL = ("11.1", "11.2", "11.3", "11.4", "11.5", "11.6")
CORNERS = ("3.7", "3.8", "3.11", "3.12")
HEAD = slice(47, 50)
OUTER_LIPS = {4: 51, 5: 52}  # FAPs of the middle of the lips: the features are measured at 8.1 and 8.2
CHIN, JAW, DEPRESS_CHIN, OPEN_JAW = "2.10", "2.1", 17, 2
# Each FAP's direction in the standard: axis and sense of x to the character's left, y up, z forward.
WAYS = {"left": (0, 1), "right": (0, -1), "up": (1, 1), "down": (1, -1), "forward": (2, 1)}


def faps_from_points(points: Points, neutral: Points, fapu: Fapu) -> tuple[Float32, Bool]:
    """Return the FAPs of tracked feature points (Raouzaiou et al. 2002, figure 1).

    The head's turn is found first (FAPs 48 to 50) and taken away, wherever the head has gone; then each FAP
    is how far its own point has moved along its own axis, in its unit.

    Args:
        points: (n, 3) metres each, +x the character's left, +y up, +z forward; NaN where a point was lost.
        neutral: (3,) metres each, of the same face at rest.
        fapu: of the same face.

    Returns:
        (n, 68) FAP values, 0 if unobserved, and (68,) which of them were observed all the time.

    Raises:
        ValueError: no points, some that have no neutral place, or that are not as many as each other.
    """
    places, rest = _checked(points, neutral)
    count = len(next(iter(places.values())))
    values, seen = np.zeros((count, 68), np.float32), np.zeros(68, bool)
    turns = _turns(places, rest)
    if turns is not None:
        rotation, moved = turns
        values[:, HEAD] = _angles(rotation) / ANGLE_UNIT
        seen[HEAD] = True
        # The rest is relative to the skull.
        places = {name: np.einsum("nji,nj->ni", rotation, at - moved) for name, at in places.items()}
    for row in tables.faps():
        if row.feature_point in places and row.direction in WAYS and row.unit not in ("none", "angle_unit"):
            axis, sense = WAYS[row.direction]
            away = places[row.feature_point][:, axis] - rest[row.feature_point][axis]
            values[:, row.fap - 1] = sense * away / fapu.metres(row.unit)
            seen[row.fap - 1] = True
    if seen[DEPRESS_CHIN] and seen[OPEN_JAW]:
        values[:, DEPRESS_CHIN] += values[:, OPEN_JAW]  # 2.10 rides on the jaw
    lost = np.isnan(values)
    values[lost] = 0
    return values, seen & ~lost.any(axis=0)


def features_from_points(points: Points, neutral: Points, fapu: Fapu) -> Float64:
    """(n, 15) f1..f15: distances between feature points (table 3); how the head is turned does not matter.

    Raises:
        ValueError: as `faps_from_points`, or one of the points is missing.
    """
    places, rest = _checked(points, neutral)
    wanted = {name for row in facial_features() for name in (row.first, row.second)}
    if missing := sorted(wanted - set(places)):
        raise ValueError(f"points: wanted the 19 of the features, these are missing: {', '.join(missing)}")
    columns = []
    for row in facial_features():
        now = np.linalg.norm(places[row.first] - places[row.second], axis=1)
        before = np.linalg.norm(rest[row.first] - rest[row.second])
        columns.append(row.growth * (now - before) / fapu.metres(row.unit))
    return np.stack(columns, axis=1)


def features_from_faps(frames: Any) -> Float64:
    """(n, 15) the features that FAPs (n, 68) should give: f12 = -(F19 + F21), f14 = F53 + F54 and so on."""
    values = np.asarray(frames, np.float64)
    if values.ndim != 2 or values.shape[1] != 68:
        raise ValueError(f"frames: wanted (n, 68), got {values.shape}")
    return values @ _sums().T


def faps_from_features(features: Any) -> tuple[Float32, Bool]:
    """Return the FAPs that features (n, 15) determine: (n, 68), and (68,) which FAPs those are.

    A feature that is the sum of several FAPs gives each an equal part (3.2). What f1 and f2 say of a brow is
    better than f15, which is both together, and wins.
    """
    values = np.asarray(features, np.float64)
    if values.ndim != 2 or values.shape[1] != 15:
        raise ValueError(f"features: wanted (n, 15), got {values.shape}")
    frames, seen = np.zeros((len(values), 68), np.float32), np.zeros(68, bool)
    for row, column in zip(facial_features(), values.T, strict=True):
        part = column / len(row.signs)
        signs = dict(row.signs) | dict.fromkeys(row.also, 1)
        for fap, sign in signs.items():
            if not seen[fap - 1]:
                frames[:, fap - 1], seen[fap - 1] = sign * part, True
    return frames, seen


def measurable_profile(profile: Profile) -> Profile:
    """Return the profile that `faps_from_features` would find on a face which shows this one.

    Distances are taken between outer points of the lips, and lids are seen together: what a profile says of
    the outer lips stands for the inner ones, the opening of the mouth is theirs, and FAPs of one feature
    share its range.
    """
    told = dict(profile.ranges)
    zero = (0.0, 0.0)
    for inner, outer in OUTER_LIPS.items():
        if outer in told:
            told[inner] = told[outer]
    if {*OUTER_LIPS.values()} & {*told}:  # the lips part by their own FAPs, and not as a jaw opens
        (low, high), (a, b) = (told.get(outer, zero) for outer in OUTER_LIPS.values())
        told[3] = -high - b, -low - a
    ranges: dict[int, tuple[float, float]] = {}
    for row in facial_features():
        ends = [
            tuple(sorted((sign * a, sign * b)))
            for fap, sign in row.signs.items()
            for a, b in [told.get(fap, zero)]
        ]
        low, high = (sum(end) / len(ends) for end in zip(*ends, strict=True))
        for fap, sign in (row.signs | dict.fromkeys(row.also, 1)).items():
            if (low or high) and fap not in ranges:
                ranges[fap] = (low, high) if sign > 0 else (-high, -low)
    return Profile(profile.name, profile.source, ranges)


@cache
def _sums() -> Float64:
    sums = np.zeros((15, 68))
    for k, row in enumerate(facial_features()):
        for fap, sign in row.signs.items():
            sums[k, fap - 1] = sign
    return sums


def _checked(points: Points, neutral: Points) -> tuple[dict[str, Float64], dict[str, Float64]]:
    """Both as arrays, points (n, 3) and rest (3,)."""
    if not points:
        raise ValueError("points: wanted at least one feature point, got none")
    if lost := sorted(set(points) - set(neutral)):
        raise ValueError(f"points: wanted such as have a neutral place, got {', '.join(lost)}")
    places = {name: np.atleast_2d(np.asarray(at, np.float64)) for name, at in points.items()}
    rest = {name: np.asarray(neutral[name], np.float64) for name in points}
    if bad := sorted({at.shape for at in rest.values()} - {(3,)}):
        raise ValueError(f"neutral: wanted (3,) each, got {bad[0]}")
    shapes = sorted({at.shape for at in places.values()})
    if len(shapes) != 1 or shapes[0][1:] != (3,) or not shapes[0][0]:
        raise ValueError(f"points: wanted (n, 3) each, all of one n, got {', '.join(map(str, shapes))}")
    if not all(np.isfinite(at).all() for at in rest.values()):
        raise ValueError("neutral: wanted finite places, got NaN or infinity")
    return places, rest


def _turns(places: Mapping[str, Float64], rest: Mapping[str, Float64]) -> tuple[Float64, Float64] | None:
    """Return the rotation (n, 3, 3) and shift (n, 3) from the resting skull to each frame, or None.

    The best fit of points that go together (Kabsch 1976).
    """
    steady = [name for name, at in places.items() if not np.isnan(at).any()]
    groups = ([name for name in group if name in steady] for group in (SKULL, CORNERS))
    names = next((group for group in groups if len(group) >= 3), None)
    if names is None:
        return None
    before = np.stack([rest[name] for name in names])
    after = np.stack([places[name] for name in names], axis=1)
    middle, centre = before.mean(axis=0), after.mean(axis=1)
    covariance = np.einsum("ki,nkj->nij", before - middle, after - centre[:, None])
    u, _, vt = np.linalg.svd(covariance)
    mirrored = np.linalg.det(u @ vt) < 0
    vt[mirrored, 2] *= -1
    rotation = np.einsum("nij,njk->nki", u, vt)
    # In the skull's frame a point is at rest: R^T (p - shift) = p0.
    return rotation, centre - np.einsum("nij,j->ni", rotation, middle)


def _angles(rotation: Float64) -> Float64:
    """(n, 3) radians of pitch (down), yaw (left) and roll (right), turned in the order roll, pitch, yaw."""
    pitch = np.arcsin(np.clip(-rotation[:, 1, 2], -1, 1))
    yaw = np.arctan2(rotation[:, 0, 2], rotation[:, 2, 2])
    roll = np.arctan2(rotation[:, 1, 0], rotation[:, 1, 1])
    return np.stack([pitch, yaw, roll], axis=1)
