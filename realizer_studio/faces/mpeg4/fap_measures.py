"""Measures of one FAP on a face: error, symmetry, side effects, flips, roughness."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from realizer.core.array_types import Bool, Float64
from realizer.core.units import ANGLE_UNIT
from realizer.face.au.regions import LOWER, UPPER
from realizer.face.deform import deform
from realizer.face.mesh_geometry import (
    half_edges,
    mirror_twins,
    neighbour_mean,
    part_triangles,
    triangle_normals,
)
from realizer.face.model import Face
from realizer.tables import Fap
from realizer_studio.faces.eyeball import PUPIL
from realizer_studio.faces.mpeg4.zone_fields import DIRECTIONS

CORNERS = ("2.4", "2.5", "8.3", "8.4")
LIDS = {"3.1": "3.3", "3.3": "3.1", "3.2": "3.4", "3.4": "3.2"}
TONGUE = {43, 44, 45, 46, 47}
INNER = 0.30  # baked occlusion below which skin is behind the lips or in a socket


@dataclass(frozen=True, eq=False)
class Measure:
    """A face, prepared for measuring the displacements of its skin."""

    face: Face
    skin: slice
    triangles: Any  # of the skin
    visible: Bool  # (vertices of the skin,)
    average: Any  # (skin, skin) sparse: the mean of the neighbours
    twin: Any  # (skin,)
    paired: Bool  # (skin,) the twin is the mirror image

    @classmethod
    @lru_cache(maxsize=4)
    def of(cls, face: Face) -> Measure:
        first, last = face.parts["skin"]
        triangles = part_triangles(face.triangles, face.parts["skin"])
        vertices = face.vertices[first:last].astype(float)
        twin = mirror_twins(vertices, 3e-4)
        visible: Bool = np.asarray(face.occlusion[first:last] >= INNER)
        mean = neighbour_mean(len(vertices), half_edges(triangles), own=False)
        return cls(face, slice(first, last), triangles, visible, mean, twin, np.asarray(twin >= 0))

    def deformed(self, values: dict[int, float]) -> Float64:
        """(n_vertices, 3) metres, the vertices moved by the FAPs."""
        row = np.zeros((1, 68), np.float32)
        for fap, value in values.items():
            row[0, fap - 1] = value
        face = self.toothless if set(values) <= TONGUE else self.face
        return np.asarray(deform(face, row)[0], np.float64)

    @cached_property
    def toothless(self) -> Face:
        """The face without teeth, which would stop its tongue."""
        parts = {name: part for name, part in self.face.parts.items() if "teeth" not in name}
        return dataclasses.replace(self.face, parts=parts)

    def displacement(self, values: dict[int, float]) -> Float64:
        """(n_vertices, 3) metres, the displacement from the neutral face."""
        return self.deformed(values) - self.face.vertices


def asymmetry_of(measure: Measure, row: Fap, moves: Float64, twin: Float64) -> float:
    """Return the largest difference from the mirror image, as a share of the largest displacement."""
    skin_moves = moves[measure.skin]
    if row.group == 6:  # the tongue is not part of the skin: its feature points are compared
        points = measure.face.feature_points
        index = [points[name] for name in ("6.1", "6.2", "6.3", "6.4")]
        mirror_index = [points[name] for name in ("6.1", "6.2", "6.4", "6.3")]
        difference = moves[index] - twin[mirror_index] * [-1, 1, 1]
        largest = float(np.abs(moves[index]).max())
    elif row.group == 3 and row.fap >= 23:
        difference, largest = _eye_difference(measure, row, moves, twin)
    else:
        mirrored = twin[measure.skin][measure.twin] * [-1, 1, 1]
        difference, largest = (skin_moves - mirrored)[measure.paired], float(np.abs(skin_moves).max())
    return float(np.abs(difference).max() / max(largest, 1e-9))


def _eye_difference(measure: Measure, row: Fap, moves: Float64, twin: Float64) -> tuple[Float64, float]:
    """Return the difference between the largest displacements of both eyeballs, and that of one.

    On some faces the vertices of the eyeballs have no mirror images.
    """
    left = row.name.split("_")[1] == "l"
    parts = measure.face.parts
    own, other = (slice(*parts[name]) for name in (("left_eye", "right_eye")[:: 1 if left else -1]))
    a, b = np.abs(moves[own]).max(axis=0), np.abs(twin[other]).max(axis=0)
    return np.asarray(a - b), float(a.max())


def error_of(measure: Measure, row: Fap, value: float, moves: Float64) -> float:
    face = measure.face
    if row.unit == "angle_unit":
        turned = _angle(measure, row, moves)
        return abs(turned / (value * ANGLE_UNIT) - 1)
    requested = value * face.fapu.metres(row.unit)
    if row.direction == "growing":
        return abs(_pupil_growth(face, row, moves) / requested - 1)
    move = moves[face.feature_points[row.feature_point]]
    return float(abs(move @ np.array(DIRECTIONS[row.direction]) / requested - 1))


def _angle(measure: Measure, row: Fap, moves: Float64) -> float:
    """Return the rotation of a part in radians, positive in the FAP's direction."""
    face = measure.face
    if row.name == "tongue_roll":
        rises = []
        for name in ("6.3", "6.4"):
            vertex = face.feature_points[name]
            # The borders turn about the tongue's middle line.
            radius = abs(float(face.vertices[vertex, 0]))
            rises.append(np.arctan2(moves[vertex, 1], radius - abs(float(moves[vertex, 0]))))
        return float(min(rises))
    if row.name.startswith("head"):
        vertex, pivot = face.feature_points["9.3"], face.points["7.1"]
        planes = {"head_pitch": (2, 1, -1), "head_yaw": (2, 0, 1), "head_roll": (1, 0, -1)}
    else:
        left = row.name.split("_")[1] == "l"
        vertex = face.feature_points["3.5" if left else "3.6"]
        pivot = face.basis["eyes"][0 if left else 1][1]
        planes = {"yaw_l": (2, 0, 1), "yaw_r": (2, 0, 1), "pitch_l": (2, 1, -1), "pitch_r": (2, 1, -1)}
    along, across, sign = next(plane for name, plane in planes.items() if row.name.startswith(name))
    before = face.vertices[vertex].astype(float) - pivot
    after = before + moves[vertex]
    turned = np.arctan2(after[across], after[along]) - np.arctan2(before[across], before[along])
    return float(sign * ((turned + np.pi) % (2 * np.pi) - np.pi))


