"""Measurements of action units: a CSV file of landmarks, or the face's own shapes."""

from collections.abc import Mapping
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.array_types import Bool, Float64
from realizer.core.errors import FaceError
from realizer.face.au.units import units
from realizer.face.reading import face_errors, read_arrays
from realizer.tables import read_csv

OPEN = 0.3  # baked light below which a vertex is inside the head, or on the inner side of a lip
COLLAR = -0.16  # m; below it faces do not move
FINE = 1e-5  # m; the resolution of stored shapes
ARRAYS = {"at": 2, "seen": 1, "upper": 1, "au": 1, "moves": 3}
FEWEST = 8  # landmarks of an action unit: fewer leave the functions undecided


@dataclass(frozen=True, eq=False)
class UnitMeasurement:
    """The measurement of an action unit with full intensity."""

    au: int  # its number
    at: Float64  # (n, 3) metres, the landmarks on the neutral face
    moves: Float64  # (n, 3) metres, their displacements
    visible: Bool  # (n,) visibility: hidden points count little in a fit, and not in its table
    # (n,) the share in the upper half of the face; None to compute it from the mouth's plane.
    upper: Float64 | None = None


@dataclass(frozen=True, slots=True)
class Landmark:
    """A row of a measurements file."""

    au: int
    x: float
    y: float
    z: float
    dx: float
    dy: float
    dz: float


def read_measurements(path: Path) -> dict[int, UnitMeasurement]:
    """Read measurements from a CSV file with a row au,x,y,z,dx,dy,dz (metres) per landmark and action unit.

    Landmarks of one side are enough (Wojdel 2005, 4.2.1), because action units are symmetric.

    Raises:
        FaceError: no such file, a bad row, a number that is not finite, a unit that is not one of Wojdel's
            displacements, or too few landmarks.
    """
    with face_errors(path, "a CSV file au,x,y,z,dx,dy,dz in metres"):
        rows = read_csv(path.read_text("utf-8"), Landmark, str(path))
    by_unit: dict[int, list[tuple[float, ...]]] = {}
    for row in rows:
        if row.au not in units() or units()[row.au].kind != "displacement":
            allowed = ", ".join(str(unit.au) for unit in units().values() if unit.kind == "displacement")
            raise FaceError(f"{path}: wanted action units of {allowed}, got {row.au}")
        by_unit.setdefault(row.au, []).append(astuple(row)[1:])
    found = {}
    for au, values in sorted(by_unit.items()):
        table = np.array(values, np.float64)
        if not np.isfinite(table).all():
            raise FaceError(f"{path}: AU{au}: wanted finite numbers, got NaN or infinity")
        if len(table) < FEWEST or not table[:, 3:].any():
            raise FaceError(
                f"{path}: AU{au}: wanted {FEWEST} landmarks or more of which one moves, got {len(table)}"
            )
        found[au] = UnitMeasurement(au, table[:, :3], table[:, 3:], np.ones(len(table), bool))
    return found


def read_shapes(path: Path) -> dict[int, UnitMeasurement]:
    """Read measurements from a face's shapes, as `write_shapes` stores them.

    Raises:
        FaceError: no such file, or arrays of inconsistent shapes.
    """
    stored = read_arrays(path, ARRAYS)
    at, moves = stored["at"].astype(np.float64), stored["moves"]
    if moves.shape != (len(stored["au"]), *at.shape) or {len(stored["seen"]), len(stored["upper"])} != {
        len(at)
    }:
        raise FaceError(
            f"{path}: wanted moves of {(len(stored['au']), *at.shape)}, got {moves.shape}; make it again"
        )
    visible, upper = stored["seen"].astype(bool), stored["upper"].astype(np.float64)
    return {
        int(au): UnitMeasurement(int(au), at, move.astype(np.float64) * FINE, visible, upper)
        for au, move in zip(stored["au"], moves, strict=True)
    }


def write_shapes(path: Path, measured: Mapping[int, UnitMeasurement]) -> None:
    """Store measurements that share their landmarks."""
    first = next(iter(measured.values()))
    if first.upper is None:
        raise ValueError("wanted shapes whose halves are known, got landmarks")
    arrays: dict[str, Any] = {
        "at": first.at.astype(np.float32),
        "seen": first.visible,
        "upper": np.asarray(first.upper, np.float32),
        "au": np.array(list(measured), np.int32),
        "moves": np.stack([np.rint(one.moves / FINE) for one in measured.values()]).astype(np.int16),
    }
    np.savez_compressed(path, **arrays)
