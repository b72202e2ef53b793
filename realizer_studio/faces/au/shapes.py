"""Measurements of Wojdel's 22 displacements from the CC0 expression shapes of MakeHuman."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.core.errors import FaceError
from realizer.face.au.regions import fit_mouth, shares
from realizer.face.au.units import Unit, units
from realizer.face.mesh_geometry import (
    corner_shares,
    nearest_points,
    part_triangles,
    triangle_normals,
    vertex_normals,
)
from realizer.face.model import Face
from realizer_studio.faces.au.measure import COLLAR, OPEN, UnitMeasurement
from realizer_studio.faces.parts import Submesh
from realizer_studio.faces.person import makehuman
from realizer_studio.faces.person.lips import Lips
from realizer_studio.faces.person.makehuman import Ground
from realizer_studio.faces.person.person import person_of
from realizer_studio.faces.person.recipe import read_recipe
from realizer_studio.faces.photo.warp import read_warp

EVEN = np.array([-1.0, 1.0, 1.0])
OFF = 5e-4  # m; added and cut vertices lie no farther than this off the base mesh
AROUND = 32  # number of nearest triangles to look at


def measure_shapes(
    face: Face, folder: Path, data: Path, wanted: Iterable[Unit] | None = None
) -> dict[int, UnitMeasurement]:
    """Return the shape of each displacement unit on the left half (x >= 0) of a face's skin.

    Args:
        face: built from the data.
        folder: its folder; the recipe says how it was mixed.
        data: the unpacked CC0 data, as `face.build.build_face` takes it.
        wanted: the units, each with its mixture of shapes; None: her 22 displacements.

    Raises:
        FaceError: no recipe or data, or a skin that is not made from them.
    """
    data = makehuman.data_folder(data)
    targets = read_recipe(folder / "recipe.toml", data).targets
    ground = person_of(data, targets, read_warp(folder)).ground
    mesh, at = ground.mesh, ground.at
    twin = mesh.mirror()
    first, last = face.parts["skin"]
    skin = face.vertices[first:last].astype(np.float64)
    half = (skin[:, 0] > -1e-6) & (skin[:, 1] > COLLAR)
    corners, share, off = _on_base(ground, face, np.flatnonzero(half))
    if off.max() > OFF:
        raise FaceError(
            f"{folder}: wanted a skin made from its recipe and {data}, got one of which {(off > OFF).sum()} "
            f"of {len(off)} vertices lie off that, up to {1000 * off.max():.1f} mm: another builder made it; "
            f"build it again with realizer faces build {folder.name} --data"
        )
    skin = skin[half]
    mouth = Lips(ground)
    lips, lining = (np.einsum("nk,nk->n", share, part[corners]) for part in (mouth.lips, mouth.inside))
    # The mouth's lining is painted as light as an open mouth shows it.
    seen = (face.occlusion[first:last][half] > OPEN) & (lining < 0.5) | (lips > 0.5)
    upper = shares(face, fit_mouth(face))[first:last][half]
    out = {}
    for unit in units().values() if wanted is None else wanted:
        if unit.kind == "displacement":
            shape = np.zeros_like(at)
            for name, weight in unit.mixture.items():
                for side in _sides(data, name):
                    shape += weight * makehuman.read_target(data, side, len(at)) * makehuman.DECIMETRE
            shape = (shape + shape[twin] * EVEN) / 2
            moves = np.einsum("nk,nkc->nc", share, shape[corners])
            out[unit.au] = UnitMeasurement(unit.au, skin, moves, seen, upper)
    return out


def _on_base(ground: Ground, face: Face, index: Any) -> tuple[Int32, Float64, Float64]:
    """Return the position of skin vertices on the base mesh.

    Where lips or lids touch, a vertex belongs to the surface whose normal agrees with its own.

    Args:
        index: (n,) places in the skin.

    Returns:
        (n, 3) base vertices, (n, 3) their shares, and (n,) metres that each vertex is off.
    """
    from scipy.spatial import cKDTree

    first, last = face.parts["skin"]
    skin = face.vertices[first:last].astype(np.float64)
    mine = part_triangles(face.triangles, face.parts["skin"])
    ups, skin = vertex_normals(skin, mine)[index], skin[index]
    body = Submesh.of_quads(ground.mesh.quads["body"], len(ground.at))
    base = body.mix.indices[body.triangles]
    corners = ground.at[base]
    faces = triangle_normals(ground.at, base)
    near = np.asarray(cKDTree(corners.mean(axis=1)).query(skin, AROUND)[1])
    places = nearest_points(corners[near], skin)
    off = np.linalg.norm(places - skin[:, None], axis=2)
    same = np.einsum("nkc,nc->nk", faces[near], ups) > 0
    best = np.where(same, off, off + OFF).argmin(axis=1)
    each = np.arange(len(skin))
    hit = near[each, best]
    return base[hit].astype(np.int32), corner_shares(corners[hit], places[each, best]), off[each, best]


def _sides(data: Path, name: str) -> tuple[str, ...]:
    whole = (data / "faceunits01/targets/faceunits" / f"{name}.target").is_file()
    return (name,) if whole else (f"{name}Left", f"{name}Right")
