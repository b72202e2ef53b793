"""A face driven by action units alone: intensities in, vertices out; one product, then what turns."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from realizer.arrays import Bool, Float32, Float64
from realizer.errors import FaceError
from realizer.face.au.file import read_model
from realizer.face.au.model import Model, rotation
from realizer.face.au.mouth import shares
from realizer.face.au.units import units
from realizer.face.load import folder_of, load_face, read_head
from realizer.face.model import Face
from realizer.tables import action_units

__all__ = ["Deformer", "load_deformer"]

MODEL = "au_extended.toml"
# Whatever else a face is built from moves with the head alone.
FACE = ("skin", "brows", "lashes", "hair")
GROWN = ("brows", "lashes")
JAW = ("lower_teeth", "tongue")
EYES = ("left_eye", "right_eye")
LIDS = ("5", "6", "7", "9", "43")  # what moves the lids
CHUNK = 16  # frames at once: what a cache holds
LEAST = 1e-5  # m; what a unit moves less is left out of it


class Deformer:
    """A face and its model made ready: displacements are one matrix, made once.

    Attributes:
        columns: "1L", "1R", ... "17", ...: what the columns of the intensities stand for.
    """

    def __init__(self, face: Face, model: Model) -> None:
        from scipy.sparse import csr_matrix

        self.face, self.model = face, model
        sides = {row.au: row.sides for row in action_units()}
        names = [(au, side) for au in sorted(model.units) for side in (("L", "R") if sides[au] else ("",))]
        self.columns = tuple(f"{au}{side}" for au, side in names) + tuple(map(str, sorted(model.degrees)))
        self._displacing = len(names)
        at = face.vertices.astype(np.float64)
        mine = np.zeros(len(at), bool)
        for part in FACE:
            if part in face.parts:
                mine[slice(*face.parts[part])] = True
        upper = shares(face, model.mouth)
        moves = np.zeros((len(names), *at.shape))
        for row, (au, side) in zip(moves, names, strict=True):
            row[mine] = model.displacement(au, at[mine], side, upper[mine])
        self._grow(moves)
        moves[np.abs(moves).max(axis=2) < LEAST] = 0
        found = np.flatnonzero(moves.any(axis=(0, 2)))
        self._moving = slice(int(found[0]), int(found[-1]) + 1)
        columns = moves[:, self._moving].reshape(len(names), -1).T
        self._basis = csr_matrix(columns.astype(np.float32))
        self._turns = [
            (units()[au].kind, "zxy".index(units()[au].turn[1]), column, units()[au].axis, model.degrees[au])
            for column, au in enumerate(sorted(model.degrees), len(names))
        ]
        self._jaw = np.zeros(len(self.columns), np.float32)
        for column, (au, _) in enumerate(names):
            self._jaw[column] = model.units[au].jaw_degrees
        self._lids = np.array([name.rstrip("LR") in LIDS for name in self.columns])
        self._neck = model.head.density(at).astype(np.float32)[:, None]

    def __call__(self, intensities: Any) -> Float32:
        """The face's vertices.

        Args:
            intensities: (n, columns) 0..1.

        Returns:
            (n, n_vertices, 3) float32 metres.

        Raises:
            ValueError: another shape, or values that are not finite.
        """
        rows = np.asarray(intensities, np.float32)
        if rows.ndim != 2 or rows.shape[1] != len(self.columns):
            raise ValueError(f"intensities: wanted (n, {len(self.columns)}), got {rows.shape}")
        if not np.isfinite(rows).all():
            raise ValueError("intensities: wanted finite values, got NaN or infinity")
        out = np.empty((len(rows), *self.face.vertices.shape), np.float32)
        lids: Bool = np.asarray(rows[:, self._lids].any(axis=1))
        for start in range(0, len(rows), CHUNK):
            part = slice(start, start + CHUNK)
            here = out[part]
            here[:] = self.face.vertices
            moves = self._basis @ np.ascontiguousarray(rows[part, : self._displacing].T)
            here[:, self._moving] += moves.T.reshape(len(here), -1, 3)
            for row, lid, vertices in zip(rows[part], lids[part], here, strict=True):
                self._turn(row, bool(lid), vertices)
        return out

    def row(self, values: Mapping[int, float]) -> Float32:
        """(columns,) intensities of action units, on both sides where they have sides."""
        out = np.zeros(len(self.columns), np.float32)
        for k, name in enumerate(self.columns):
            out[k] = values.get(int(name.rstrip("LR")), 0)
        return out

    def _grow(self, moves: Float64) -> None:
        """Brows and lashes go with the skin that they grow on: off it, functions of the place differ."""
        from scipy.spatial import cKDTree

        first, last = self.face.parts["skin"]
        tree = cKDTree(self.face.vertices[first:last])
        for part in GROWN:
            if part in self.face.parts:
                mine = slice(*self.face.parts[part])
                root = np.asarray(tree.query(self.face.vertices[mine])[1])
                moves[:, mine] = moves[:, first + root]

    def _turn(self, row: Float32, lids: bool, vertices: Float32) -> None:
        """Jaw bone, lids over eyeballs, eyeballs, head: what is an object's own first (5.1)."""
        model, parts = self.model, self.face.parts
        jaw = float(self._jaw @ row)
        if jaw:
            turn = rotation((1, 0, 0), np.radians(jaw))
            for part in JAW:
                if part in parts:
                    _about(vertices[slice(*parts[part])], turn, model.jaw)
        if lids:
            self._slide_lids(vertices)
        eyes, head = self._rotation("eyes", row), self._rotation("head", row)
        if eyes is not None:
            for part, centre in zip(EYES, model.eyes, strict=True):
                if part in parts:
                    _about(vertices[slice(*parts[part])], eyes, centre)
        if head is not None:
            by, pivot = head.astype(np.float32) - np.eye(3, dtype=np.float32), np.array(model.head.pivot)
            moves = vertices @ by.T
            moves -= (by @ pivot).astype(np.float32)
            moves *= self._neck
            vertices += moves

    def _rotation(self, kind: str, row: Float32) -> Float64 | None:
        """The turns of one kind, one after the other: tilts first, turns to a side last, as FAPs 48 to 50."""
        mine = sorted(turn for turn in self._turns if turn[0] == kind and row[turn[2]])
        whole = None
        for _, _, column, axis, degrees in mine:
            turn = rotation(axis, float(row[column]) * np.radians(degrees))
            whole = turn if whole is None else turn @ whole
        return whole

    def _slide_lids(self, vertices: Float32) -> None:
        """Lids do not sink into the balls they slide over: pushed forward, as the FAPs' lids are."""
        basis = self.face.basis
        if "lid" not in basis:
            return
        lid, centres = basis["lid"], np.array(self.model.eyes, np.float32)[basis["lid_eye"]]
        away = vertices[lid] - centres
        room = np.square(basis["lid_radius"]) - np.square(away[:, 0]) - np.square(away[:, 1])
        push = np.sqrt(np.maximum(room, 0)) - away[:, 2]
        vertices[lid, 2] += np.where(room > 0, np.maximum(push, 0), 0)


def _about(vertices: Float32, turn: Float64, pivot: tuple[float, float, float]) -> None:
    centre = np.array(pivot, np.float32)
    vertices[:] = (vertices - centre) @ turn.T.astype(np.float32) + centre


def load_deformer(
    name: str = "default", directory: Path | str | None = None, model: Path | None = None
) -> Deformer | None:
    """The action unit deformer of a face whose face.toml says `deformer = "au"`; None where it does not.

    Args:
        model: a fitted model to take, whatever face.toml says.

    Raises:
        FaceError: no such face or model, or another word in face.toml.
    """
    folder = folder_of(name, directory)
    chosen = read_head(folder).get("deformer", "mpeg4")
    if chosen not in ("mpeg4", "au"):
        raise FaceError(f"{folder / 'face.toml'}: deformer: wanted mpeg4 or au, got {chosen!r}")
    if model is None and chosen == "mpeg4":
        return None
    return Deformer(load_face(name, directory), read_model(model or folder / MODEL))
