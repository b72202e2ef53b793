"""The build of a face's fields.npz from zones of influence."""

import shutil
from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from realizer.core.array_types import Float64
from realizer.core.errors import FaceError
from realizer.face.basis import ARRAYS, BEYOND, unpack
from realizer.face.cards import FILE as CARDS
from realizer.face.features import read_features, write_features
from realizer.face.load import MESH, read_head
from realizer.face.maps import NAMES as MAPS
from realizer.face.mesh_geometry import half_edges, neighbour_mean, part_triangles
from realizer.face.reading import read_arrays
from realizer.tables import faps
from realizer_studio.faces.face_files import write_fields
from realizer_studio.faces.mpeg4 import rigid
from realizer_studio.faces.mpeg4.defaults import default_setup, split_sides
from realizer_studio.faces.mpeg4.faceeditor import fitted, read_faceeditor
from realizer_studio.faces.mpeg4.parameters import FILE, read_setup, write_setup
from realizer_studio.faces.mpeg4.point_finder import find_points
from realizer_studio.faces.mpeg4.zone_fields import zone_fields
from realizer_studio.faces.mpeg4.zones import Setup, mask_faults, synchronised

FILES = (
    "face.toml", "mesh.npz", "features.csv", "fields.npz", "recipe.toml", "LICENSE.md", FILE, CARDS,
    *(f"{name}.webp" for name in MAPS),
)  # fmt: skip

GROWN = ("brows", "lashes", "beard")  # parts that lie on the skin and follow it
NEAR = 3  # vertices of the skin that one of their vertices follows
PUPILS = {"3.5", "3.6"}  # points that lie on no skin


def copy_with_zones(
    source: Path, folder: Path, parameters: Path | None = None, only: Collection[int] = ()
) -> tuple[Setup, tuple[str, ...]]:
    """Copy a face folder and build the copy's fields from zones; missing feature points are located.

    Args:
        source: a face folder; folder: the new one, whose name becomes the face's.
        parameters: a file of zones, TOML or FaceEditor's XML, which is moved and sized to the face's feature
            points; None for the result of `setup_of`.
        only: as for `apply_zones`.

    Returns:
        The parameters, as written to the new folder's mpeg4.toml, and the feature points that are guesses.

    Raises:
        FaceError: the source or the parameters are broken.
    """
    name = read_head(source)["name"]
    folder.mkdir(parents=True, exist_ok=True)
    for file in FILES:
        if (source / file).is_file() and source.resolve() != folder.resolve():
            shutil.copy(source / file, folder / file)
    guesses = () if (folder / "features.csv").is_file() else _write_points(folder)
    head = (folder / "face.toml").read_text("utf-8")
    (folder / "face.toml").write_text(head.replace(f'name = "{name}"', f'name = "{folder.name}"', 1), "utf-8")
    if parameters is not None and parameters.suffix.lower() == ".xml":
        points = _read_folder(folder)[3]
        write_setup(folder / FILE, fitted(read_faceeditor(parameters), points))
    elif parameters is not None and parameters.resolve() != (folder / FILE).resolve():
        shutil.copy(parameters, folder / FILE)
    setup = setup_of(folder)
    apply_zones(folder, setup, only)
    write_setup(folder / FILE, setup)
    return setup, guesses


def _write_points(folder: Path) -> tuple[str, ...]:
    """Find the feature points, write features.csv, and return the points that are guesses."""
    at, mesh, parts = _read_mesh(folder)
    points, guesses = find_points(at, np.asarray(mesh["triangles"], np.int32), parts)
    write_features(folder / "features.csv", points)
    return guesses


def setup_of(folder: Path) -> Setup:
    """Return the parameters of a face folder, from its mpeg4.toml or computed from mesh and points.

    Raises:
        FaceError: a file is missing or broken, or the points are.
    """
    at, mesh, parts, points = _read_folder(folder)
    if (folder / FILE).is_file():
        setup = read_setup(folder / FILE)
        # Masks are mirrored among the vertices of the skin.
        return synchronised(replace(setup, points=points | dict(setup.points)), at[: parts["skin"][1]])
    return default_setup(at, np.asarray(mesh["triangles"], np.int32), points, parts["skin"])


