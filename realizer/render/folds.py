"""How deep the folds of expressions are: by how far the skin between two feature points is pushed together.

Compression is measured on the shape itself, so folds appear whatever moves a face: FAPs, units or shapes.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from realizer.core.array_types import Float32
from realizer.face.model import Face
from realizer.tables import toml_table

LEFT, RIGHT = "left", "right"


@dataclass(frozen=True, slots=True)
class Drive:
    """A measure of how close two vertices are: 0 at `start`, 1 at `full` (relative change of distance)."""

    a: int
    b: int
    rest: float
    start: float
    full: float

    def __call__(self, vertices: Float32) -> float:
        change = float(np.linalg.norm(vertices[self.a] - vertices[self.b])) / self.rest - 1
        reached = min(max((change - self.start) / (self.full - self.start), 0.0), 1.0)
        return reached * reached * (3 - 2 * reached)


class Folds:
    """The folds of a face, in regions that each have a drive of `realizer/tables/wrinkles.toml` and a side.

    Attributes:
        drives: one for each region; None for a region whose feature points the face does not have.
        weights: (n, r) float32 0..1, how much of each region's folds shows at each vertex.
    """

    def __init__(self, face: Face) -> None:
        regions = face.maps.regions if face.maps else ()
        self.drives: list[Drive | None] = [_drive(face, *region.rsplit("_", 1)) for region in regions]
        self.weights = face.maps.folds if face.maps else np.zeros((len(face.vertices), 0), np.float32)

    def __call__(self, vertices: Float32) -> Float32:
        """Return how much of the folds shows at each vertex, (n,) 0..1, for the vertices of a pose (n, 3)."""
        amounts = [drive(vertices) if drive else 0.0 for drive in self.drives]
        if not any(amounts):
            return np.zeros(len(vertices), np.float32)
        return self.weights @ np.array(amounts, np.float32)

    def to_json(self) -> list[list[Any]]:
        """Return a, b, rest, start and full of each drive, for clients that draw the face themselves."""
        none = Drive(0, 0, 1.0, -1.0, -2.0)
        return [[d.a, d.b, d.rest, d.start, d.full] for d in (drive or none for drive in self.drives)]


def _drive(face: Face, name: str, side: str) -> Drive | None:
    row = toml_table("wrinkles.toml")["drives"].get(name)
    if row is None or not set(row["between"]) <= set(face.points) & set(face.feature_points):
        return None
    names = row["between"] if side == LEFT else [_twin(face, point) for point in row["between"]]
    a, b = sorted(face.feature_points[point] for point in names)
    rest = max(float(np.linalg.norm(face.vertices[a] - face.vertices[b])), 1e-6)
    return Drive(a, b, rest, row["from"], row["full"])


def _twin(face: Face, name: str) -> str:
    """Return the mirrored feature point in the same group."""
    flipped = np.asarray(face.points[name], float) * (-1, 1, 1)
    group = [p for p in face.points if p.split(".")[0] == name.split(".")[0] and p in face.feature_points]
    return min(group, key=lambda p: float(np.linalg.norm(np.asarray(face.points[p], float) - flipped)))
