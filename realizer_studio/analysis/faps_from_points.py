"""FAPs and facial features computed from tracked feature points, and a reader of their files."""

from __future__ import annotations

import csv
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from realizer import tables
from realizer.core.array_types import Bool, Float32, Float64
from realizer.core.units import ANGLE_UNIT
from realizer.face.features import NAMES

if TYPE_CHECKING:
    from realizer.face.model import Fapu


@dataclass(frozen=True, slots=True)
class FacialFeature:
    """The change of a distance between two feature points (Raouzaiou et al. 2002, table 3)."""

    number: int
    first: str  # name of an MPEG-4 feature point
    second: str  # name of an MPEG-4 feature point
    growth: int  # 1 if moving apart is positive, -1 if approaching is
    unit: str  # FAPU
    signs: dict[int, int]  # {FAP: 1 or -1}; the feature is the sum of these FAPs
    also: tuple[int, ...]  # FAPs of the inner lips that follow from the feature with sign 1


@dataclass(frozen=True, slots=True)
class Row:
    feature: int
    first: str
    second: str
    growth: int
    unit: str
    faps: str
    also: str


@cache
def facial_features() -> tuple[FacialFeature, ...]:
    """Return the 15 features, f1 first."""
    features = []
    for row in tables.csv_rows("facial_features.csv", Row):
        signs = {abs(fap): 1 if fap > 0 else -1 for fap in map(int, row.faps.split())}
        also = tuple(map(int, row.also.split()))
        features.append(FacialFeature(row.feature, row.first, row.second, row.growth, row.unit, signs, also))
    return tuple(features)


Points = Mapping[str, Any]  # name such as "2.1" -> (n, 3) or (3,) metres

# Points on the skull, and the corners of the eyes for trackers without them.
SKULL = ("11.1", "11.2", "11.3", "11.4", "11.5", "11.6")
CORNERS = ("3.7", "3.8", "3.11", "3.12")
HEAD = slice(47, 50)
CHIN, JAW, DEPRESS_CHIN, OPEN_JAW = "2.10", "2.1", 17, 2
# Direction in the standard -> axis and sign; x to the character's left, y up, z forward.
DIRECTIONS = {"left": (0, 1), "right": (0, -1), "up": (1, 1), "down": (1, -1), "forward": (2, 1)}


def faps_from_points(points: Points, neutral: Points, fapu: Fapu) -> tuple[Float32, Bool]:
    """Return the FAPs of tracked feature points (Raouzaiou et al. 2002, figure 1).

    The pose of the head is measured first (FAPs 48 to 50) and removed. Then each FAP is the displacement of
    its point along its axis, in its unit.

    Args:
        points: name -> (n, 3) in metres, +x the character's left, +y up, +z forward; NaN for lost points.
        neutral: name -> (3,) in metres, of the same face at rest.
        fapu: units of the same face.

    Returns:
        (n, 68) FAP values, 0 if unobserved, and (68,) whether each was observed in all frames.

    Raises:
        ValueError: no points, points without a neutral position, or arrays of different lengths.
    """
    positions, rest = _checked(points, neutral)
    count = len(next(iter(positions.values())))
    values, observed = np.zeros((count, 68), np.float32), np.zeros(68, bool)
    pose = _skull_pose(positions, rest)
    if pose is not None:
        rotation, moved = pose
        values[:, HEAD] = head_angles(rotation) / ANGLE_UNIT
        observed[HEAD] = True
        # The other FAPs are relative to the skull.
        positions = {
            name: np.einsum("nji,nj->ni", rotation, position - moved) for name, position in positions.items()
        }
    for row in tables.faps():
        if (
            row.feature_point in positions
            and row.direction in DIRECTIONS
            and row.unit not in ("none", "angle_unit")
        ):
            axis, sign = DIRECTIONS[row.direction]
            distance = positions[row.feature_point][:, axis] - rest[row.feature_point][axis]
            values[:, row.fap - 1] = sign * distance / fapu.metres(row.unit)
            observed[row.fap - 1] = True
    if observed[DEPRESS_CHIN] and observed[OPEN_JAW]:
        values[:, DEPRESS_CHIN] += values[:, OPEN_JAW]  # 2.10 moves with the jaw
    lost = np.isnan(values)
    values[lost] = 0
    return values, observed & ~lost.any(axis=0)


