"""The deformer by action units: displacements of vertices, and the rotation of the jaw."""

from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from realizer.core.array_types import Bool, Float32, Float64
from realizer.face.au.model import Model, rotation
from realizer.face.au.regions import attached_parts, shares, skin
from realizer.face.au.successive_mixer import MIN_MOVE, SuccessiveMixer
from realizer.face.au.units import units
from realizer.face.basis import FAPS, JAW_SIN
from realizer.face.model import Face
from realizer.tables import action_units, faps

# The units that open the mouth, the widest first. Each holds the narrower ones.
OPENING = (27, 26, 25)
JAW = ("lower_teeth", "tongue")
CLOSE = 43  # the unit that closes the eyes
LIDS = (5, 6, 7, 9, CLOSE)  # what moves the lids
# FAPs of each side's lids; and the presence that says how far speech has the lips.
LID_FAPS, LIPS = {"L": (19, 21), "R": (20, 22)}, "lips"
SUCCESSIVE, RANK = "successive", "rank "
LID_POINTS = {"L": ("3.1", "3.3"), "R": ("3.2", "3.4")}


def columns(model: Model) -> tuple[str, ...]:
    """Return the columns of a pose beside the FAPs: units by side, lips, mixing order.

    "1L", "1R", ... "17", ...; units that differ in time alone (blink and wink are closed eyes) have columns
    of their own, the strongest shows. "lips" is how far speech has the lips: FAPs move them then.
    "successive" is how far units follow one another, 0 where they are added up; they do by "rank 1",
    "rank 2", ..., the highest first; units of one rank are applied by number.
    """
    names = (name for _, names in _units(model) for name in names)
    return (*names, LIPS, SUCCESSIVE, *(f"{RANK}{au}" for au in _orderly(model)))


def _orderly(model: Model) -> list[int]:
    """Return the units that can follow one another in any order; closed eyes come after all others."""
    return [au for au in sorted(model.units) if au != CLOSE]


def _units(model: Model) -> list[tuple[tuple[int, str], tuple[str, ...]]]:
    """Return (unit, side) -> the names of the columns that show it, ascending."""
    return [
        ((au, side), tuple(f"{name}{side}" for name in units()[au].names))
        for number in sorted(model.units)
        for au, side in side_names(number)
    ]


def side_names(au: int) -> list[tuple[int, str]]:
    """Return (unit, "L") and (unit, "R"), or (unit, "") for one that has no sides."""
    sided = any(row.sides for row in action_units() if row.au == au)
    return [(au, side) for side in (("L", "R") if sided else ("",))]