def _pupil_growth(face: Face, row: Fap, moves: Float64) -> float:
    """Return by how many metres the ring of vertices at a pupil's edge gets wider."""
    eye = 0 if "_l_" in row.name else 1
    part, centre = face.basis["eyes"][eye]
    vertices = slice(*part)
    offset = face.vertices[vertices].astype(float) - centre
    distance = np.hypot(offset[:, 0], offset[:, 1])
    rim = np.flatnonzero(np.isclose(distance, PUPIL, atol=1e-4) & (offset[:, 2] > 0))
    if not len(rim):
        return 0.0
    widened = np.hypot(*(offset + moves[vertices])[rim, :2].T)
    return float(2 * (widened - distance[rim]).mean())


def side_effect_of(measure: Measure, row: Fap, values: list[float], moves: list[Float64]) -> float:
    """Return the largest displacement of points that must stay, as a share of the requested one."""
    point = row.feature_point
    if row.name == "open_jaw":
        fixed: tuple[str, ...] = (*UPPER, *LOWER, *CORNERS)
    elif point in UPPER or point in LOWER:
        fixed = LOWER if point in UPPER else UPPER
    elif point in LIDS:
        fixed = (LIDS[point],)
    else:
        return 0.0
    index = [measure.face.feature_points[name] for name in fixed]
    if row.name == "open_jaw":
        # Stretched cheeks draw the lips' corners backwards, which no FAP of the lips does.
        moves = [move * [1, 1, 0] for move in moves]
    unit = measure.face.fapu.metres(row.unit)
    return max(
        float(np.linalg.norm(m[index], axis=1).max() / abs(v * unit))
        for v, m in zip(values, moves, strict=True)
    )


def flips_of(measure: Measure, row: Fap, values: dict[int, float], cosine: float = 0.0) -> float:
    """Return the share of the moved skin that turns by more than an angle; 0 for FAPs that rotate a part."""
    if row.unit == "angle_unit":
        return 0.0
    corners = measure.triangles
    before, after = (
        triangle_normals(vertices[measure.skin], corners)
        for vertices in (measure.face.vertices.astype(float), measure.deformed(values))
    )
    area = np.linalg.norm(before, axis=1)
    moved = np.abs(before - after).max(axis=1) > 1e-3 * area
    turned = (before * after).sum(axis=1) < cosine * area * np.linalg.norm(after, axis=1)
    return float(area[turned].sum() / max(area[moved].sum(), 1e-12))


def roughness_of(measure: Measure, row: Fap, moves: Float64) -> float:
    if row.unit == "angle_unit":
        return 0.0
    size = np.linalg.norm(moves, axis=1)
    largest = size.max()
    if largest < 1e-9:
        return 0.0
    deviation = np.linalg.norm(moves - measure.average @ moves, axis=1) / largest
    index = measure.visible & (size > 0.05 * largest)
    return float(np.percentile(deviation[index], 95)) if index.any() else 0.0
