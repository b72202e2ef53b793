"""A reader for files of tracked feature points."""

import csv
import math
from collections.abc import Collection, Mapping

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.features import NAMES

COLUMNS = ["frame", "point", "x", "y", "z"]
MAX_FRAMES = 100_000  # an hour at 25 frames a second, and a little


def read_points(
    text: str, where: str = "points", names: Collection[str] | None = NAMES
) -> tuple[dict[str, Float64], dict[str, Float64]]:
    """Parse a CSV text and return the trajectory (n, 3) and the position at rest (3,) of each point.

    The columns are frame,point,x,y,z; frames count from 0, and points have their MPEG-4 names ("4.1"). Lines
    that begin with # are ignored. Frame 0 is the position at rest; points missing from a frame are NaN.

    Args:
        where: name of the file in messages.
        names: of possible points; None: all.

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
        place = f"{where}, line {number}"
        cells = next(csv.reader([line]))
        try:
            frame, name, (x, y, z) = int(cells[0]), cells[1].strip(), map(float, cells[2:])
        except (ValueError, IndexError):
            raise ValueError(f"{place}: wanted {','.join(COLUMNS)}, got {line[:60]!r}") from None
        if not (0 <= frame < MAX_FRAMES and all(map(math.isfinite, (x, y, z)))):
            raise ValueError(
                f"{place}: wanted a frame 0..{MAX_FRAMES - 1} and finite places, got {line[:60]!r}"
            )
        if names is not None and name not in names:
            raise ValueError(f"{place}: wanted a point of MPEG-4, 2.1 to 11.6, got {name[:20]!r}")
        if frame in found.setdefault(name, {}):
            raise ValueError(f"{place}: point {name} is there twice in frame {frame}")
        found[name][frame] = x, y, z
        last = max(last, frame)
    if restless := sorted(name for name, places in found.items() if 0 not in places):
        raise ValueError(f"{where}: wanted every point at rest in frame 0, got none of {', '.join(restless)}")
    points = {}
    for name, places in found.items():
        way = np.full((last + 1, 3), np.nan)
        way[list(places)] = list(places.values())
        points[name] = way
    return points, {name: way[0] for name, way in points.items()}


def bridge(points: Mapping[str, Float64]) -> dict[str, Float64]:
    """Return the trajectories (n, 3) without NaN: linear across gaps, constant after the last value."""
    whole = {}
    for name, way in points.items():
        there = np.flatnonzero(~np.isnan(way).any(axis=1))
        frames = np.arange(len(way))
        whole[name] = np.stack([np.interp(frames, there, way[there, axis]) for axis in range(3)], axis=1)
    return whole