class Moves:
    """The displacements of a face's model as matrices, made once.

    Displacement units are mixed additively, each at the neutral place, or successively if a pose says so
    (Wojdel 2005, 5.1). There are two exceptions, which both mixers would get wrong: jaw and lips open as far
    as the widest of 25, 26 and 27 (`limit_opening`), and a unit that closes the eyes takes the lids from all
    others.

    Attributes:
        moving: the vertices that units move.
        lips: the column of a pose, behind its FAPs, that says how far speech has the lips.
        mixing: the columns that say how units are mixed: "successive" and the ranks.
    """

    def __init__(self, face: Face, model: Model) -> None:
        from scipy.sparse import csr_matrix

        self._face, self._model = face, model
        known = _units(model)
        places = {name: k for k, name in enumerate(columns(model))}
        self._read = [[places[name] for name in names] for _, names in known]
        names = [name for name, _ in known]
        self.lips, self.mixing = places[LIPS], slice(places[SUCCESSIVE], len(places))
        self._aus = [
            (au, *(names.index((au, side)) for side in (("L", "R") if (au, "L") in names else ("", ""))))
            for au in _orderly(model)
        ]
        moves = displacements(face, model, names)
        found = np.flatnonzero(moves.any(axis=(0, 2)))
        first, last = (int(found[0]), int(found[-1]) + 1) if len(found) else (0, 0)
        self.moving = slice(first, last)

        def matrix(rows: Float64) -> Any:
            return csr_matrix(rows[:, self.moving].reshape(len(rows), -1).T.astype(np.float32))

        closes = np.array([au == CLOSE for au, _ in names])
        self._closing, self._rest = np.flatnonzero(closes), np.flatnonzero(~closes)
        self._close, self._move = matrix(moves[closes]), matrix(moves[~closes])
        self._sides = np.array(["LR".index(side) for au, side in names if au == CLOSE], np.intp)
        self._lid_columns = np.array([au in LIDS for au, _ in names], bool)
        self._opening = [names.index((au, "")) for au in OPENING if (au, "") in names]
        self._gaps = np.array([model.gap(au) for au in OPENING if (au, "") in names])
        self._jaw = np.array([np.radians(model.units[au].jaw_degrees) for au, _ in names], np.float32)
        strong = {row.au: row.strength for row in action_units()}
        self._strengths = np.array([strong[au] for au, _ in names], np.float32)
        self._lids, self._owned = _shares(face, self.moving)

    def intensities(self, pose: Float32) -> Float32:
        """Return intensities (n, units) of the part of poses that follows the FAPs, opening limited.

        Full intensity is `ActionUnit.strength`, because some units were measured at mild intensity.
        """
        shown = np.stack([pose[:, read].max(axis=1) for read in self._read], axis=1) * self._strengths
        shown[:, self._opening] = limit_opening(self._gaps, shown[:, self._opening].T).T
        return shown

    def closed(self, shown: Float32) -> Float32:
        """Return how far the left and the right eye are closed, (n, 2)."""
        out = np.zeros((len(shown), 2), np.float32)
        out[:, self._sides] = np.minimum(shown[:, self._closing], 1)
        return out

    def lids(self, shown: Float32) -> Bool:
        """Return whether a unit moves the lids, (n,)."""
        return np.asarray(shown[:, self._lid_columns].any(axis=1))

    def __call__(self, shown: Float32, lips: Float32, mixing: Float32, vertices: Float32) -> None:
        """Move vertices in place.

        Args:
            shown: (n, units) intensities.
            lips, mixing: (n,) and (n, k), those columns of poses.
            vertices: (n, n_vertices, 3).
        """
        if not shown.any():
            return
        moves = (self._move @ np.ascontiguousarray(shown[:, self._rest].T)).T.reshape(len(shown), -1, 3)
        for k in np.flatnonzero(mixing[:, 0]):
            moves[k] += mixing[k, 0] * (self._succeeding(shown[k], mixing[k, 1:]) - moves[k])
        closed = self.closed(shown)
        if closed.any():
            index, share = self._lids
            moves[:, index] *= (1 - np.minimum(closed @ share, 1))[..., None]
            moves += (self._close @ np.ascontiguousarray(shown[:, self._closing].T)).T.reshape(moves.shape)
        if lips.any():
            index, owned = self._owned
            moves[:, index] *= (1 - np.outer(lips, owned))[..., None]
        vertices[:, self.moving] += moves
        for angle, frame in zip((shown @ self._jaw) * (1 - lips), vertices, strict=True):
            if angle:
                self._turn_jaw(float(angle), frame)

    def _succeeding(self, shown: Float32, ranks: Float32) -> Float32:
        """Return what units move one after the other, (n_moving, 3), by rank, without closed eyes."""
        values = {}
        for k in np.argsort(-ranks, kind="stable"):
            au, left, right = self._aus[k]
            if shown[left] or shown[right]:
                values[au] = float(shown[left]), float(shown[right])
        return self._successive_mixer(values)[self.moving].astype(np.float32)

    @cached_property
    def _successive_mixer(self) -> SuccessiveMixer:
        return SuccessiveMixer(self._face, self._model)

    def _turn_jaw(self, angle: float, vertices: Float32) -> None:
        """Turn the jaw; teeth and tongue follow it (an object's own rotation comes first)."""
        centre = np.array(self._model.jaw, np.float32)
        turn = rotation((1, 0, 0), angle).T.astype(np.float32)
        for part in JAW:
            if part in self._face.parts:
                mine = slice(*self._face.parts[part])
                vertices[mine] = (vertices[mine] - centre) @ turn + centre


