"""A face in, the truth of each of its 127 displacements out: does every FAP do what MPEG-4 says, and no more?

Paul 2010 (4.4) scored displacements by eye: 3 as it should look, 2 slightly odd, 1 only its place can be
told, 0 nothing. Here rules give the score, so that it can be repeated.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from realizer.arrays import Bool, Float64
from realizer.face.deform import deform
from realizer.face.model import Face
from realizer.tables import Fap, au_to_fap, faps, read_csv
from realizer.units import ANGLE_UNIT

__all__ = ["PEERS", "Truth", "face_truth", "mean_score"]

# What Paul 2010 (tables 4.5) gives other faces, those FAPs counted 0 that they lack.
PEERS = {"FaceEditor": 2.60, "Greta": 2.32, "Miraface": 1.96, "Xface": 1.32}

WAYS: dict[str, tuple[float, float, float]] = {
    "up": (0, 1, 0), "down": (0, -1, 0), "left": (1, 0, 0), "right": (-1, 0, 0), "forward": (0, 0, 1),
}  # fmt: skip
HALF, TURN = 512.0, 20000.0  # FAPU, angle units: half a face distance is what Paul looked at
# Where no action unit asks for a FAP: what faces reach, in its own unit.
REACH = {"MNS": 250.0, "MW": 150.0, "ENS": 100.0, "ES": 100.0, "IRISD": 300.0, "angle_unit": 20000.0}
EYEBALLS_OUT = 30.0  # ES: 2 mm
PUPIL = 150.0  # IRISD: 1.5 mm wider or narrower; half an iris would shut a pupil
UPPER = ("2.2", "2.6", "2.7", "8.1", "8.5", "8.6")
LOWER = ("2.3", "2.8", "2.9", "8.2", "8.7", "8.8")
CORNERS = ("2.4", "2.5", "8.3", "8.4")
LIDS = {"3.1": "3.3", "3.3": "3.1", "3.2": "3.4", "3.4": "3.2"}
# A lip has an inner and an outer contour, millimetres apart: nobody moves one far through the other.
CONTOURS = {4: 51, 5: 52, 6: 53, 7: 54, 8: 55, 9: 56, 10: 57, 11: 58, 12: 59, 13: 60}
PARTNERS = CONTOURS | {outer: inner for inner, outer in CONTOURS.items()}
# For scores 3 and 2: error, mirror, others, share of triangles that flip, roughness; and for 1: error.
RIGHT = (0.02, 0.01, 0.05, 0.0, 0.25)
ODD = (0.25, 0.15, 0.25, 0.02, 0.45)
KNOWN = 0.75
INNER = 0.30  # baked occlusion under which the skin is behind the lips or in a socket


@dataclass(frozen=True, slots=True)
class Truth:
    """What one FAP does in one direction, as shares of what was asked.

    Attributes:
        fap, name, sign, weight: which, +1 or -1, and how much it matters (Paul's w).
        error: how far the feature point's move along its way (or the angle, or the pupil's width) is off.
        mirror: the largest difference from the twin's mirror image, of the largest move.
        others: the largest move of a point that must stay (the opposite lip or lid; FAP 3: all lips).
        flips: the share (by area) of the moved open skin whose triangles turn over at the most that is
            usual; both contours of a lip are moved there.
        rough: 95th percentile, over the open skin that moves by more than 5 % of the largest move, of how
            far a vertex's move is from the mean of its neighbours', of the largest move.
        usual: the most that is usual, in the FAP's own unit.
        score: 3, 2, 1 or 0.
    """

    fap: int
    name: str
    sign: int
    weight: int
    error: float
    mirror: float
    others: float
    flips: float
    rough: float
    usual: float

    @property
    def faults(self) -> tuple[float, float, float, float, float]:
        return self.error, self.mirror, self.others, self.flips, self.rough

    @property
    def score(self) -> int:
        if all(fault <= most for fault, most in zip(self.faults, RIGHT, strict=True)):
            return 3
        if all(fault <= most for fault, most in zip(self.faults, ODD, strict=True)):
            return 2
        return 1 if self.error <= KNOWN else 0


def mean_score(truths: tuple[Truth, ...]) -> float:
    """The mean weighted by how much each FAP matters."""
    return sum(t.weight * t.score for t in truths) / sum(t.weight for t in truths)


def face_truth(face: Face) -> tuple[Truth, ...]:
    """Every FAP from 3 to 68, in each of its directions: 127."""
    return tuple(
        _truth(_Measure.of(face), row, sign)
        for row in faps()[2:]
        for sign in ((1, -1) if row.least < 0 else (1,))
    )


@dataclass(frozen=True)
class _Weight:
    fap: int
    weight: int


@cache
def _weights() -> dict[int, int]:
    text = files(__package__).joinpath("weights.csv").read_text("utf-8")
    return {row.fap: row.weight for row in read_csv(text, _Weight, "weights.csv")}


@cache
def usual(fap: int, sign: int) -> float:
    """The most that is usual of a FAP in a direction (its own unit, positive): what an action unit asks."""
    row = faps()[fap - 1]
    asked = [sign * value for r in au_to_fap() if r.fap == fap for value in (r.fap_from, r.fap_to)]
    most = max(asked, default=0.0)
    if most <= 0:
        most = EYEBALLS_OUT if row.name.endswith("eyeball") and row.unit == "ES" else REACH[row.unit]
        most = PUPIL if row.direction == "growing" else most
    return float(min(most, row.most if sign > 0 else -row.least))


@dataclass(frozen=True, eq=False)
class _Measure:
    face: Face
    skin: slice
    triangles: Any  # of the skin
    open: Bool  # (triangles of the skin,) seen from outside
    seen: Bool  # (vertices of the skin,)
    average: Any  # (skin, skin) sparse: the mean of the neighbours
    twin: Any  # (skin,)
    paired: Bool  # (skin,) the twin is the mirror image

    @classmethod
    @cache
    def of(cls, face: Face) -> _Measure:
        import scipy.sparse as sp
        from scipy.spatial import cKDTree

        first, last = face.parts["skin"]
        mine = face.triangles[(face.triangles >= first).all(axis=1) & (face.triangles < last).all(axis=1)]
        mine = mine - first
        at = face.vertices[first:last].astype(float)
        off, twin = cKDTree(at).query(at * [-1, 1, 1])
        n = len(at)
        i, j = np.concatenate([mine[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))]).T
        near = sp.csr_matrix((np.ones(2 * len(i)), (np.r_[i, j], np.r_[j, i])), (n, n))
        near.data[:] = 1
        count = np.maximum(np.asarray(near.sum(axis=1)).ravel(), 1)
        seen: Bool = np.asarray(face.occlusion[first:last] >= INNER)
        outside: Bool = np.asarray(seen[mine].any(axis=1))
        paired: Bool = np.asarray(off < 3e-4)
        return cls(
            face, slice(first, last), mine, outside, seen,
            sp.diags_array(1 / count) @ near, twin, paired,
        )  # fmt: skip

    def at(self, values: dict[int, float]) -> Float64:
        """(n_vertices, 3) metres under the FAPs."""
        row = np.zeros((1, 68), np.float32)
        for fap, value in values.items():
            row[0, fap - 1] = value
        return np.asarray(deform(self.face, row)[0], np.float64)

    def moves(self, values: dict[int, float]) -> Float64:
        """The same, less the neutral face."""
        return self.at(values) - self.face.vertices


def _truth(measure: _Measure, row: Fap, sign: int) -> Truth:
    top = usual(row.fap, sign)
    angle = row.unit == "angle_unit"
    half = TURN if angle else min(HALF, row.most if sign > 0 else -row.least)
    half = top if row.direction == "growing" else half
    value = sign * half
    # Both what Paul looked at and what is usual have to be right.
    asked = [value] + ([sign * top] if top < half else [])
    moves = [measure.moves({row.fap: v}) for v in asked]
    error = max(_error(measure, row, v, m) for v, m in zip(asked, moves, strict=True))
    twin = measure.moves({row.mirror: value * row.sign})
    here = moves[0][measure.skin]
    if row.group == 6:  # the tongue is in no skin: its points stand for it
        names = [f"6.{k}" for k in (1, 2, 3, 4)]
        index = [measure.face.feature_points[n] for n in names]
        other = [measure.face.feature_points[n] for n in ("6.1", "6.2", "6.4", "6.3")]
        apart = moves[0][index] - twin[other] * [-1, 1, 1]
        largest = np.abs(moves[0][index]).max()
    elif row.group == 3 and row.fap >= 23:
        apart, largest = _ball_apart(measure, row, moves[0], twin)
    else:
        there = twin[measure.skin][measure.twin] * [-1, 1, 1]
        apart, largest = (here - there)[measure.paired], np.abs(here).max()
    return Truth(
        row.fap, row.name, sign, _weights()[row.fap], error,
        float(np.abs(apart).max() / max(largest, 1e-9)),
        _others(measure, row, asked, moves), _flips(measure, row, sign * top), _rough(measure, row, here),
        top,
    )  # fmt: skip


def _ball_apart(measure: _Measure, row: Fap, moves: Float64, twin: Float64) -> tuple[Float64, float]:
    """Eyeballs have no vertex for vertex twins on every face: their rings are compared by how far they go."""
    left = row.name.split("_")[1] == "l"
    parts = measure.face.parts
    mine, other = (slice(*parts[name]) for name in (("left_eye", "right_eye")[:: 1 if left else -1]))
    a, b = np.abs(moves[mine]).max(axis=0), np.abs(twin[other]).max(axis=0)
    return np.asarray(a - b), float(a.max())


def _error(measure: _Measure, row: Fap, value: float, moves: Float64) -> float:
    face = measure.face
    if row.unit == "angle_unit":
        turned = _angle(measure, row, moves)
        return abs(turned / (value * ANGLE_UNIT) - 1)
    asked = value * face.fapu.metres(row.unit)
    if row.direction == "growing":
        return abs(_grown(face, row, moves) / asked - 1)
    move = moves[face.feature_points[row.feature_point]]
    return float(abs(move @ np.array(WAYS[row.direction]) / asked - 1))


def _angle(measure: _Measure, row: Fap, moves: Float64) -> float:
    """Radians that a part turns, positive in the FAP's direction."""
    face = measure.face
    if row.name == "tongue_roll":
        rises = []
        for name in ("6.3", "6.4"):
            vertex = face.feature_points[name]
            # The borders turn about the tongue's middle line.
            away = abs(float(face.vertices[vertex, 0]))
            rises.append(np.arctan2(moves[vertex, 1], away - abs(float(moves[vertex, 0]))))
        return float(min(rises))
    if row.name.startswith("head"):
        vertex, pivot = face.feature_points["9.3"], face.points["7.1"]
        planes = {"head_pitch": (2, 1, -1), "head_yaw": (2, 0, 1), "head_roll": (1, 0, -1)}
    else:
        left = row.name.split("_")[1] == "l"
        vertex = face.feature_points["3.5" if left else "3.6"]
        pivot = face.basis["eyes"][0 if left else 1][1]
        planes = {"yaw_l": (2, 0, 1), "yaw_r": (2, 0, 1), "pitch_l": (2, 1, -1), "pitch_r": (2, 1, -1)}
    along, across, way = next(plane for name, plane in planes.items() if row.name.startswith(name))
    before = face.vertices[vertex].astype(float) - pivot
    after = before + moves[vertex]
    turned = np.arctan2(after[across], after[along]) - np.arctan2(before[across], before[along])
    return float(way * ((turned + np.pi) % (2 * np.pi) - np.pi))


