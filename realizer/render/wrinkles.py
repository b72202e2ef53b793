"""Wrinkles: strips of skin that darken as the skin under them is compressed.

Compression is measured on the shape itself, by two feature points that approach each other, so furrows
appear whatever moves a face: FAPs, action units or shapes.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, Float64, Int32
from realizer.face.mesh_geometry import grid
from realizer.face.model import Face
from realizer.render.surface_points import locate_on_skin
from realizer.tables import toml_table

STEP = 0.03  # of ES0, along a furrow
LIFT = 0.006  # of ES0, above the skin: 0.4 mm, or the strip sinks where the skin is curved
COARSE = 0.18  # of ES0: where triangles are longer than that, the skin cannot move as a furrow does
ACROSS = np.array([-1, -0.55, -0.2, 0, 0.2, 0.55, 1])  # of the width, from above a furrow to below it
# Blood shows where skin is in shade: red is darkened less than blue.
SHADE = np.array([0.82, 1.03, 1.10], np.float32)


@dataclass(frozen=True)
class _Drive:
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


class Wrinkles:
    """Forehead, glabella, crow's feet and nasolabial folds.

    Attributes:
        triangles: (m, 3) int32 of its own points, seen from outside.
    """

    def __init__(self, face: Face) -> None:
        """Build the furrows; those without feature points, or on too coarse skin, are left out."""
        table = _table()
        size = face.fapu.es0
        drawn = [
            strip
            for line in table["lines"]
            for side in (1, -1)
            if (strip := _strip(face, line, table["drives"], side, size)) is not None
        ]
        self._drives = sorted({d for strip in drawn for d in strip.drives}, key=lambda d: (d.a, d.b, d.full))
        place = {drive: k for k, drive in enumerate(self._drives)}
        self._corners: Int32 = _joined([s.corners for s in drawn], (0, 3)).astype(np.int32)
        self._weights: Float32 = _joined([s.weights for s in drawn], (0, 3)).astype(np.float32)
        self._by_corner = [
            (np.ascontiguousarray(corner), weight[:, None])
            for corner, weight in zip(self._corners.T, self._weights.T, strict=True)
        ]
        self._lift = np.float32(LIFT * size)
        # Points x drives: how much a drive darkens a point.
        self._tone: Float32 = np.zeros((len(self._corners), len(self._drives)), np.float32)
        triangles, first = [], 0
        for strip in drawn:
            for drive, tone in zip(strip.drives, strip.tones, strict=True):
                self._tone[first : first + len(tone), place[drive]] += tone
            sheet = grid(len(strip.corners) // len(ACROSS), len(ACROSS)) + first
            triangles.append(sheet[:, ::-1] if strip.turned else sheet)
            first += len(strip.corners)
        self.triangles: Int32 = _joined(triangles, (0, 3)).astype(np.int32)
        self.count = first

    def to_json(self) -> dict[str, Any]:
        """Return the furrows as numbers, for clients that draw the face's vertices; as `__call__` uses them.

        `points` are three vertices and the weights of the first two, `drives` two vertices, their distance at
        rest and the changes at which a furrow begins and is deepest, `tones` [drive, tone] pairs a point.
        """
        corners = np.hstack([self._corners, np.round(self._weights[:, :2], 4)])
        return {
            "lift": float(self._lift),
            "shade": SHADE.tolist(),
            "drives": [[d.a, d.b, d.rest, d.start, d.full] for d in self._drives],
            "points": corners.tolist(),
            "tones": [
                [[int(k), round(float(tone[k]), 4)] for k in np.flatnonzero(np.abs(tone) > 5e-5)]
                for tone in self._tone
            ],
            "triangles": self.triangles.ravel().tolist(),
        }

    def __call__(self, vertices: Float32, normals: Float32, colours: Float32) -> tuple[Float32, Float32]:
        """Return points (count, 3) in metres and sRGB 0..1 (count, 3), of the head's vertices and colours.

        A face without furrows gives points without extent, which cost nothing to draw.
        """
        amounts = np.array([drive(vertices) for drive in self._drives], np.float32)
        if not self.count or not amounts.any():
            return np.zeros((self.count, 3), np.float32), np.zeros((self.count, 3), np.float32)
        # A row a vertex with all that is wanted of it, and a corner at a time: three rows a point, added up.
        skin = np.hstack([vertices + self._lift * normals, colours])
        parts = [skin.take(corner, axis=0) * weight for corner, weight in self._by_corner]
        points: Float32 = parts[0] + parts[1] + parts[2]
        tone = (self._tone @ amounts)[:, None]
        shade = np.where(tone > 0, 1 - tone * SHADE, 1 - tone)
        return points[:, :3], np.minimum(points[:, 3:] * shade, 1)


@dataclass(frozen=True, eq=False)
class _Strip:
    """A furrow: (k, 3) vertices and weights of each point, and the darkness (k,) per drive."""

    corners: Int32
    weights: Float64
    drives: tuple[_Drive, ...]
    tones: tuple[Float64, ...]
    turned: bool


@cache
def _table() -> dict[str, Any]:
    return toml_table("wrinkles.toml")


def _strip(face: Face, line: dict[str, Any], drives: dict[str, Any], side: int, size: float) -> _Strip | None:
    """Return the furrow on the character's left (side 1) or right (-1), or None if it cannot be shown."""
    named = [point for point, _, _ in line["through"]]
    pairs = {name: drives[name]["between"] for name in line["drives"]}
    wanted = {*named, *(p for pair in pairs.values() for p in pair)}
    if not wanted <= set(face.points) or not wanted <= set(face.feature_points):
        return None
    yaw = math.radians(line["yaw"]) * side
    right = np.array([math.cos(yaw), 0, -math.sin(yaw)])
    towards = np.array([math.sin(yaw), 0, math.cos(yaw)])
    twin = {name: _twin(face, name) if side < 0 else name for name in wanted}
    # Seen from `towards`, steps outwards are steps along the turned picture.
    knots = np.array(
        [
            (
                side * out * size + float(np.asarray(face.points[twin[p]], float) @ right),
                up * size + face.points[twin[p]][1],
            )
            for p, out, up in line["through"]
        ]
    )
    if line.get("meets"):
        knots[-1, 0] = 0.0
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1))])
    count = max(4, math.ceil(along[-1] / (STEP * size)) + 1)
    where = np.linspace(0, along[-1], count)
    path = _through(along, knots, where)
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    # Across: from above to below, and where a furrow runs down, from its outer side to its inner one.
    across = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    level = abs(across[:, 1].mean()) > abs(across[:, 0].mean())
    if (across[:, 1].mean() > 0) if level else (side * across[:, 0].mean() > 0):
        across = -across
    spread = path[:, None] + across[:, None] * (ACROSS * line["width"] * size)[None, :, None]
    found = locate_on_skin(face, spread.reshape(-1, 2), right, towards, COARSE * size)
    if found is None:
        return None
    made = []
    for drive in (drives[name] for name in line["drives"]):
        a, b = sorted(face.feature_points[twin[p]] for p in drive["between"])
        rest = max(float(np.linalg.norm(face.vertices[a] - face.vertices[b])), 1e-6)
        made.append(_Drive(a, b, rest, drive["from"], drive["full"]))
    tone = (
        _profile(line["depth"], line["lit"])[None]
        * _taper(where / along[-1], bool(line.get("meets")))[:, None]
    )
    tones = [(tone * np.interp(where, along, own)[:, None]).ravel() for own in np.eye(len(made))]
    turn = np.cross(np.append(tangent[0], 0), np.append(across[0], 0))[2]
    return _Strip(*found, tuple(made), tuple(tones), bool(turn < 0))


