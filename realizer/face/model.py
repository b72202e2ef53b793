"""The data of a face that was loaded from a folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from realizer.core.array_types import Float32, Int32, UInt8
from realizer.tables import faps

if TYPE_CHECKING:
    from realizer.face.au.model import Model
    from realizer.face.cards import Cards
    from realizer.face.maps import Maps


@dataclass(frozen=True)
class Fapu:
    """The distances of the neutral face in metres; a FAP unit is a distance / 1024."""

    irisd0: float
    es0: float
    ens0: float
    mns0: float
    mw0: float

    def metres(self, unit: str) -> float:
        """Return one unit of MNS, MW, ENS, ES or IRISD in metres, an angle_unit in radians, 0 for "none"."""
        if unit in ("none", "angle_unit"):
            return {"none": 0.0, "angle_unit": 1e-5}[unit]
        return float(getattr(self, unit.lower() + "0")) / 1024


@dataclass(frozen=True, eq=False)
class Face:
    """The mesh of a head, and the data that moves it.

    Attributes:
        name, source, licence: as in face.toml.
        vertices: (n, 3) float32 metres, neutral; origin between the eyes, +x the character's left, +y up,
            +z forward.
        triangles: (m, 3) int32, counter-clockwise seen from outside.
        colours: (n, 3) uint8 sRGB albedo.
        occlusion: (n,) float32, baked ambient occlusion, from 0 (dark) to 1 (open).
        gloss: (n,) float32, 0..1; eyes, lips and teeth have high values.
        parts: name -> (first, last + 1) vertex range: skin, left_eye, right_eye, upper_teeth, lower_teeth,
            tongue, brows, lashes, hair, shirt; some may be missing.
        feature_points: "2.1" -> index of the vertex nearest to the MPEG-4 feature point.
        points: "2.1" -> (3,) float32 metres, the feature point, which may be inside the head (7.1, 3.5).
        fapu: distances between the feature points.
        basis: data of `face.deform` (displacement fields, rigid parts), made when the face is built.
        cameras: extra camera presets by name.
        inputs: names of the columns of a pose, from which `face.deform` computes vertices: the 68 FAPs,
            then the inputs of the model (`au.columns`).
        model: functions by which action units displace points; None if FAPs move everything.
        maps: pictures of the surface; None if colours of vertices are all there is.
        cards: strips with pictures of hairs that follow the mesh, if there are any.
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
    maps: Maps | None = None
    cards: Cards | None = None

    @property
    def bounds(self) -> tuple[Float32, Float32]:
        """Lowest and highest corner of the neutral mesh, (3,) metres each."""
        return np.min(self.vertices, axis=0), np.max(self.vertices, axis=0)