def apply_zones(folder: Path, setup: Setup, only: Collection[int] = ()) -> None:
    """Write fields.npz.

    Args:
        folder: has face.toml, mesh.npz and features.csv; with `only`, also fields.npz.
        only: FAPs whose fields are replaced; the others stay. If empty, all fields are built, including
            those of jaw, tongue, eyeballs, pupils and neck.

    Raises:
        FaceError: a file or a zone is broken, or a FAP of `only` has no zone.
    """
    at, mesh, parts, points = _read_folder(folder)
    path = folder / "fields.npz"
    skin = slice(*parts["skin"])
    chosen = {fap: zone for fap, zone in setup.zones.items() if not only or fap in only}
    missing = sorted(set(only) - set(chosen))
    if missing:
        raise FaceError(
            f"{folder}: no zone for FAP {', '.join(map(str, missing))}; add one to the parameters"
        )
    if faults := mask_faults(setup, parts["skin"]):
        raise FaceError(faults[0])
    # The fields are computed for the skin alone, so its masks count from its first vertex.
    skin_setup = replace(setup, masks={fap: mask - skin.start for fap, mask in setup.masks.items()})
    skin_fields = _smoothed(
        zone_fields(skin_setup, at[skin]), skin_setup, at[skin], mesh["triangles"], parts["skin"]
    )
    rows = {fap: extend_field(at, parts, skin_fields[fap], np.zeros_like(at)) for fap in chosen}
    if only:
        stored = read_arrays(path, ARRAYS)
        stored_rows = unpack(stored, len(at))
        rows = {number: row for number, row in stored_rows.items() if number - BEYOND not in chosen} | rows
        eyes = [
            (centre, radius)
            for (_, radius), centre in zip(rigid.balls(at, parts), stored["eye_centre"], strict=True)
        ]
        jaw, pivot, head = stored["jaw_pivot"], stored["head_pivot"], stored["head"]
    else:
        triangles = np.asarray(mesh["triangles"], np.int32)
        lower = split_sides(at, triangles, points, parts["skin"])["lower_lip"]
        jaw = rigid.jaw_pivot(points)
        rows |= rigid.jaw_rows(at, points, parts, lower, jaw)
        rows |= rigid.tongue_rows(at, points, parts)
        eyes = rigid.balls(at, parts)
        rows |= rigid.pupil_rows(at, mesh["colours"], parts, eyes)
        pivot = np.array(points["7.1"])
        head = np.rint(rigid.head_weight(at, points, parts) * 255).astype(np.uint8)
    centres = [centre for centre, _ in eyes]
    write_fields(path, rows, head, jaw, pivot, centres, rigid.sliding(rows, at, parts, eyes))


def _read_folder(folder: Path) -> tuple[Float64, Any, dict[str, tuple[int, int]], dict[str, Any]]:
    points = {name: point.place for name, point in read_features(folder / "features.csv").items()}
    return *_read_mesh(folder), points


def _read_mesh(folder: Path) -> tuple[Float64, Any, dict[str, tuple[int, int]]]:
    head = read_head(folder)
    mesh = read_arrays(folder / "mesh.npz", MESH)
    parts = {name: (int(a), int(b)) for name, (a, b) in head["parts"].items()}
    for name in ("skin", "left_eye", "right_eye"):
        if name not in parts:
            raise FaceError(f"{folder / 'face.toml'}: parts: wanted {name!r}, got {', '.join(parts)}")
    at = np.asarray(mesh["vertices"], np.float64)
    if not np.isfinite(at).all():
        bad = int(np.flatnonzero(~np.isfinite(at).all(axis=1))[0])
        raise FaceError(f"{folder / 'mesh.npz'}: vertex {bad} is not finite; build the face again")
    return at, mesh, parts


def _smoothed(
    fields: Mapping[int, Float64], setup: Setup, at: Float64, triangles: Any, skin: tuple[int, int]
) -> dict[int, Float64]:
    """Return smoothed fields: the mean of each vertex's displacement and its neighbours' average.

    Feature points keep their displacement, so that they still follow their FAPs.
    """
    average = neighbour_mean(len(at), half_edges(part_triangles(triangles, skin)), own=False)
    ends = {faps()[fap - 1].feature_point for fap in fields} - PUPILS
    fixed = [int(np.argmin(np.linalg.norm(at - np.array(setup.points[name]), axis=1))) for name in ends]
    smoothed = {}
    for fap, field in fields.items():
        smoothed[fap] = 0.5 * field + 0.5 * np.asarray(average @ field)
        smoothed[fap][fixed] = field[fixed]
    return smoothed


def extend_field(at: Float64, parts: Mapping[str, tuple[int, int]], field: Float64, row: Float64) -> Float64:
    """Return `row` (n, k) with the skin's field for the skin and for the parts that grow on it."""
    out = np.array(row)
    out[slice(*parts["skin"])] = field
    vertex, nearest, weight = bind_to_skin(at, parts)
    out[vertex] = (field[nearest] * weight[..., None]).sum(axis=1)
    return out


def bind_to_skin(at: Float64, parts: Mapping[str, tuple[int, int]]) -> tuple[Any, Any, Float64]:
    """Return vertices (k,) of hair parts, the skin's vertices (k, 3) that they follow, and their weights.

    The skin's vertices are counted from its first vertex.
    """
    vertex = np.concatenate([np.zeros(0, int), *(np.arange(*parts[name]) for name in GROWN if name in parts)])
    distance, nearest = cKDTree(at[slice(*parts["skin"])]).query(at[vertex], NEAR)
    weight = 1 / np.maximum(distance, 1e-5)
    return vertex, nearest, weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-30)
