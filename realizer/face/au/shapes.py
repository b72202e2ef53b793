"""The CC0 expression shapes of the data a face was built from, as measurements of her 22 displacements."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from realizer.errors import FaceError
from realizer.face import hm08
from realizer.face.au.measure import Measured
from realizer.face.au.mouth import fit_mouth, shares
from realizer.face.au.units import Unit, units
from realizer.face.lips import Lips
from realizer.face.model import Face
from realizer.face.person import person_of
from realizer.face.recipe import read_recipe

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

    data = hm08.data_folder(data)
    ground = person_of(data, read_recipe(folder / "recipe.toml", data).targets).ground
    mesh, at = ground.mesh, ground.at
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
    lips = Lips(ground)
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


def _sides(data: Path, name: str) -> tuple[str, ...]:
    whole = (data / "faceunits01/targets/faceunits" / f"{name}.target").is_file()
    return (name,) if whole else (f"{name}Left", f"{name}Right")