def _grown(face: Face, row: Fap, moves: Float64) -> float:
    """Metres that a pupil gets wider: the ring where the black of the eye ends."""
    eye = 0 if "_l_" in row.name else 1
    part, centre = face.basis["eyes"][eye]
    mine = slice(*part)
    away = face.vertices[mine].astype(float) - centre
    out = np.hypot(away[:, 0], away[:, 1])
    dark = np.flatnonzero((face.colours[mine].max(axis=1) < 40) & (away[:, 2] > 0))
    near = dark[out[dark] < 0.004]
    if not len(near):
        return 0.0
    edge = near[np.isclose(out[near], out[near].max(), atol=1e-4)]
    now = np.hypot(*(away + moves[mine])[edge, :2].T)
    return float(2 * (now - out[edge]).mean())


def _others(measure: _Measure, row: Fap, asked: list[float], moves: list[Float64]) -> float:
    """The largest move of points that must stay, of what was asked."""
    point = row.feature_point
    if row.name == "open_jaw":
        still: tuple[str, ...] = (*UPPER, *LOWER, *CORNERS)
    elif point in UPPER or point in LOWER:
        still = LOWER if point in UPPER else UPPER
    elif point in LIDS:
        still = (LIDS[point],)
    else:
        return 0.0
    index = [measure.face.feature_points[name] for name in still]
    unit = measure.face.fapu.metres(row.unit)
    return max(
        float(np.linalg.norm(m[index], axis=1).max() / abs(v * unit))
        for v, m in zip(asked, moves, strict=True)
    )