def _through(along: Float64, knots: Float64, where: Float64) -> Float64:
    """Return the curve through knots (k, 2) at `along`, at places (n,): a monotone cubic.

    Slopes after Fritsch and Butland 1984, those at the ends by three points, limited to the first chord's
    turn. Written out here: SciPy's takes a third of a second to import, and a film begins with it.
    """
    steps = np.diff(along)[:, None]
    chords = np.diff(knots, axis=0) / steps
    if len(chords) == 1:
        slopes = np.repeat(chords, 2, axis=0)
    else:
        before, after = chords[:-1], chords[1:]
        wide, narrow = 2 * steps[1:] + steps[:-1], steps[1:] + 2 * steps[:-1]
        turns = before * after <= 0
        safe = np.where(turns, 1, before), np.where(turns, 1, after)
        inner = np.where(turns, 0, (wide + narrow) / (wide / safe[0] + narrow / safe[1]))
        first = _end_slope(steps[0], steps[1], chords[0], chords[1])
        last = _end_slope(steps[-1], steps[-2], chords[-1], chords[-2])
        slopes = np.vstack([first, inner, last])
    k = np.clip(np.searchsorted(along, where, "right") - 1, 0, len(chords) - 1)
    step, t = steps[k], ((where - along[k])[:, None]) / steps[k]
    bend = slopes[k] + slopes[k + 1] - 2 * chords[k]
    out: Float64 = knots[k] + step * t * (slopes[k] + t * (chords[k] - slopes[k] + (t - 1) * bend))
    return out


def _end_slope(near: Float64, far: Float64, chord: Float64, beyond: Float64) -> Float64:
    slope = ((2 * near + far) * chord - near * beyond) / (near + far)
    slope = np.where(slope * chord <= 0, 0, slope)
    steep = (chord * beyond <= 0) & (np.abs(slope) > 3 * np.abs(chord))
    kept: Float64 = np.where(steep, 3 * chord, slope)
    return kept


def _profile(depth: float, lit: float) -> Float64:
    """Return the darkness across a furrow: a groove with soft walls, and below it a lit ridge."""
    groove = np.exp(-((ACROSS / 0.36) ** 2)) * depth
    ridge = np.exp(-(((ACROSS - 0.6) / 0.3) ** 2)) * lit
    out = groove - ridge
    out[[0, -1]] = 0
    return out


def _taper(t: Float64, meets: bool) -> Float64:
    """Return how strong a furrow is along it; those of the forehead meet in the middle."""
    start = np.clip(t / 0.3, 0, 1)
    end = np.clip((1 - t) / 0.3, 0, 1) if not meets else np.ones_like(t)
    ease = start * end
    out: Float64 = ease * ease * (3 - 2 * ease)
    return out


def _twin(face: Face, name: str) -> str:
    """Return the mirrored feature point in the same group."""
    flipped = np.asarray(face.points[name], float) * (-1, 1, 1)
    group = [p for p in face.points if p.split(".")[0] == name.split(".")[0] and p in face.feature_points]
    return min(group, key=lambda p: float(np.linalg.norm(np.asarray(face.points[p], float) - flipped)))


def _joined(parts: list[Any], empty: tuple[int, int]) -> Any:
    return np.concatenate(parts) if parts else np.zeros(empty)
