"""The action units of the head in the Face tab: markers, and models fitted to markers that were moved."""

import json
import math
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from realizer.animation.axis import axis
from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames
from realizer.core.array_types import Float64
from realizer.core.errors import FaceError
from realizer.face.au.deformer import LIDS, displacements, side_names
from realizer.face.au.file import read_model, write_model
from realizer.face.au.model import Model
from realizer.face.au.regions import fit_mouth, shares
from realizer.face.au.units import units
from realizer.face.deform import deform
from realizer.face.fap_mapping import mapping_of
from realizer.face.load import MODEL
from realizer.face.model import Face
from realizer.tables import action_units
from realizer_studio.faces.au.fit import FORMS, MOVES, fit_models, table, table_text
from realizer_studio.faces.au.fit_limits import runaways
from realizer_studio.faces.au.measure import COLLAR, OPEN, UnitMeasurement, read_shapes, write_shapes

SHAPES = "au_shapes.npz"
FILES = ("au_published.toml", MODEL, SHAPES, "au_to_fap.csv", "au_to_fap.txt")  # of a face's action units
MARKERS, FEWEST, MOST = 24, 8, 200  # markers: of a unit that was not edited; of any
MOVED = 0.08  # of d_max; markers begin where a unit moves more
REACH = 0.02  # m around a marker in which measured places follow it, as units.js
PIN = 1.0 / REACH**2
FAR = 0.06  # m; no marker goes further

Markers = Sequence[Sequence[float]]


class UnitFits:
    """The action units of one head.

    Markers are rows of six numbers in metres: a place on the left half of the neutral face, and how far it
    goes with full intensity. They correct what was measured: the face's own shapes, or, where it has none,
    what FAPs make of the unit.

    Args:
        folder: of the face; face: loaded from it, moved by FAPs alone.
    """

    def __init__(self, folder: Path, face: Face) -> None:
        self._folder, self._face = folder, face
        self._fits: dict[str, dict[str, Model]] = {}
        path = folder / SHAPES
        self._measured = read_shapes(path) if path.is_file() else {}
        self._model = read_model(folder / MODEL) if (folder / MODEL).is_file() else None

    def unit(self, au: Any, markers: Any = None) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return markers, errors and the field of an action unit, refitted to markers if there are any.

        Returns:
            the header of the answer; `field`: (n_vertices, 3) float32 metres with full intensity.

        Raises:
            FaceError: no such displacement unit, or markers that nothing can be fitted to.
        """
        au = _number(au)
        strength = _strength(au)
        if markers is None and self._model and au in self._model.units and au in self._measured:
            model, one = self._model, self._measurement(au)
        else:
            model, one = self.fitted(au, markers)[MODEL], self._measurement(au, markers)
        names = side_names(au)
        field = displacements(self._face, model, names).sum(axis=0) * strength
        row = table(model, {au: one})[0]
        shown = _sample(one) if markers is None else np.array(markers)
        header = {
            "au": au,
            "markers": (shown * np.r_[1, 1, 1, [1 if markers else strength] * 3]).round(6).tolist(),
            "errors": {key: round(getattr(row, key), 7) for key in ("n", "d", "d_max", "e", "e_max")},
            "table": table_text((row,)),
            "jaw": [*model.jaw, math.radians(model.units[au].jaw_degrees) * strength],
            "lids": au in LIDS,
        }
        return header, {"field": field.astype(np.float32)}

    def fitted(self, au: int, markers: Markers | None) -> dict[str, Model]:
        """Return models of the unit alone, file -> model; each fit is kept.

        Raises:
            FaceError: as `unit`, or the fit would tear the face.
        """
        key = json.dumps([au, markers])
        if key not in self._fits:
            one = self._measurement(au, markers)
            models = fit_models(self._face, {au: one})
            for model in models.values():
                if faults := runaways(self._face, model, {au: one}):
                    raise FaceError(f"nothing was changed, the fit tears the face: {faults[0]}")
            self._fits[key] = {f"au_{form}.toml": models[form] for form in FORMS}
        return self._fits[key]

    def write(self, folder: Path, edited: Mapping[str, Any]) -> None:
        """Write the files of the face's action units, with those of `edited` (unit -> markers)."""
        for file in FILES:
            if (self._folder / file).is_file():
                shutil.copy(self._folder / file, folder / file)
        if not edited:
            return
        chosen = {(au := _number(key)): self.fitted(au, markers) for key, markers in edited.items()}
        for file in FILES[:2]:
            new = {au: models[file] for au, models in chosen.items()}
            path = folder / file
            base = read_model(path) if path.is_file() else replace(next(iter(new.values())), units={})
            found = {**base.units, **{au: model.units[au] for au, model in new.items()}}
            write_model(path, replace(base, units=dict(sorted(found.items()))))
        mine = {int(au): self._measurement(int(au), markers) for au, markers in edited.items()}
        write_shapes(folder / SHAPES, dict(sorted((self._measured | mine).items())))

    def _measurement(self, au: int, markers: Markers | None = None) -> UnitMeasurement:
        if au not in self._measured:
            self._measured[au] = _by_faps(self._face, self._folder, au, *self._skin)
        one = self._measured[au]
        if markers is None:
            return one
        return replace(one, moves=one.moves + _correction(one, _checked(au, markers)))

    @cached_property
    def _skin(self) -> tuple[Any, Float64]:
        """Return the vertices of the left half of the skin, and the share of each in the upper half."""
        first, last = self._face.parts["skin"]
        at = self._face.vertices[first:last]
        mine = np.flatnonzero((at[:, 0] > -1e-6) & (at[:, 1] > COLLAR)) + first
        return mine, shares(self._face, fit_mouth(self._face))[mine]


