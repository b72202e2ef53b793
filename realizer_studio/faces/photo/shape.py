"""Landmarks on a person described by sliders, and their projection by a camera."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from realizer.core.array_types import Float64, Index
from realizer.tables import csv_rows, toml_table
from realizer_studio.faces.person import makehuman
from realizer_studio.faces.person.sliders import AGES, person_targets

DISTANCE = 1.5  # m from the camera to the head, assumed, because pictures do not show it
SPREAD = 0.2  # standard deviation of a slider
# Prior of an unknown person: mean, standard deviation, bounds. Weight and muscle hardly change a head.
LIKELY = {"age": (42.0, 30.0, *AGES), "sex": (0.5, 1.5, 0.0, 1.0)}
PEOPLES = {"african": (-0.5, 2.0, -5.0, 4.0), "asian": (-0.5, 2.0, -5.0, 4.0)}  # logarithms beside caucasian


@dataclass(frozen=True, slots=True)
class _AnchorRow:
    view: str
    landmark: int
    a: int
    b: int
    c: int
    share_b: float
    share_c: float


@dataclass(frozen=True, eq=False)
class LandmarkAnchors:
    """The positions of landmarks on the base mesh, as barycentric coordinates."""

    numbers: Index  # (k,) of the landmarks
    corners: Index  # (k, 3) base vertices
    shares: Float64  # (k, 3) their weights

    @classmethod
    def of(cls, view: str) -> LandmarkAnchors:
        """Return the anchors of the landmarks in a view, front or side."""
        rows = [row for row in csv_rows("landmark_places.csv", _AnchorRow, __package__) if row.view == view]
        second, third = (np.array([getattr(row, f"share_{k}") for row in rows]) for k in "bc")
        return cls(
            np.array([row.landmark for row in rows]),
            np.array([(row.a, row.b, row.c) for row in rows]),
            np.stack([1 - second - third, second, third], axis=1),
        )

    def positions(self, at: Float64) -> Float64:
        """Return the positions (k, 3) on a base mesh (n, 3)."""
        return np.asarray(np.einsum("nk,nki->ni", self.shares, at[self.corners]))

    def subset(self, chosen: Any) -> LandmarkAnchors:
        """Return the chosen anchors."""
        return LandmarkAnchors(self.numbers[chosen], self.corners[chosen], self.shares[chosen])


@dataclass(frozen=True, eq=False)
class Pose:
    """The pose of a head in front of a camera."""

    turn: Float64  # (3,) rotation vector of the head, radians
    size: float  # pixels per metre at the distance of the eyes
    middle: Float64  # (2,) pixels of the point between the eyes

    def __call__(self, at: Any) -> tuple[Float64, Float64]:
        """Return the pixels (n, 2) of points (n, 3), and their nearness (n,) to the camera in metres."""
        rotated = np.asarray(at, np.float64) @ self.rotation.T
        scale = self.size * DISTANCE / (DISTANCE - rotated[:, 2:])
        return self.middle + scale * rotated[:, :2] * (1, -1), rotated[:, 2]

    @property
    def rotation(self) -> Float64:
        """The rotation matrix (3, 3) of the head."""
        return np.asarray(Rotation.from_rotvec(self.turn).as_matrix())


class Sliders:
    """Some vertices of the base mesh as a function of sliders.

    Attributes:
        names: of the free sliders; `low`, `high`: (k,) their bounds, in standard deviations.
    """

    def __init__(self, data: Path, fixed: Mapping[str, Any], used: Index) -> None:
        """
        Args:
            data: the folder of shape targets.
            fixed: sliders with fixed values.
            used: the vertices to compute.
        """
        self._data, self._fixed = data, dict(fixed)
        self._mesh = makehuman.read_base(data)
        self._eyes = [np.unique(self._mesh.quads[f"helper-{side}-eye"]) for side in "lr"]
        self._used = np.unique(np.concatenate([used.ravel(), *self._eyes]))
        self._targets: dict[str, Float64] = {}
        sliders = dict.fromkeys(toml_table("person.toml")["sliders"], (0.0, SPREAD, -1.0, 1.0))
        rows = {name: row for name, row in (LIKELY | sliders).items() if name not in fixed}
        rows |= {} if "people" in fixed else PEOPLES
        self.names = tuple(rows)
        self._mean, self._spread, low, high = np.array(list(rows.values())).T
        self.low, self.high = (low - self._mean) / self._spread, (high - self._mean) / self._spread

    def person(self, values: Float64) -> dict[str, Any]:
        """Return the table [person] of a recipe for values (k,), in standard deviations from the mean."""
        figures = self._mean + self._spread * np.clip(values, self.low, self.high)
        given = dict(zip(self.names, figures.tolist(), strict=True))
        if "people" not in self._fixed:
            shares = {name: float(np.exp(given.pop(name))) for name in PEOPLES} | {"caucasian": 1.0}
            total = sum(shares.values())
            given["people"] = {name: round(share / total, 4) for name, share in shares.items()}
        return self._fixed | {k: v if k == "people" else round(v, 4) for k, v in given.items()}

    def mesh(self, person: Mapping[str, Any]) -> Float64:
        """Return the base mesh (n, 3) of a person, metres from between the eyes, without corrections."""
        at = self._mesh.vertices.copy()
        for name, weight in person_targets(person).items():
            if name not in self._targets:
                sides = [name.replace("*", side) for side in (("l-", "r-") if "*" in name else ("",))]
                moves = sum(makehuman.read_target(self._data, side, len(at)) for side in sides)
                self._targets[name] = np.asarray(moves)[self._used]
            at[self._used] += weight * self._targets[name]
        middle = np.mean([at[eye].mean(axis=0) for eye in self._eyes], axis=0)
        return np.asarray((at - middle) * makehuman.DECIMETRE)