def features_from_points(points: Points, neutral: Points, fapu: Fapu) -> Float64:
    """Return f1..f15, (n, 15): changes of distances between feature points (table 3).

    Raises:
        ValueError: as for `faps_from_points`, or a missing point.
    """
    positions, rest = _checked(points, neutral)
    required = {name for row in facial_features() for name in (row.first, row.second)}
    if missing := sorted(required - set(positions)):
        raise ValueError(f"points: wanted the 19 of the features, these are missing: {', '.join(missing)}")
    columns = []
    for row in facial_features():
        now = np.linalg.norm(positions[row.first] - positions[row.second], axis=1)
        before = np.linalg.norm(rest[row.first] - rest[row.second])
        columns.append(row.growth * (now - before) / fapu.metres(row.unit))
    return np.stack(columns, axis=1)


def faps_from_features(features: Any) -> tuple[Float32, Bool]:
    """Return the FAPs (n, 68) that features (n, 15) determine, and (68,) whether each is determined.

    A feature that is the sum of several FAPs is divided among them equally (3.2). For brows, f1 and f2 have
    priority over f15, which combines both.
    """
    values = np.asarray(features, np.float64)
    if values.ndim != 2 or values.shape[1] != 15:
        raise ValueError(f"features: wanted (n, 15), got {values.shape}")
    frames, determined = np.zeros((len(values), 68), np.float32), np.zeros(68, bool)
    for row, column in zip(facial_features(), values.T, strict=True):
        part = column / len(row.signs)
        signs = dict(row.signs) | dict.fromkeys(row.also, 1)
        for fap, sign in signs.items():
            if not determined[fap - 1]:
                frames[:, fap - 1], determined[fap - 1] = sign * part, True
    return frames, determined


def _checked(points: Points, neutral: Points) -> tuple[dict[str, Float64], dict[str, Float64]]:
    """Check points, and convert them to arrays (n, 3) and neutral positions (3,)."""
    if not points:
        raise ValueError("points: wanted at least one feature point, got none")
    if unknown := sorted(set(points) - set(neutral)):
        raise ValueError(f"points: wanted those with a neutral position, got {', '.join(unknown)}")
    positions = {name: np.atleast_2d(np.asarray(position, np.float64)) for name, position in points.items()}
    rest = {name: np.asarray(neutral[name], np.float64) for name in points}
    if bad := sorted({position.shape for position in rest.values()} - {(3,)}):
        raise ValueError(f"neutral: wanted (3,) each, got {bad[0]}")
    shapes = sorted({position.shape for position in positions.values()})
    if len(shapes) != 1 or shapes[0][1:] != (3,) or not shapes[0][0]:
        raise ValueError(f"points: wanted (n, 3) each, all of one n, got {', '.join(map(str, shapes))}")
    if not all(np.isfinite(position).all() for position in rest.values()):
        raise ValueError("neutral: wanted finite places, got NaN or infinity")
    return positions, rest


def _skull_pose(
    positions: Mapping[str, Float64], rest: Mapping[str, Float64]
) -> tuple[Float64, Float64] | None:
    """Return the rotation (n, 3, 3) and shift (n, 3) of the skull in each frame (Kabsch 1976), or None."""
    steady = [name for name, position in positions.items() if not np.isnan(position).any()]
    groups = ([name for name in group if name in steady] for group in (SKULL, CORNERS))
    names = next((group for group in groups if len(group) >= 3), None)
    if names is None:
        return None
    before = np.stack([rest[name] for name in names])
    after = np.stack([positions[name] for name in names], axis=1)
    middle, centre = before.mean(axis=0), after.mean(axis=1)
    covariance = np.einsum("ki,nkj->nij", before - middle, after - centre[:, None])
    u, _, vt = np.linalg.svd(covariance)
    mirrored = np.linalg.det(u @ vt) < 0
    vt[mirrored, 2] *= -1
    rotation = np.einsum("nij,njk->nki", u, vt)
    # For a point of the skull, R^T (p - shift) = p0.
    return rotation, centre - np.einsum("nij,j->ni", rotation, middle)


