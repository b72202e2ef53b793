"""The room that teeth and gums leave to the lining of lips and cheeks.

FAPs displace the lining along straight lines, through teeth that stand behind it. Here it is moved outwards
to where it can be: before the rows of teeth, which are rigid, so that how far each reaches is known at rest.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, Float64
from realizer.face.mesh_geometry import part_triangles, vertex_normals
from realizer.face.model import Face

ROWS = "upper_teeth", "lower_teeth"
TURNS, STEP = 48, 0.00075  # cells of a table around the arch, and m of its cells up and down
CELL = 4  # points each way on a triangle that is entered in a table
APART = 0.0005  # m between teeth and lining, which is drawn rounder than it is deformed
DEEP, FAR = 0.002, 0.012  # m behind and before the teeth that lining is looked for at rest,
BEYOND = 0.006  # and above and below them
FACING = 0.7  # greatest cosine between normals of lining and the way outwards
SLOPE = 2.0  # metres inwards for each metre beyond the edges of a row
SOFT = 0.0004  # m; lining is squeezed before it touches: what lay farther out stays farther out


class LipRoom:
    """Moves the lining of a face's lips and cheeks out of its teeth."""

    def __init__(self, face: Face) -> None:
        self._rows = [_Row(face, face.vertices.astype(np.float64), name) for name in ROWS]

    def __call__(self, out: Float32) -> None:
        """Move the lining of deformed faces (n, n_vertices, 3), whose heads are not turned, in place."""
        for row in self._rows:
            row(out)


class _Row:
    """A row of teeth: how far it reaches outwards, by direction and height, and the lining before it."""

    def __init__(self, face: Face, at: Float64, name: str) -> None:
        first, last = face.parts[name]
        mine = at[first:last]
        self._back = float(mine[np.abs(mine[:, 0]).argmax(), 2])
        self._frame = first + np.array([mine[:, 2].argmax(), mine[:, 2].argmin()], np.int32)
        self._rest = at[self._frame].astype(np.float32)
        triangles = part_triangles(face.triangles, face.parts[name])
        i, j = np.meshgrid(np.arange(CELL + 1), np.arange(CELL + 1))
        u, v = i[i + j <= CELL] / CELL, j[i + j <= CELL] / CELL
        places = np.einsum("tcx,cp->tpx", mine[triangles], np.stack([1 - u - v, u, v])).reshape(-1, 3)
        self._low = float(places[:, 1].min())
        around, turn, height = self._polar(places)
        table = np.zeros((TURNS + 1, int(height.max()) + 2), np.float32)
        cell = turn.astype(int), height.astype(int)
        for right, up in ((0, 0), (0, 1), (1, 0), (1, 1)):
            np.maximum.at(table, (cell[0] + right, cell[1] + up), around)
        for beside in (table, table[:, ::-1]):
            for k in range(1, table.shape[1]):
                np.maximum(beside[:, k], beside[:, k - 1] - SLOPE * STEP, out=beside[:, k])
        self._table = table
        first, last = face.parts["skin"]
        skin = at[first:last]
        ups = vertex_normals(skin, part_triangles(face.triangles, face.parts["skin"]))
        need, around, way = self._need(skin, 0)
        found = (around > need - DEEP) & (around < need + FAR) & (skin[:, 2] > mine[:, 2].min())
        found &= (skin[:, 1] > self._low - BEYOND) & (skin[:, 1] < mine[:, 1].max() + BEYOND)
        found &= (way * ups[:, [0, 2]]).sum(axis=1) < FACING
        self._lining = np.flatnonzero(found) + first
        self._home = face.vertices[self._lining]
        # At rest nothing moves, not even what lies among the roots of gums.
        need, around, _ = self._need(at[self._lining])
        self._loose = _squeezed(need - around).astype(np.float32)

    def __call__(self, out: Float32) -> None:
        """Move the lining of deformed faces (n, n_vertices, 3) outwards, in place."""
        lining, frame = out[:, self._lining], out[:, self._frame]
        if np.abs(lining - self._home).max(initial=0) < 1e-6:
            return
        # The row as it was at rest: only jaws turn, about their axis.
        before, now = self._rest[1] - self._rest[0], frame[:, 1] - frame[:, 0]
        turn = np.arctan2(now[:, 1], now[:, 2]) - np.arctan2(before[1], before[2])
        cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
        x, y, z = np.moveaxis(lining - frame[:, None, 0], 2, 0)
        at = np.stack([x, y * cos - z * sin, z * cos + y * sin], axis=-1) + self._rest[0]
        need, around, way = self._need(at)
        push = np.maximum(_squeezed(need - around) - self._loose, 0)
        ahead = push * way[..., 1]
        out[:, self._lining] = lining + np.stack([push * way[..., 0], ahead * sin, ahead * cos], axis=-1)

    def _polar(self, at: Any) -> tuple[Any, Any, Any]:
        """Return distances from the middle of the arch, and directions and heights in cells of the table."""
        ahead = np.maximum(at[..., 2] - self._back, 0)
        turn = (np.arctan2(at[..., 0], ahead) / np.pi + 0.5) * TURNS
        return np.hypot(at[..., 0], ahead), np.clip(turn, 0, TURNS - 1e-3), (at[..., 1] - self._low) / STEP

    def _need(self, at: Any, slope: float = SLOPE) -> tuple[Any, Any, Any]:
        """Return how far out places (..., 3) must be and are, and the way out (..., 2) in x and z."""
        around, turn, height = self._polar(at)
        table, rows = self._table, self._table.shape[1]
        inside = np.clip(height, 0, rows - 1 - 1e-3)
        i, j = turn.astype(np.intp), inside.astype(np.intp)
        f, g = turn - i, inside - j
        first, second = ((1 - g) * table[k, j] + g * table[k, j + 1] for k in (i, i + 1))
        need = first + f * (second - first) + APART - slope * STEP * np.abs(height - inside)
        ahead = np.maximum(at[..., 2] - self._back, 0)
        return need, around, np.stack([at[..., 0], ahead], axis=-1) / np.maximum(around, 1e-6)[..., None]


def _squeezed(inside: Any) -> Any:
    """Return how far to move what is that far inside, metres: a smooth step from nothing to all of it."""
    return SOFT * np.logaddexp(0, inside / SOFT)


@lru_cache(maxsize=8)
def lip_room(face: Face) -> LipRoom | None:
    """Return the room of a face's lips, or None if the face lacks teeth."""
    return LipRoom(face) if set(ROWS) <= set(face.parts) else None
