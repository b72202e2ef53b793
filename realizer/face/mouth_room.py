"""The room that teeth, palate and lips leave to the tongue, and that teeth leave to lips and cheeks.

FAPs displace tongue and lining along straight lines. Here they are moved to where they can be: a tongue
inside the rows of teeth, or between them as far as they are apart, under the palate, and between the lips;
the lining of lips and cheeks before the rows of teeth, which are rigid, so that how far each reaches is known
at rest.
"""

from functools import lru_cache
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, Index
from realizer.face.mesh_geometry import part_triangles, vertex_normals
from realizer.face.model import Face

STATIONS = 25  # directions around the arch, from the right over the front to the left
HALF = 0.14  # rad; a station sees the teeth up to so far beside it
CROWN = 0.0065  # m from the biting edge; the thickness of the teeth is measured down to there
STEEP = 4.0  # metres up (down) from a biting edge for each metre inwards: the teeth's inner sides,
GENTLE = 0.8  # and for each metre outwards, or in front of the lips
DEEP = 0.014, 0.030  # m above the upper edge that the palate, and below the lower one that the floor is
THIN = 0.0012  # m; the tongue does not go between teeth or lips that are closer
NARROW = 0.55  # of the mouth's half width that a tongue takes between the lips
PASSES = 7.0  # metres beyond them for each metre that they are further apart
APART = 0.0006  # m between tongue and teeth
NEAR = 0.003  # m
FAR = 0.010  # m behind the lips, which leave all the room that there is from there back
SOFT = 0.0028  # m more between tongue and lips, which bulge between their points
LIP, RED = 0.004, 0.008  # m behind and before the line where the lips meet: their thickness
UPPER, LOWER = ("2.5", "2.7", "2.2", "2.6", "2.4"), ("2.5", "2.9", "2.3", "2.8", "2.4")