def head_angles(rotation: Float64) -> Float64:
    """Return (n, 3) radians of FAPs 48 to 50: pitch down, yaw left, roll right, applied last to first."""
    pitch = np.arcsin(np.clip(-rotation[:, 1, 2], -1, 1))
    yaw = np.arctan2(rotation[:, 0, 2], rotation[:, 2, 2])
    roll = np.arctan2(rotation[:, 1, 0], rotation[:, 1, 1])
    return np.stack([pitch, yaw, roll], axis=1)


COLUMNS = ["frame", "point", "x", "y", "z"]
MAX_FRAMES = 100_000  # more than an hour at 25 frames a second


def read_points(
    text: str, where: str = "points", names: Collection[str] | None = NAMES
) -> tuple[dict[str, Float64], dict[str, Float64]]:
    """Parse a CSV text and return the trajectory (n, 3) and the position at rest (3,) of each point.

    The columns are frame,point,x,y,z; frames count from 0, and points have their MPEG-4 names ("4.1"). Lines
    that begin with # are ignored. Frame 0 is the position at rest; points missing from a frame are NaN.

    Args:
        where: name of the file in messages.
        names: of allowed points; None for all.

    Raises:
        ValueError: invalid columns, cells or points; the text names the line.
    """
    found: dict[str, dict[int, tuple[float, float, float]]] = {}
    last = 0
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip() and line[0] != "#"]
    if not lines or [cell.strip() for cell in lines[0][1].split(",")] != COLUMNS:
        got = lines[0][1][:60] if lines else ""
        raise ValueError(f"{where}: wanted a first line {','.join(COLUMNS)}, got {got!r}")
    for number, line in lines[1:]:
        location = f"{where}, line {number}"
        cells = next(csv.reader([line]))
        try:
            frame, name, (x, y, z) = int(cells[0]), cells[1].strip(), map(float, cells[2:])
        except (ValueError, IndexError):
            raise ValueError(f"{location}: wanted {','.join(COLUMNS)}, got {line[:60]!r}") from None
        if not (0 <= frame < MAX_FRAMES and all(map(math.isfinite, (x, y, z)))):
            raise ValueError(
                f"{location}: wanted a frame 0..{MAX_FRAMES - 1} and finite places, got {line[:60]!r}"
            )
        if names is not None and name not in names:
            raise ValueError(f"{location}: wanted a point of MPEG-4, 2.1 to 11.6, got {name[:20]!r}")
        if frame in found.setdefault(name, {}):
            raise ValueError(f"{location}: point {name} is there twice in frame {frame}")
        found[name][frame] = x, y, z
        last = max(last, frame)
    if unanchored := sorted(name for name, samples in found.items() if 0 not in samples):
        raise ValueError(
            f"{where}: wanted every point at rest in frame 0, got none of {', '.join(unanchored)}"
        )
    points = {}
    for name, samples in found.items():
        trajectory = np.full((last + 1, 3), np.nan)
        trajectory[list(samples)] = list(samples.values())
        points[name] = trajectory
    return points, {name: trajectory[0] for name, trajectory in points.items()}


def bridge(points: Mapping[str, Float64]) -> dict[str, Float64]:
    """Return the trajectories (n, 3) without NaN: linear across gaps, constant after the last value."""
    bridged = {}
    for name, trajectory in points.items():
        known = np.flatnonzero(~np.isnan(trajectory).any(axis=1))
        frames = np.arange(len(trajectory))
        bridged[name] = np.stack(
            [np.interp(frames, known, trajectory[known, axis]) for axis in range(3)], axis=1
        )
    return bridged
