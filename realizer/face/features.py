"""The MPEG-4 feature points and FAPU of a face (`features.csv`)."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from realizer.core.array_types import Float32
from realizer.core.errors import FaceError
from realizer.face.model import Fapu
from realizer.face.reading import face_errors
from realizer.tables import read_csv

HEAD = """\
# source: measured on this face's mesh; ISO/IEC 14496-2 annex C names the points
# units: x, y, z in metres, origin between the eyes, +x the character's left, +y up, +z forward
# vertex: index into mesh.npz, from 0
# licence: CC0-1.0
"""
# The 84 points of ISO/IEC 14496-2 annex C: how many there are in each group.
COUNTS = {2: 14, 3: 14, 4: 6, 5: 4, 6: 4, 7: 1, 8: 10, 9: 15, 10: 10, 11: 6}
NAMES = tuple(f"{group}.{k}" for group, count in COUNTS.items() for k in range(1, count + 1))

# Points that lie inside the head and not on its skin.
INSIDE = frozenset({"7.1", "11.5"})


@dataclass(frozen=True, slots=True)
class Point:
    """A row of features.csv: the point itself and the vertex nearest to it."""

    feature_point: str
    vertex: int
    x: float
    y: float
    z: float

    @property
    def place(self) -> tuple[float, float, float]:
        """Metres."""
        return self.x, self.y, self.z


def read_features(path: Path) -> dict[str, Point]:
    """Read the points of a features.csv by name.

    Raises:
        FaceError: no such file, a bad row, or a point that is missing or there twice.
    """
    with face_errors(path, "a CSV file with the 84 feature points"):
        rows = read_csv(path.read_text("utf-8"), Point, str(path))
    points: dict[str, Point] = {}
    for row in rows:
        if row.feature_point in points:
            raise FaceError(f"{path}: feature point {row.feature_point} is there twice; delete one row")
        points[row.feature_point] = row
    missing = [name for name in NAMES if name not in points]
    if missing:
        raise FaceError(f"{path}: wanted 84 feature points, these are missing: {', '.join(missing)}")
    return points


def write_features(path: Path, points: Mapping[str, Point]) -> None:
    """Write a features.csv, in the standard's order."""
    rows = [points[name] for name in NAMES]
    lines = [f"{p.feature_point},{p.vertex},{p.x:.6f},{p.y:.6f},{p.z:.6f}" for p in rows]
    path.write_text(HEAD + "\n".join(["feature_point,vertex,x,y,z", *lines]) + "\n", "utf-8")


def fapu_of(points: Mapping[str, Float32], where: Path | str = "face") -> Fapu:
    """Return the face's distances between feature points (ISO/IEC 14496-2 annex C).

    Raises:
        FaceError: a distance that is not positive: the points are exchanged or not in metres.
    """

    def apart(axis: int, high: str, low: str) -> float:
        distance = float(points[high][axis] - points[low][axis])
        if not np.isfinite(distance) or distance <= 0:
            raise FaceError(
                f"{where}: wanted {high} beyond {low} along {'xyz'[axis]}, got {distance:.4f} m between them"
            )
        return distance

    return Fapu(
        irisd0=(apart(1, "3.1", "3.3") + apart(1, "3.2", "3.4")) / 2,
        es0=apart(0, "3.5", "3.6"),
        ens0=apart(1, "3.5", "9.15"),
        mns0=apart(1, "9.15", "2.2"),
        mw0=apart(0, "8.3", "8.4"),
    )