class TongueRoom:
    """Moves a face's tongue out of teeth, palate and lips."""

    def __init__(self, face: Face) -> None:
        at = face.vertices
        self._tongue = slice(*face.parts["tongue"])
        upper = np.arange(*face.parts["upper_teeth"])
        self._back = float(at[upper[np.abs(at[upper, 0]).argmax()], 2])
        rows = self._row(at, upper, -1), self._row(at, np.arange(*face.parts["lower_teeth"]), 1)
        self._edges, self._inner, self._outer = (np.array(each) for each in zip(*rows, strict=True))
        self._lips = np.array([[face.feature_points[name] for name in names] for names in (UPPER, LOWER)])
        tip = np.array([face.feature_points[name] for name in ("6.1", "6.2", "6.3", "6.4")])
        self._watched = np.concatenate([self._lips.ravel(), self._edges[1], tip])
        self._rest = at[self._watched]
        x, z = at[self._tongue, 0], at[self._tongue, 2]
        self._half = np.array([np.abs(x[np.abs(z - here) < NEAR]).max() for here in z], np.float32)
        # Where a tongue at rest is outside by itself, it may be as far outside while it is near its rest.
        home = at[self._tongue]
        out = home - self._inside(at[None], home[None])[0]
        self._loose = np.flatnonzero(np.abs(out).max(axis=1) > 1e-7)
        self._out, self._home = out[self._loose], home[self._loose]

    def __call__(self, out: Float32) -> None:
        """Move the tongue of deformed faces (n, n_vertices, 3) inside, before their heads turn, in place."""
        moved = np.abs(out[:, self._watched] - self._rest).max(axis=(1, 2)) > 1e-6
        frames = np.flatnonzero(moved)
        if len(frames):
            faces = out if len(frames) == len(out) else out[frames]
            tongue = faces[:, self._tongue].copy()
            away = np.linalg.norm(tongue[:, self._loose] - self._home, axis=2, keepdims=True)
            slack = self._out * np.maximum(1 - away / NEAR, 0)
            tongue[:, self._loose] -= slack
            inside = self._inside(faces, tongue)
            inside[:, self._loose] += slack
            out[frames, self._tongue] = inside

    def _row(self, at: Float32, part: Index, up: int) -> tuple[Index, Float32, Float32]:
        """Return the vertex of the biting edge at each station, and how far teeth reach beside it."""
        around, turn = self._polar(at[part, 0], at[part, 2])
        edge, inner, outer = [], [], []
        for station in np.linspace(-np.pi / 2, np.pi / 2, STATIONS):
            beside = np.abs(turn - station)
            near = np.flatnonzero(beside < max(HALF, float(beside.min()) + 1e-6))
            crest = near[(at[part[near], 1] * up).argmax()]
            tooth = near[np.abs(at[part[near], 1] - at[part[crest], 1]) < CROWN]
            edge.append(part[crest])
            inner.append(around[crest] - around[tooth].min())
            outer.append(around[tooth].max() - around[crest])
        # Thick teeth count for their neighbours too.
        thick = [np.pad(np.array(row, np.float32), 1, mode="edge") for row in (inner, outer)]
        inner, outer = (np.max([row[:-2], row[1:-1], row[2:]], axis=0) for row in thick)
        return np.array(edge), inner, outer

    def _polar(self, x: Any, z: Any) -> tuple[Any, Any]:
        """Return distance and direction from the middle of the arch; behind it only x counts."""
        ahead = np.maximum(z - self._back, 0)
        return np.sqrt(x * x + ahead * ahead), np.arctan2(x, ahead)

    def _inside(self, faces: Float32, tongue: Float32) -> Float32:
        """Return the tongue (n, m, 3) inside the room of its face (n, n_vertices, 3)."""
        x, y, z = (np.ascontiguousarray(column) for column in tongue.transpose(2, 0, 1))
        lips = faces[:, self._lips]
        # Far behind the lips only the teeth are in the way.
        near = np.flatnonzero(z.max(axis=1) > lips[:, :, 1:-1, 2].min(axis=(1, 2)) - LIP - FAR)
        if len(near):
            x[near], z[near], meet, *lines = self._between_lips(lips[near], x[near], z[near])
        around, turn = self._polar(x, z)
        upper, lower = self._teeth(faces, turn)
        gap = np.maximum(upper[2] - lower[2] - THIN, 0)
        reach = np.minimum(upper[0], lower[0]) - APART + PASSES * gap
        share = np.minimum(reach / np.maximum(around, 1e-6), 1)
        x, z, around = x * share, np.minimum(z, self._back + (z - self._back) * share), around * share
        bounds = []
        for (inner, outer, edge), deep, up in zip((upper, lower), DEEP, (1, -1), strict=True):
            vault = deep * np.tanh((STEEP / deep) * np.maximum(inner - around, 0))
            bound = up * edge + vault + GENTLE * np.maximum(around - outer, 0)
            if len(near):
                # The lips leave more room behind them and well before them.
                free = STEEP * np.maximum(meet - LIP - z[near], 0)
                free += GENTLE * np.maximum(z[near] - meet - RED, 0)
                bound[near] = np.minimum(bound[near], up * lines[up < 0] + free - SOFT)
            bounds.append(up * (bound - APART))
        high, low = bounds
        middle = (high + low) / 2
        y = np.clip(y, np.minimum(low, middle), np.maximum(high, middle))
        return np.stack([x, y, z], axis=-1)

    def _between_lips(self, lips: Float32, x: Any, z: Any) -> tuple[Any, Any, Any, Any, Any]:
        """Return x and z (n, m) narrowed to the lips (n, 2, 5, 3), where these meet, and their heights."""
        wide = NARROW * np.abs(lips[:, 0, [0, -1], 0]).min(axis=1)[:, None]
        wide = wide + np.maximum(lips[:, 0, 2, 2][:, None] - LIP - z, 0)
        x = np.clip(x * np.minimum(wide / self._half, 1), -wide, wide)
        (upper, upper_z), (lower, lower_z) = (_along(lips[:, k], x) for k in (0, 1))
        meet = np.minimum(upper_z, lower_z)
        z = np.minimum(z, meet - LIP + PASSES * np.maximum(upper - lower - THIN, 0))
        return x, z, meet, upper, lower

    def _teeth(self, faces: Float32, turn: Any) -> Any:
        """Return the edges of the upper and lower teeth in directions (n, m): (2, 3, n, m).

        Each is inner and outer distance and height.
        """
        at = faces[:, self._edges]
        around = self._polar(at[..., 0], at[..., 2])[0]
        rows = np.stack([around - self._inner, around + self._outer, at[..., 1]])
        steps = np.diff(rows, axis=3, append=rows[..., -1:])
        place = (turn / np.pi + 0.5) * (STATIONS - 1)
        first = place.astype(np.intp)
        share = (place - first).astype(np.float32)
        first += np.arange(len(faces))[:, None] * STATIONS
        # "clip" is the quickest mode; no index is out of range
        start, step = (
            np.take(values.transpose(2, 0, 1, 3).reshape(6, -1), first, axis=1, mode="clip")
            for values in (rows, steps)
        )
        return (start + share * step).reshape(2, 3, *turn.shape)