def _flips(measure: _Measure, row: Fap, value: float) -> float:
    """Share of the moved skin that turns over; turning parts turn theirs rightly."""
    if row.unit == "angle_unit":
        return 0.0
    values = {row.fap: value} | ({PARTNERS[row.fap]: value} if row.fap in PARTNERS else {})
    corners = measure.triangles[measure.open]
    rest, now = (
        _ups(at[measure.skin][corners]) for at in (measure.face.vertices.astype(float), measure.at(values))
    )
    area = np.linalg.norm(rest, axis=1)
    moved = np.abs(rest - now).max(axis=1) > 1e-3 * area
    # What shrinks to a hair's breadth has no side: a turn has to be past a right angle.
    turned = (rest * now).sum(axis=1) < -0.2 * area * np.linalg.norm(now, axis=1)
    return float(area[turned].sum() / max(area[moved].sum(), 1e-12))


def _ups(corners: Float64) -> Float64:
    a, b, c = corners.transpose(1, 0, 2)
    return np.cross(b - a, c - a)


def _rough(measure: _Measure, row: Fap, moves: Float64) -> float:
    if row.unit == "angle_unit":
        return 0.0
    size = np.linalg.norm(moves, axis=1)
    largest = size.max()
    if largest < 1e-9:
        return 0.0
    off = np.linalg.norm(moves - measure.average @ moves, axis=1) / largest
    index = measure.seen & (size > 0.05 * largest)
    return float(np.percentile(off[index], 95)) if index.any() else 0.0