@lru_cache(maxsize=16)
def moves_of(face: Face) -> Moves | None:
    """Return the model's movement of a face beside the FAPs, or None if FAPs move all of it."""
    return None if face.model is None else Moves(face, face.model)


def displacements(face: Face, model: Model, names: list[tuple[int, str]]) -> Float64:
    """Return the displacements by units and sides (`side_names`), (names, n_vertices, 3) metres.

    Lids that close meet: see `_meeting`. `ActionUnit.strength` is not in them.
    """
    at = face.vertices.astype(np.float64)
    mine = skin(face)
    upper = shares(face, model.mouth)
    moves = np.zeros((len(names), *at.shape))
    for row, (au, side) in zip(moves, names, strict=True):
        row[mine] = model.displacement(au, at[mine], side, upper[mine])
    # Brows and lashes go with the skin that they grow on: off it, functions of the place differ.
    for first, last, corners, share in attached_parts(face):
        moves[:, first:last] = np.einsum("nk,ankc->anc", share, moves[:, corners])
    moves[np.abs(moves).max(axis=2) < MIN_MOVE] = 0
    for row, (au, side) in zip(moves, names, strict=True):
        if au == CLOSE:
            row *= _meeting(face, row, side)
    return moves


def _meeting(face: Face, moves: Float64, side: str) -> float:
    """Return factors for moves that close an eye, so that its lids meet and do not cross.

    A lid that hangs lower at rest than on the face that was measured has less far to go.
    """
    upper, lower = (face.feature_points[point] for point in LID_POINTS[side])
    gap = float(face.vertices[upper, 1] - face.vertices[lower, 1])
    closed = float(moves[lower, 1] - moves[upper, 1])
    return min(1.0, gap / closed) if closed > MIN_MOVE else 1.0


def _shares(face: Face, moving: slice) -> tuple[tuple[Any, Float32], tuple[Any, Float32]]:
    """Return vertices of the lids and their shares, (k,) and (2, k), and those of speech, (k,) and (k,).

    Which vertices FAPs of the lids and of the mouth move says where lids and mouth are: each with the part of
    the way that its feature point goes.
    """
    fields, (first, last) = face.basis["fields"], face.basis["moving"]
    reach = np.zeros((FAPS, len(face.vertices)))
    for row in faps():
        # The jaw is driven by its angle.
        column = np.asarray(fields[:, [JAW_SIN if row.fap == 3 else row.fap - 1]].todense())
        size = np.linalg.norm(column.reshape(-1, 3), axis=1)
        reach[row.fap - 1, first:last] = size / max(float(size.max()), 1e-12)
    reach = reach[:, moving]
    lids = np.stack([np.minimum(reach[[fap - 1 for fap in LID_FAPS[side]]].sum(axis=0), 1) for side in "LR"])
    own = np.array([row.speech_owns for row in faps()])
    whole = reach[own > 0].sum(axis=0)
    owned = np.minimum(whole, 1) * (own @ reach) / np.maximum(whole, 1e-12)
    near, lips = np.flatnonzero(lids.any(axis=0)), np.flatnonzero(owned)
    return (near, lids[:, near].astype(np.float32)), (lips, owned[lips].astype(np.float32))


def limit_opening(gaps: Any, values: Any) -> Any:
    """Return the share of each unit at which the mouth opens as far as the widest one alone opens it.

    A stretched mouth is a dropped jaw and parted lips already (27@26, 27@25, 26@25 in her appendix C): added
    up they would open it twice.

    Args:
        gaps: (k,) metres between the lips with full intensity (`Model.gap`), of `OPENING`.
        values: (k, n) intensities 0..1.

    Returns:
        (k, n) intensities, of the same type.
    """
    out, open_ = np.array(values), np.zeros(values.shape[1:], np.float64)
    for row, gap, value in zip(out, gaps, values, strict=True):
        if gap > 0:
            row[...] = np.maximum(value - open_ / gap, 0)
            open_ = np.maximum(open_, gap * value)
    return out
