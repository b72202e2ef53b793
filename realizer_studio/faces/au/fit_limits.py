"""Limits on how far a fitted action unit may move any point of a face.

A fit uses landmarks only. Between and behind them a sum of Gaussians can grow to metres unnoticed. So no
vertex of the face, visible or hidden, may move much further than the furthest landmark, nor may points
between vertices, where a mesh of another topology may have vertices.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.au.functions import density
from realizer.face.au.model import Model, Mouth, UnitModel
from realizer.face.au.regions import shares
from realizer.face.mesh_geometry import part_triangles
from realizer.face.model import Face
from realizer_studio.faces.au.measure import UnitMeasurement

PARTS = ("skin", "lashes", "brows", "hair")  # what units move
FURTHEST = 1.3  # times d_max; the largest allowed displacement of a vertex
FREE = 1.1  # times d_max; up to here a displacement has no cost
STEEP = 10.0  # factor of the squared excess beyond it
REACH = 1e-3  # least share of a point in a half of the face that counts


@dataclass(frozen=True, eq=False)
class MonitoredPoints:
    """The points of a face at which the displacement of a fit is limited."""

    at: Float64  # (n, 3) metres, all on the left (x >= 0)
    upper: Float64  # (n,) the share of each point in the upper half, by the face's topology
    plane: Float64  # (n,) the same by the mouth's plane

    def of(self, half: str) -> Float64:
        """Return the points (k, 3) that the motion of "whole", "upper" or "lower" moves."""
        if half == "whole":
            return self.at
        most, least = np.maximum(self.upper, self.plane), np.minimum(self.upper, self.plane)
        return self.at[most > REACH if half == "upper" else least < 1 - REACH]


def monitored_points(face: Face, mouth: Mouth, between: bool = False) -> MonitoredPoints:
    """Return the vertices that units move, mirrored to the left.

    Args:
        between: also return the centres of the skin's triangles and edges.
    """
    indices = np.concatenate([np.arange(*face.parts[part]) for part in PARTS if part in face.parts])
    every, half = face.vertices.astype(np.float64), shares(face, mouth)
    at, upper = every[indices], half[indices]
    if between:
        skin = part_triangles(face.triangles, face.parts["skin"]) + face.parts["skin"][0]
        for some in (skin, skin[:, :2], skin[:, 1:], skin[:, ::2]):
            at = np.concatenate([at, every[some].mean(axis=1)])
            upper = np.concatenate([upper, half[some].mean(axis=1)])
    plane = mouth.upper(at)
    # Mirror images of points that exist on the left are dropped.
    at = at * np.where(at[:, :1] < 0, [-1.0, 1.0, 1.0], 1.0)
    _, once = np.unique(np.rint(np.c_[at * 1e5, upper, plane]), axis=0, return_index=True)
    return MonitoredPoints(at[once], upper[once], plane[once])


def furthest(unit: UnitModel, mouth: Mouth, points: MonitoredPoints) -> tuple[float, Float64]:
    """Return the largest displacement of a unit in metres, and its point (3,)."""
    both = [unit.displacement(points.at, mouth, upper) for upper in (points.upper, points.plane)]
    long = np.maximum(*(np.linalg.norm(moves, axis=1) for moves in both))
    worst = int(np.argmax(long))
    return float(long[worst]), points.at[worst]


def overshoot(gaussians: Float64, at: Float64) -> tuple[Float64, Float64]:
    """Return the cost of a density's excess: residuals (k,) and their derivatives (k, parameters).

    Args:
        gaussians: (g, 10), heights in d_max.
        at: (n, 3) in the functions' coordinates; at k of them the density exceeds `FREE`.
    """
    value, slopes = density(gaussians, at)
    over = np.abs(value) > FREE
    sign = STEEP * np.sign(value[over])
    return np.abs(sign) * (np.abs(value[over]) - FREE), sign[:, None] * slopes[over]


def runaways(face: Face, model: Model, measured: Mapping[int, UnitMeasurement]) -> tuple[str, ...]:
    """Return a sentence for each unit that moves a vertex of the face further than `FURTHEST` times d_max."""
    points = monitored_points(face, model.mouth)
    out = []
    for au, one in measured.items():
        if au in model.units:
            d_max = float(np.linalg.norm(one.moves[one.visible], axis=1).max())
            far, where = furthest(model.units[au], model.mouth, points)
            if far > FURTHEST * d_max:
                x, y, z = (1000 * where).round(1).tolist()
                out.append(
                    f"AU{au} moves the place {x}, {y}, {z} mm by {1000 * far:.1f} mm, "
                    f"and nothing was measured to move more than {1000 * d_max:.1f}"
                )
    return tuple(out)