def _number(au: Any) -> int:
    """Return the number of a displacement unit, checked."""
    known = {str(unit.au): unit.au for unit in units().values() if unit.kind == "displacement"}
    if str(au) not in known:
        raise FaceError(f"au: wanted one of {', '.join(known)}, got {str(au)[:40]!r}")
    return known[str(au)]


def _strength(au: int) -> float:
    return next(row.strength for row in action_units() if row.au == au)


def _by_faps(face: Face, folder: Path, au: int, mine: Any, upper: Float64) -> UnitMeasurement:
    """Return what the FAPs of a unit move, as the face has no shape of it."""
    values = np.zeros((1, len(axis())), np.float32)
    for one, side in side_names(au):
        values[0, axis()[f"{one}{side}"].column] = 1
    faps = to_fap(AUFrames(np.zeros(1), values), mapping_of(str(folder))).values
    moves = (deform(face, faps)[0] - face.vertices)[mine].astype(np.float64) / _strength(au)
    if np.abs(moves).max() < 1e-5:
        raise FaceError(
            f"AU{au}: wanted FAPs that move the skin, as this face has no shape of the unit; got none"
        )
    at = face.vertices[mine].astype(np.float64)
    return UnitMeasurement(au, at, moves, face.occlusion[mine] > OPEN, upper)


def _sample(one: UnitMeasurement) -> Float64:
    """Return markers (n, 6), far from each other, on the places that one sees move."""
    long = np.linalg.norm(one.moves, axis=1)
    size = float(long[one.visible].max(initial=0))
    free = np.flatnonzero(one.visible & (long > MOVED * size))
    if len(free) < FEWEST:
        free = np.flatnonzero(one.visible & (long > MOVES * size))
    chosen = [int(free[np.argmax(long[free])])]
    away = np.full(len(free), np.inf)
    while len(chosen) < min(MARKERS, len(free)):
        away = np.minimum(away, np.linalg.norm(one.at[free] - one.at[chosen[-1]], axis=1))
        chosen.append(int(free[np.argmax(away)]))
    return np.concatenate([one.at[chosen], one.moves[chosen]], axis=1)


def _correction(one: UnitMeasurement, markers: Float64) -> Float64:
    """Return how far markers change measured moves (n, 3): by distance, all of it at the marker itself."""
    strength = _strength(one.au)
    weight, total = np.full(len(one.at), PIN), np.zeros(one.at.shape)
    for row in markers:
        away = np.linalg.norm(one.at - row[:3], axis=1)
        mine = (np.maximum(REACH - away, 0) / (REACH * np.maximum(away, 1e-6))) ** 2
        change = row[3:] / strength - one.moves[int(np.argmin(away))]
        weight += mine
        total += mine[:, None] * np.where(np.abs(change) < 2e-6, 0, change)
    return np.asarray(total / weight[:, None])


def _checked(au: int, markers: Any) -> Float64:
    try:
        rows = np.array(markers, np.float64)
    except (TypeError, ValueError):
        rows = np.zeros(0)
    if rows.ndim != 2 or rows.shape[1] != 6 or not FEWEST <= len(rows) <= MOST or not np.isfinite(rows).all():
        raise FaceError(f"AU{au}: wanted {FEWEST} to {MOST} markers of six numbers, got {str(markers)[:60]}")
    far = np.linalg.norm(rows[:, 3:], axis=1)
    if far.max() > FAR or not far.any():
        k = int(far.argmax())
        raise FaceError(
            f"AU{au}: wanted markers of which one moves, none further than {1000 * FAR:.0f} mm; "
            f"marker {k + 1} moves {1000 * far[k]:.1f} mm"
        )
    return rows
