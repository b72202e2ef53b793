"""The action units of the head in the tab Face: markers, and models fitted to edited markers."""

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
from realizer.face.au.file import read_model
from realizer.face.au.model import Model
from realizer.face.au.regions import fit_mouth, shares
from realizer.face.au.units import units
from realizer.face.deform import deform
from realizer.face.fap_mapping import mapping_of
from realizer.face.load import MODEL
from realizer.face.model import Face
from realizer.tables import action_units
from realizer_studio.faces.au.fit_limits import runaways
from realizer_studio.faces.au.measure import COLLAR, OPEN, UnitMeasurement, read_shapes, write_shapes
from realizer_studio.faces.au.model_file import write_model
from realizer_studio.faces.au.unit_fit import FORMS, MOVES, fit_models, table, table_text

SHAPES = "au_shapes.npz"
FILES = ("au_published.toml", MODEL, SHAPES, "au_to_fap.csv", "au_to_fap.txt")  # of a face's action units
MARKERS, FEWEST, MOST = 24, 8, 200  # markers of an unedited unit; least and most of any unit
MOVED = 0.08  # of d_max; least displacement of a marker's point
REACH = 0.02  # m around a marker in which measured points follow it, as in units.js
PIN = 1.0 / REACH**2
FAR = 0.06  # m; largest displacement of a marker

Markers = Sequence[Sequence[float]]


class UnitFits:
    """The action units of one head.

    Markers are rows of six numbers in metres: a point on the left half of the neutral face, and its
    displacement at full intensity. They correct the measurement, which is from the face's shapes or,
    without shapes, from the unit's FAPs.

    Args:
        folder: of the face; face: loaded from it, with the deformer of FAPs.
    """

    def __init__(self, folder: Path, face: Face) -> None:
        self._folder, self._face = folder, face
        self._fits: dict[str, dict[str, Model]] = {}
        path = folder / SHAPES
        self._measured = read_shapes(path) if path.is_file() else {}
        self._model = read_model(folder / MODEL) if (folder / MODEL).is_file() else None

    def unit(self, au: Any, markers: Any = None) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return markers, errors and the field of an action unit, fitted to markers if given.

        Returns:
            the header of the answer; `field`: (n_vertices, 3) float32 metres at full intensity.

        Raises:
            FaceError: no such displacement unit, or invalid markers.
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
        sample = _sample(one) if markers is None else np.array(markers)
        header = {
            "au": au,
            "markers": (sample * np.r_[1, 1, 1, [1 if markers else strength] * 3]).round(6).tolist(),
            "errors": {key: round(getattr(row, key), 7) for key in ("n", "d", "d_max", "e", "e_max")},
            "table": table_text((row,)),
            "jaw": [*model.jaw, math.radians(model.units[au].jaw_degrees) * strength],
            "lids": au in LIDS,
        }
        return header, {"field": field.astype(np.float32)}

    def fitted(self, au: int, markers: Markers | None) -> dict[str, Model]:
        """Return the models of a unit by file; fits are cached.

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
        edited_measurements = {int(au): self._measurement(int(au), markers) for au, markers in edited.items()}
        write_shapes(folder / SHAPES, dict(sorted((self._measured | edited_measurements).items())))

    def _measurement(self, au: int, markers: Markers | None = None) -> UnitMeasurement:
        if au not in self._measured:
            self._measured[au] = _by_faps(self._face, self._folder, au, *self._skin)
        one = self._measured[au]
        if markers is None:
            return one
        return replace(one, moves=one.moves + _correction(one, _checked(au, markers)))

    @cached_property
    def _skin(self) -> tuple[Any, Float64]:
        """The vertices of the left half of the skin, and their shares in the upper half."""
        first, last = self._face.parts["skin"]
        at = self._face.vertices[first:last]
        vertices = np.flatnonzero((at[:, 0] > -1e-6) & (at[:, 1] > COLLAR)) + first
        return vertices, shares(self._face, fit_mouth(self._face))[vertices]


def _number(au: Any) -> int:
    """Return the number of a displacement unit, checked."""
    numbers = {str(unit.au): unit.au for unit in units().values() if unit.kind == "displacement"}
    if str(au) not in numbers:
        raise FaceError(f"au: wanted one of {', '.join(numbers)}, got {str(au)[:40]!r}")
    return numbers[str(au)]


def _strength(au: int) -> float:
    return next(row.strength for row in action_units() if row.au == au)


def _by_faps(face: Face, folder: Path, au: int, vertices: Any, upper: Float64) -> UnitMeasurement:
    """Return the measurement of a unit's displacement by its FAPs, for a face without a shape of it."""
    values = np.zeros((1, len(axis())), np.float32)
    for one, side in side_names(au):
        values[0, axis()[f"{one}{side}"].column] = 1
    faps = to_fap(AUFrames(np.zeros(1), values), mapping_of(str(folder))).values
    moves = (deform(face, faps)[0] - face.vertices)[vertices].astype(np.float64) / _strength(au)
    if np.abs(moves).max() < 1e-5:
        raise FaceError(
            f"AU{au}: wanted FAPs that move the skin, as this face has no shape of the unit; got none"
        )
    at = face.vertices[vertices].astype(np.float64)
    return UnitMeasurement(au, at, moves, face.occlusion[vertices] > OPEN, upper)


def _sample(one: UnitMeasurement) -> Float64:
    """Return markers (n, 6), spread over the visible points that move."""
    lengths = np.linalg.norm(one.moves, axis=1)
    size = float(lengths[one.visible].max(initial=0))
    free = np.flatnonzero(one.visible & (lengths > MOVED * size))
    if len(free) < FEWEST:
        free = np.flatnonzero(one.visible & (lengths > MOVES * size))
    chosen = [int(free[np.argmax(lengths[free])])]
    distance = np.full(len(free), np.inf)
    while len(chosen) < min(MARKERS, len(free)):
        distance = np.minimum(distance, np.linalg.norm(one.at[free] - one.at[chosen[-1]], axis=1))
        chosen.append(int(free[np.argmax(distance)]))
    return np.concatenate([one.at[chosen], one.moves[chosen]], axis=1)


def _correction(one: UnitMeasurement, markers: Float64) -> Float64:
    """Return the corrections (n, 3) by markers: complete at a marker, falling with distance."""
    strength = _strength(one.au)
    weight, total = np.full(len(one.at), PIN), np.zeros(one.at.shape)
    for row in markers:
        distance = np.linalg.norm(one.at - row[:3], axis=1)
        share = (np.maximum(REACH - distance, 0) / (REACH * np.maximum(distance, 1e-6))) ** 2
        change = row[3:] / strength - one.moves[int(np.argmin(distance))]
        weight += share
        total += share[:, None] * np.where(np.abs(change) < 2e-6, 0, change)
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
