"""The text file (TOML) of a fitted model."""

from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.core.errors import FaceError
from realizer.face.au.functions import ANGLE, GAUSSIAN, LOWER
from realizer.face.au.model import HeadTurn, Model, Motion, Mouth, UnitModel
from realizer.face.au.units import units
from realizer.face.reading import face_errors
from realizer.tables import read_toml

ANGLES = {"A1": slice(0, 6), "A2": slice(6, 9), "A3": slice(9, 15), "A4": slice(15, 18), "c": slice(18, 19)}
ORDER = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def read_model(path: Path) -> Model:
    """Read a model.

    Raises:
        FaceError: no such file, not TOML, or a value that is missing, of the wrong kind or not finite.
    """
    with face_errors(path, "a model as `realizer faces fit` writes it"):
        text = path.read_text("utf-8")
        table = read_toml(text, str(path))
    head = {
        key: next(line.split(":", 1)[1].strip() for line in text.splitlines() if line.startswith(f"# {key}:"))
        for key in ("source", "licence")
    }
    at = _Reader(path)
    mouth, pivots, neck = (at.table(table, key) for key in ("mouth", "pivots", "neck"))
    x = at.numbers(mouth, "mouth.x", len(mouth.get("x", ())) or 2)
    y, z, slope = (at.numbers(mouth, f"mouth.{key}", len(x)) for key in ("y", "z", "slope"))
    if len(x) < 2 or (np.diff(x) <= 0).any():
        raise FaceError(f"{path}: mouth.x: wanted two or more ascending numbers, got {x.tolist()}")
    places = {key: at.place(pivots, f"pivots.{key}") for key in ("head", "left_eye", "right_eye", "jaw")}
    top, end, tilt = (float(at.numbers(neck, f"neck.{key}", 0)[0]) for key in ("top", "end", "tilt"))
    if top <= end:
        raise FaceError(f"{path}: neck: wanted top above end, got {top} and {end}")
    degrees = at.table(table, "degrees")
    return Model(
        form=str(table.get("form", "published")),
        source=head["source"],
        licence=head["licence"],
        mouth=Mouth(x, y, z, slope),
        head=HeadTurn(places["head"], top, end, tilt),
        eyes=(places["left_eye"], places["right_eye"]),
        jaw=places["jaw"],
        units={
            at.unit_number(key): _unit(at, key, at.table(table, key)) for key in table if key.startswith("AU")
        },
        degrees={at.unit_number(key): float(at.numbers(degrees, f"degrees.{key}", 0)[0]) for key in degrees},
    )


class _Reader:
    """Values of a table, checked; a fault names its place."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def table(self, within: Any, key: str) -> dict[str, Any]:
        found = within.get(key.rpartition(".")[2])
        if not isinstance(found, dict):
            raise FaceError(f"{self.path}: wanted a table [{key}], got {found!r}")
        return found

    def numbers(self, within: Any, key: str, count: int) -> Float64:
        """Return `count` numbers; a number without a list if `count` is 0."""
        found = within.get(key.rpartition(".")[2])
        what = f"a list of {count} numbers" if count else "a number"
        try:
            values = np.array(found if count else [found], np.float64)
        except (TypeError, ValueError, OverflowError):
            values = np.zeros(0)
        if values.shape != (max(count, 1),) or not np.isfinite(values).all():
            raise FaceError(f"{self.path}: {key}: wanted {what}, got {found!r}")
        return values

    def place(self, within: Any, key: str) -> tuple[float, float, float]:
        x, y, z = self.numbers(within, key, 3).tolist()
        return x, y, z

    def unit_number(self, key: str) -> int:
        if not key.removeprefix("AU").isdigit():
            raise FaceError(f"{self.path}: wanted an action unit such as AU12, got {key}")
        number = int(key.removeprefix("AU"))
        if number not in units():
            known = ", ".join(map(str, units()))
            raise FaceError(
                f"{self.path}: [AU{number}]: there is no such unit in the model; wanted one of {known}"
            )
        return number


def _unit(at: _Reader, key: str, table: dict[str, Any]) -> UnitModel:
    halves = ("upper", "lower") if "upper" in table or "lower" in table else ("whole",)
    jaw = float(at.numbers(table, f"{key}.jaw_degrees", 0)[0]) if "jaw_degrees" in table else 0.0
    motions = {half: _motion(at, f"{key}.{half}", at.table(table, f"{key}.{half}")) for half in halves}
    return UnitModel(at.unit_number(key), motions, jaw)


def _motion(at: _Reader, key: str, table: dict[str, Any]) -> Motion:
    angles = []
    for name in ("alpha", "beta"):
        part = at.table(table, f"{key}.{name}")
        values = np.zeros(ANGLE)
        for letter, where in ANGLES.items():
            size = where.stop - where.start
            values[where] = at.numbers(part, f"{key}.{name}.{letter}", 0 if letter == "c" else size)
        angles.append(values)
    rows = table.get("gaussians")
    if not isinstance(rows, list) or not rows:
        raise FaceError(f"{at.path}: {key}.gaussians: wanted a list of one or more, got {rows!r}")
    gaussians = np.zeros((len(rows), GAUSSIAN))
    for k, row in enumerate(rows):
        place = f"{key}.gaussians[{k}]"
        if not isinstance(row, dict):
            raise FaceError(f"{at.path}: {place}: wanted {{ eta, m, B }}, got {row!r}")
        gaussians[k, 0] = at.numbers(row, f"{place}.eta", 0)[0]
        gaussians[k, 1:4] = at.numbers(row, f"{place}.m", 3)
        matrix = np.zeros((3, 3))
        for value, (i, j) in zip(at.numbers(row, f"{place}.B", 6), ORDER, strict=True):
            matrix[i, j] = matrix[j, i] = value
        lowest, ways = np.linalg.eigh(matrix)
        if lowest[0] < -1e-4 * max(float(lowest[-1]), 1e-9):
            raise FaceError(f"{at.path}: {place}.B: wanted a matrix whose Gaussian falls off, got {row['B']}")
        # Any square root is valid; the density uses the triangular one.
        root = np.linalg.qr((ways * np.sqrt(np.maximum(lowest, 0))).T)[1].T
        gaussians[k, 4:] = [root[place] for place in LOWER]
    return Motion(at.numbers(table, f"{key}.origin", 3), gaussians, angles[0], angles[1])
