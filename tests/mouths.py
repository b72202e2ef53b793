"""Frames of a face in; how far its lips are apart and where its lower lip and upper teeth are out."""

from __future__ import annotations

from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.deform import deform
from realizer.face.model import Face

__all__ = ["Mouth"]

COLUMNS = np.array([-0.5, -0.25, 0.0, 0.25, 0.5])  # of half the width of the mouth at rest
MIDDLE = 2
LIPS = {"upper": (4, 8, 9, 51, 55, 56), "lower": (5, 10, 11, 52, 57, 58)}  # FAPs
MINE = 0.3  # of the way that the lip goes most
WIDE = 0.005  # m to the sides: the two incisors in the middle


class Mouth:
    """What the vertices of a face's mouth do, seen from the front; in mouth-nose separations."""

    def __init__(self, face: Face) -> None:
        self.face = face
        self.unit = float(face.fapu.mns0)
        at = face.vertices
        self.columns = COLUMNS * (face.points["2.4"][0] - face.points["2.5"][0]) / 2
        share = {lip: _share(face, faps) for lip, faps in LIPS.items()}
        first, last = face.parts["skin"]
        sides = np.concatenate([face.triangles[:, pair] for pair in ([0, 1], [1, 2], [0, 2])])
        edges = np.unique(np.sort(sides[((sides >= first) & (sides < last)).all(axis=1)], axis=1), axis=0)
        self.edges = {}
        for lip, other in (("upper", "lower"), ("lower", "upper")):
            mine = (share[lip] > MINE) & (share[lip] > share[other])
            self.edges[lip] = edges[mine[edges].all(axis=1)]
        a, b = face.parts["upper_teeth"]
        teeth = np.arange(a, b)[np.abs(at[a:b, 0]) < WIDE]
        self.edge = float(at[teeth, 1].min())

    def vertices(self, poses: Any) -> Float64:
        """(n, n_vertices, 3) metres."""
        return deform(self.face, poses).astype(np.float64)

    def lips(self, vertices: Any) -> tuple[Float64, Float64]:
        """(n, 5) each, m: the upper lip's lowest and the lower lip's highest place, at five columns."""
        return (
            np.asarray(-self._highest(vertices * [1, -1, 1], "upper")),
            self._highest(vertices, "lower"),
        )

    def gap(self, vertices: Any) -> Float64:
        """(n,): between the lips where they are furthest apart, over the middle half of the mouth."""
        upper, lower = self.lips(vertices)
        return np.asarray((upper - lower).max(axis=1) / self.unit)

    def bite(self, vertices: Any) -> Float64:
        """(n, 2): how far the lower lip stands above the edge of the incisors, and below the upper lip."""
        upper, lower = (lip[:, MIDDLE] for lip in self.lips(vertices))
        return np.stack([lower - self.edge, upper - lower], axis=1) / self.unit

    def path(self, vertices: Any) -> Float64:
        """(n, 4, 3): the middles of both lips and both corners."""
        at = [self.face.feature_points[p] for p in ("2.2", "2.3", "2.4", "2.5")]
        return np.asarray(vertices[:, at] / self.unit, np.float64)

    def _highest(self, vertices: Any, lip: str) -> Float64:
        """(n, 5): the highest place at each column of the lip's edges."""
        (x, y), (u, v) = (vertices[:, self.edges[lip][:, end], :2].transpose(2, 0, 1) for end in (0, 1))
        out = []
        for column in self.columns:
            with np.errstate(divide="ignore", invalid="ignore"):
                part = (column - x) / (u - x)
            there = (part >= 0) & (part <= 1)
            out.append(np.where(there, y + part * (v - y), -np.inf).max(axis=1))
        return np.stack(out, axis=1)


def _share(face: Face, faps: tuple[int, ...]) -> Float64:
    """(n_vertices,) 0..1: how far each goes with a lip."""
    first, last = face.basis["moving"]
    moves = sum(np.asarray(face.basis["fields"][:, [fap - 1]].todense()).reshape(-1, 3) for fap in faps)
    length = np.zeros(len(face.vertices))
    length[first:last] = np.linalg.norm(moves, axis=1)
    return np.asarray(length / length.max(), np.float64)
