"""Measurements of Wojdel's 22 displacements from the CC0 expression shapes of MakeHuman."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

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
from realizer_studio.faces.person.makehuman import Figure
from realizer_studio.faces.person.person import person_of
from realizer_studio.faces.person.recipe import read_recipe
from realizer_studio.faces.photo.warp import read_warp

EVEN = np.array([-1.0, 1.0, 1.0])
MAX_DISTANCE = 5e-4  # m; the largest distance of added and cut vertices from the base mesh
AROUND = 32  # nearest triangles that are examined


def measure_shapes(
    face: Face, folder: Path, data: Path, requested: Iterable[Unit] | None = None
) -> dict[int, UnitMeasurement]:
    """Return the shape of each displacement unit on the left half (x >= 0) of a face's skin.

    Args:
        face: built from the data.
        folder: its folder, with its recipe.
        data: the unpacked CC0 data, as for `build_face`.
        requested: the units, each with its mixture of shapes; None for Wojdel's 22 displacements.

    Raises:
        FaceError: no recipe or data, or a skin that was not built from them.
    """
    data = makehuman.data_folder(data)
    targets = read_recipe(folder / "recipe.toml", data).targets
    figure = person_of(data, targets, read_warp(folder)).figure
    mesh, at = figure.mesh, figure.at
    twin = mesh.mirror()
    first, last = face.parts["skin"]
    skin = face.vertices[first:last].astype(np.float64)
    half = (skin[:, 0] > -1e-6) & (skin[:, 1] > COLLAR)
    corners, share, distance = _on_base(figure, face, np.flatnonzero(half))
    if distance.max() > MAX_DISTANCE:
        raise FaceError(
            f"{folder}: wanted a skin made from its recipe and {data}, got one of which "
            f"{(distance > MAX_DISTANCE).sum()} of {len(distance)} vertices lie off that, up to "
            f"{1000 * distance.max():.1f} mm: another builder made it; build it again with realizer faces "
            f"build {folder.name} --data"
        )
    skin = skin[half]
    mouth = Lips(figure)
    lips, lining = (np.einsum("nk,nk->n", share, part[corners]) for part in (mouth.lips, mouth.inside))
    # The lining of the mouth has the light of an open mouth, so it is excluded by its position.
    visible = (face.occlusion[first:last][half] > OPEN) & (lining < 0.5) | (lips > 0.5)
    upper = shares(face, fit_mouth(face))[first:last][half]
    out = {}
    for unit in units().values() if requested is None else requested:
        if unit.kind == "displacement":
            shape = np.zeros_like(at)
            for name, weight in unit.mixture.items():
                for side in _sides(data, name):
                    shape += weight * makehuman.read_target(data, side, len(at)) * makehuman.DECIMETRE
            shape = (shape + shape[twin] * EVEN) / 2
            moves = np.einsum("nk,nkc->nc", share, shape[corners])
            out[unit.au] = UnitMeasurement(unit.au, skin, moves, visible, upper)
    return out


def _on_base(figure: Figure, face: Face, index: Any) -> tuple[Int32, Float64, Float64]:
    """Return the barycentric coordinates of skin vertices on the base mesh.

    Where lips or lids touch, a vertex belongs to the surface with a similar normal.

    Args:
        index: (n,) indices of vertices of the skin.

    Returns:
        (n, 3) base vertices, (n, 3) their weights, and the distance of each vertex in metres, (n,).
    """
    first, last = face.parts["skin"]
    skin = face.vertices[first:last].astype(np.float64)
    skin_triangles = part_triangles(face.triangles, face.parts["skin"])
    normals, skin = vertex_normals(skin, skin_triangles)[index], skin[index]
    body = Submesh.of_quads(figure.mesh.quads["body"], len(figure.at))
    base = body.mix.indices[body.triangles]
    corners = figure.at[base]
    faces = triangle_normals(figure.at, base)
    near = np.asarray(cKDTree(corners.mean(axis=1)).query(skin, AROUND)[1])
    surface_points = nearest_points(corners[near], skin)
    distances = np.linalg.norm(surface_points - skin[:, None], axis=2)
    same = np.einsum("nkc,nc->nk", faces[near], normals) > 0
    best = np.where(same, distances, distances + MAX_DISTANCE).argmin(axis=1)
    each = np.arange(len(skin))
    hit = near[each, best]
    return (
        base[hit].astype(np.int32),
        corner_shares(corners[hit], surface_points[each, best]),
        distances[each, best],
    )


def _sides(data: Path, name: str) -> tuple[str, ...]:
    symmetric = (data / "faceunits01/targets/faceunits" / f"{name}.target").is_file()
    return (name,) if symmetric else (f"{name}Left", f"{name}Right")