def _along(line: Float32, x: Any) -> tuple[Any, Any]:
    """Return y and z (n, m) of polylines (n, k, 3), whose x ascends, at x (n, m)."""
    y, z = line[:, :1, 1], line[:, :1, 2]
    for k in range(line.shape[1] - 1):
        a, b = line[:, k, None], line[:, k + 1, None]
        span = np.clip((x - a[..., 0]) / np.maximum(b[..., 0] - a[..., 0], 1e-6), 0, 1)
        y, z = y + span * (b[..., 1] - a[..., 1]), z + span * (b[..., 2] - a[..., 2])
    return y, z


ROWS = "upper_teeth", "lower_teeth"
TURNS, STEP = 48, 0.00075  # cells of a table around the arch, and m of its cells up and down
CELL = 4  # points each way on a triangle that is entered in a table
LINING_APART = 0.0005  # m between teeth and lining, which is drawn rounder than it is deformed
LINING_DEEP, LINING_FAR = 0.002, 0.012  # m behind and before the teeth that lining is looked for at rest,
BEYOND = 0.006  # and above and below them
FACING = 0.7  # greatest cosine between normals of lining and the way outwards
SLOPE = 2.0  # metres inwards for each metre beyond the edges of a row
SQUEEZE = 0.0004  # m; lining is squeezed before it touches: what lay farther out stays farther out


class LipRoom:
    """Moves the lining of lips and cheeks out of a row of teeth.

    How far the teeth reach outwards is known by direction and height.
    """

    def __init__(self, face: Face, name: str) -> None:
        at, (first, last) = face.vertices.astype(np.float64), face.parts[name]
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
        found = (around > need - LINING_DEEP) & (around < need + LINING_FAR) & (skin[:, 2] > mine[:, 2].min())
        found &= (skin[:, 1] > self._low - BEYOND) & (skin[:, 1] < mine[:, 1].max() + BEYOND)
        found &= (way * ups[:, [0, 2]]).sum(axis=1) < FACING
        self._lining = np.flatnonzero(found) + first
        self._home = face.vertices[self._lining]
        # At rest nothing moves, not even what lies among the roots of gums.
        need, around, _ = self._need(at[self._lining])
        self._loose = _squeezed(need - around).astype(np.float32)

    def __call__(self, out: Float32) -> None:
        """Move the lining of deformed faces (n, n_vertices, 3) out, before their heads turn, in place."""
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
        need = first + f * (second - first) + LINING_APART - slope * STEP * np.abs(height - inside)
        ahead = np.maximum(at[..., 2] - self._back, 0)
        return need, around, np.stack([at[..., 0], ahead], axis=-1) / np.maximum(around, 1e-6)[..., None]


def _squeezed(inside: Any) -> Any:
    """Return how far to move what is that far inside, metres: a smooth step from nothing to all of it."""
    return SQUEEZE * np.logaddexp(0, inside / SQUEEZE)


@lru_cache(maxsize=8)
def rooms(face: Face) -> tuple[LipRoom | TongueRoom, ...]:
    """Return the rooms of a face's lips and tongue; none of what the face lacks, or if it lacks teeth."""
    if not set(ROWS) <= set(face.parts):
        return ()
    lips = tuple(LipRoom(face, name) for name in ROWS)
    return (*lips, TongueRoom(face)) if "tongue" in face.parts else lips
