"""Lines of the skin: folds of expressions, and wrinkles that age leaves."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial import cKDTree

from realizer.core.array_types import Float32, Float64
from realizer.tables import toml_table
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.skin.skin import Skin

SIDES = {1: "left", -1: "right"}
STEP = 0.0003  # m between the points of a line
BEHIND = -0.3  # z of a normal below which there are no lines
FACING = 0.15  # least cosine between a surface and the direction from which a line is seen
REACH = 4.0  # widths from the middle of a line to its edge
WANDER = 0.0007  # m, standard deviation of a person's points from those of the table
BEND = 0.0006  # m; amplitude of a line's bends
TAPER = 0.25  # of a line's length, over which it begins and ends
PLATEAU, FADE = 0.009, 0.020  # m from a line up to which its fold shows fully, and from which it does not
NEAR = 0.0025  # m over which the weight of a line falls to a third


@dataclass(frozen=True, eq=False)
class Line:
    """A line in the view from one direction."""

    row: dict[str, Any]  # its row in `realizer/tables/skin_lines.toml`
    side: int  # 1 left, -1 right
    path: Float64  # (j, 2) metres to the right and up, as seen from `towards`
    right: Float64  # (3,) directions
    towards: Float64  # (3,) directions
    share: Float64  # (j,) depth along the line
    drives: dict[str, Float64]  # region -> (j,) 0..1, its weight along the line

    def near(self, at: Any, normals: Any, reach: float) -> tuple[Any, Float64, Any]:
        """Return the points (j,) within reach of the line, with distance and nearest point of the line."""
        flat = np.stack([at @ self.right, at[:, 1]], 1)
        low, high = self.path.min(axis=0) - reach, self.path.max(axis=0) + reach
        inside = ((flat > low) & (flat < high)).all(axis=1)
        found = np.flatnonzero(inside & (normals @ self.towards > FACING))
        hits: Any = cKDTree(self.path).query(flat[found], distance_upper_bound=reach)
        distances, point = hits
        within = np.isfinite(distances)
        return found[within], distances[within], point[within]


def lines_of(skin: Skin) -> list[Line]:
    """Return the lines of a person, with individual irregularities."""
    return [
        _line(skin, row, side, copy, 1000 + 10 * number)
        for number, row in enumerate(toml_table("skin_lines.toml")["lines"])
        for side in SIDES
        for copy in range(row["copies"][0])
    ]


def _line(skin: Skin, row: dict[str, Any], side: int, copy: int, number: int) -> Line:
    """Return a copy of a line; `number` seeds its random numbers."""
    rng = skin.rng(number + side + 1 + 3 * copy)
    yaw = math.radians(row["yaw"]) * side
    right = np.array([math.cos(yaw), 0, -math.sin(yaw)])
    knots = _knots(skin, row, side, right) + rng.normal(0, WANDER, (len(row["through"]), 2))
    copies, apart = row["copies"]
    offset = (copy - (copies - 1) / 2) * apart * skin.person.figure.fapu().es0
    # Copies are not parallel, and differ in beginning and end.
    curve, share = _course(knots, offset * rng.uniform(0.8, 1.2), offset * rng.normal(0, 0.3))
    t = np.linspace(0, 1, len(curve))
    meets = bool(row.get("meets"))
    if meets:  # it meets its mirror image: a common random height
        level = skin.rng(number).normal(0, WANDER) + curve[-1, 1] - knots[-1, 1]
        curve += smooth(t, 0.2, 1.0)[:, None] * (
            [0, _knots(skin, row, side, right)[-1, 1] + level] - curve[-1]
        )
    begin, end = rng.uniform(-0.05, 0.18), rng.uniform(0.85, 1.05)
    deep = smooth(t, begin, begin + TAPER) * (1 if meets else smooth(t, end, end - TAPER))
    drives: dict[str, Float64] = {}
    for drive, amount in zip(row["drives"], share.T, strict=True):
        name = f"{drive}_{SIDES[side]}"
        drives[name] = drives.get(name, np.zeros(len(t))) + amount
    towards = np.array([math.sin(yaw), 0, math.cos(yaw)])
    return Line(row, side, curve, right, towards, deep * rng.uniform(0.7 if offset else 0.9, 1.0), drives)


def _knots(skin: Skin, row: dict[str, Any], side: int, right: Float64) -> Float64:
    """Return the points of a line in the table, (j, 2) metres to the right and up."""
    figure = skin.person.figure
    size, knots = figure.fapu().es0, []
    for name, out, up in row["through"]:
        position = figure.point(name) * [side, 1, 1]
        knots.append([position @ right + side * out * size, position[1] + up * size])
    return np.array(knots)


def _course(knots: Float64, offset: float, slant: float) -> tuple[Float64, Float64]:
    """Return the curve (j, 2) parallel to knots (i, 2), and the weight of each knot at its points (j, i).

    Args:
        offset: metres between knots and curve; slant: metres by which this grows from end to end.
    """
    along = np.r_[0, np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1))]
    where = np.linspace(0, along[-1], max(8, int(along[-1] / STEP)))
    curve = np.asarray(PchipInterpolator(along, knots)(where))
    across = np.gradient(curve, axis=0)[:, ::-1] * [-1, 1]
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
    curve = curve + across * (offset + slant * (where / along[-1] - 0.5))[:, None]
    return curve, np.stack([np.interp(where, along, weight) for weight in np.eye(len(along))], 1)


def groove(distance: Any, width: float) -> Any:
    """Return the profile of a line: depth 1 in its middle, and ridges of skin beside it."""
    x = np.asarray(distance) / width
    return np.exp(-(x**2)) - 0.30 * np.exp(-(((x - 2.2) / 0.9) ** 2))


def engrave(skin: Skin, lines: list[Line]) -> tuple[Float32, Float32]:
    """Return heights (k,) in metres of the face at rest, and of its complete folds."""
    normals = skin.normals()
    heights = np.concatenate([line.path[:, 1] for line in lines])
    in_reach = (skin.at[:, 1] > heights.min() - FADE) & (skin.at[:, 1] < heights.max() + FADE)
    some = np.flatnonzero(in_reach & (normals[:, 2] > BEHIND) & skin.dry)
    bend = BEND * np.stack([skin.noise(0.007, 50), skin.noise(0.007, 51)], 1)[some]
    at, normals = skin.at[some], normals[some]
    at[:, :2] += bend
    varied = np.clip(0.85 + 0.25 * skin.noise(0.005, 52)[some], 0.3, 1.2)
    rest, folds = np.zeros((2, len(some)), np.float32)
    for line in lines:
        row = line.row
        found, distance, point = line.near(at, normals, REACH * row["width"])
        deep = groove(distance, row["width"]) * line.share[point] * row["depth"] * varied[found]
        young = row.get("young", 1.0)
        folds[found] = _deepest(folds[found], -deep * (young + (1 - young) * skin.look.age))
        rest[found] = _deepest(rest[found], -deep * row["age"] * _aged(skin, line))
    heights_map = np.zeros((2, len(skin.at)), np.float32)
    heights_map[:, some] = rest, folds
    return heights_map[0], heights_map[1]


def _aged(skin: Skin, line: Line) -> float:
    """Return the share of a line's depth at the person's age, which varies from line to line."""
    early = skin.rng(2000 + sum(map(ord, line.row["name"]))).uniform(0.75, 1.25)
    return float(np.clip(skin.look.age * early, 0, 1.3))


def _deepest(one: Any, other: Any) -> Any:
    """Return the lower of two heights, or the sum of two ridges."""
    return np.where((one < 0) | (other < 0), np.minimum(one, other), np.maximum(one, other))


def regions(lines: list[Line]) -> tuple[str, ...]:
    """Return the names of the regions whose folds have separate amounts: a drive and a side."""
    table = toml_table("skin_lines.toml")
    drives = {table["around_mouth"]["drive"], table["dimples"]["drive"]}
    names = {f"{drive}_{side}" for drive in drives for side in SIDES.values()}
    return tuple(sorted(names.union(*(line.drives for line in lines))))


def weights(skin: Skin, lines: list[Line], normals: Float64) -> Float32:
    """Return the weights of the regions' folds at the vertices of the skin, (n, regions) 0..1.

    The region with the nearest line has the largest weight.
    """
    at = skin.part.vertices
    names = regions(lines)
    score, cover = np.zeros((len(at), len(names))), np.zeros(len(at))
    for line in lines:
        found, distance, point = line.near(at, normals, FADE)
        cover[found] = np.maximum(cover[found], smooth(distance, FADE, PLATEAU))
        for name, amount in line.drives.items():
            column = names.index(name)
            score[found, column] = np.maximum(score[found, column], amount[point] * np.exp(-distance / NEAR))
    table = toml_table("skin_lines.toml")
    for name in ("around_mouth", "dimples"):
        mask = vertex_mask(skin, name)
        cover = np.maximum(cover, mask)
        for side, word in SIDES.items():
            column = names.index(f"{table[name]['drive']}_{word}")
            half = mask * smooth(side * at[:, 0], -0.004, 0.004) * np.exp(-1)
            score[:, column] = np.maximum(score[:, column], half)
    total = np.maximum(score.sum(axis=1, keepdims=True), 1e-9)
    return np.asarray(cover[:, None] * score / total, np.float32)


def vertex_mask(skin: Skin, name: str) -> Float64:
    """Return the weight (n,) 0..1 at vertices of the lines around the mouth, or of the chin's dimples."""
    patch, figure = skin.part.submesh, skin.person.figure
    if name == "dimples":
        return np.asarray(patch.mix @ figure.ellipsoid(figure.point("2.10"), (0.026, 0.020, 0.03)))
    return np.asarray(patch.mix @ (np.asarray(skin.lips.lips) > 0.02).astype(float))
