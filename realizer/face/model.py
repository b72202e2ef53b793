"""The value of a face that is loaded from a folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from realizer.core.array_types import Float32, Int32, UInt8
from realizer.tables import faps

if TYPE_CHECKING:
    from realizer.face.au.model import Model


@dataclass(frozen=True)
class Fapu:
    """The face's distances in metres, measured on the neutral face; a unit is the distance / 1024."""

    irisd0: float
    es0: float
    ens0: float
    mns0: float
    mw0: float

    def metres(self, unit: str) -> float:
        """Return metres of one unit of MNS, MW, ENS, ES or IRISD; radians of an angle_unit; 0 for none."""
        if unit in ("none", "angle_unit"):
            return {"none": 0.0, "angle_unit": 1e-5}[unit]
        return float(getattr(self, unit.lower() + "0")) / 1024


@dataclass(frozen=True, eq=False)
class Face:
    """A head, and what moves it.

    Attributes:
        name, source, licence: from face.toml.
        vertices: (n, 3) float32 metres, neutral; origin between the eyes, +x the character's left, +y up,
            +z forward.
        triangles: (m, 3) int32, counter-clockwise seen from outside.
        colours: (n, 3) uint8 sRGB albedo.
        occlusion: (n,) float32, 0 dark .. 1 open: baked ambient occlusion.
        gloss: (n,) float32, 0..1: eyes, lips, teeth shine.
        parts: name -> (first, last + 1) vertex range: skin, left_eye, right_eye, upper_teeth, lower_teeth,
            tongue, brows, lashes, hair, shirt; a face may leave some out.
        feature_points: "2.1" -> index of the vertex nearest to the MPEG-4 feature point.
        points: "2.1" -> (3,) float32 metres, the feature point itself (may lie inside the head: 7.1, 3.5).
        fapu: measured from the feature points.
        basis: what `face.deform` needs (displacement fields, rigid parts), made when the face is built.
        cameras: extra camera presets by name.
        inputs: the columns of a pose, a row from which `face.deform` makes vertices: the 68 FAPs,
            then the inputs of the model (`au.columns`).
        model: the action units that displace by functions of the place; None if FAPs move everything.
    """

    name: str
    source: str
    licence: str
    vertices: Float32
    triangles: Int32
    colours: UInt8
    occlusion: Float32
    gloss: Float32
    parts: Mapping[str, tuple[int, int]]
    feature_points: Mapping[str, int]
    points: Mapping[str, Float32]
    fapu: Fapu
    basis: Mapping[str, Any]
    cameras: Mapping[str, Any] = field(default_factory=dict)
    inputs: tuple[str, ...] = field(default_factory=lambda: tuple(row.name for row in faps()))
    model: Model | None = None

    @property
    def bounds(self) -> tuple[Float32, Float32]:
        """Lowest and highest corner of the neutral mesh, (3,) metres each."""
        return np.min(self.vertices, axis=0), np.max(self.vertices, axis=0)
