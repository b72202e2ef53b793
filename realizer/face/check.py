"""A face folder in, its faults out: which file, and what to change."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from realizer.errors import FaceError, TableError
from realizer.face.archive import read_arrays
from realizer.face.basis import ARRAYS
from realizer.face.features import INSIDE, Point, fapu_of, read_features
from realizer.face.load import MESH, folder_of, load_face, read_head
from realizer.face.model import Face
from realizer.tables import faps
from realizer.tables.mappings import own_file, read_mapping

__all__ = ["check_face"]

OFF = 0.004  # m; a feature point further than this from its vertex is off the mesh
PARTS = ("skin", "left_eye", "right_eye", "upper_teeth", "lower_teeth", "tongue", "brows", "hair")
EDGES_OF_SKIN = 1  # the clean cut under the collar is the only hole that a head may have


def check_face(name: str = "default", directory: Path | str | None = None) -> tuple[str, ...]:
    """Every fault of a face folder, one sentence each; empty when it is sound."""
    try:
        folder = folder_of(name, directory)
    except FaceError as error:
        return (str(error),)
    faults: list[str] = []
    for read in (
        lambda: read_head(folder),
        lambda: read_arrays(folder / "mesh.npz", MESH),
        lambda: read_features(folder / "features.csv"),
        lambda: read_arrays(folder / "fields.npz", ARRAYS),
        lambda: _read_mapping(folder),
    ):
        try:
            read()
        except (FaceError, TableError) as error:
            faults.append(str(error))
    if faults:
        return tuple(faults)
    mesh = read_arrays(folder / "mesh.npz", MESH)
    head = read_head(folder)
    points = read_features(folder / "features.csv")
    faults += _mesh_faults(folder, mesh["vertices"], mesh["triangles"], mesh)
    faults += _part_faults(folder, head["parts"], len(mesh["vertices"]))
    faults += _point_faults(folder, points, mesh["vertices"])
    try:
        fapu_of({key: np.array(p.place, np.float32) for key, p in points.items()}, folder / "features.csv")
        if not faults:
            face = load_face(folder.name, folder.parent)
            faults += _field_faults(folder, face)
            faults += _hole_faults(folder, face)
    except FaceError as error:
        faults.append(str(error))
    return tuple(faults)


def _read_mapping(folder: Path) -> None:
    own = own_file(folder)
    if own is not None:
        read_mapping(own)


def _mesh_faults(
    folder: Path, vertices: np.ndarray, triangles: np.ndarray, mesh: dict[str, np.ndarray]
) -> list[str]:
    path, n = folder / "mesh.npz", len(vertices)
    faults = []
    bad = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if len(bad):
        faults.append(
            f"{path}: vertices: {len(bad)} are not finite, the first is {bad[0]}; build the face again"
        )
    if vertices.shape[1] != 3 or triangles.shape[1] != 3:
        faults.append(
            f"{path}: wanted vertices and triangles of 3 columns, got {vertices.shape}, {triangles.shape}"
        )
    elif len(triangles) and (triangles.min() < 0 or triangles.max() >= n):
        faults.append(
            f"{path}: triangles: wanted indices 0..{n - 1}, got {triangles.min()}..{triangles.max()}"
        )
    faults += [
        f"{path}: {name}: wanted {n} rows, one a vertex, got {len(mesh[name])}"
        for name in ("colours", "occlusion", "gloss")
        if len(mesh[name]) != n
    ]
    return faults


def _part_faults(folder: Path, parts: dict[str, list[int]], n: int) -> list[str]:
    path = folder / "face.toml"
    faults = [f"{path}: parts: wanted {name!r}, got none" for name in PARTS if name not in parts]
    for name, (first, last) in parts.items():
        if not 0 <= first < last <= n:
            faults.append(f"{path}: parts: {name}: wanted a range in 0..{n}, got {first}..{last}")
    return faults


def _point_faults(folder: Path, points: dict[str, Point], vertices: np.ndarray) -> list[str]:
    path, n = folder / "features.csv", len(vertices)
    faults = []
    for name, point in points.items():
        if not 0 <= point.vertex < n:
            faults.append(f"{path}: {name}: vertex {point.vertex} is out of range 0..{n - 1}")
        elif not np.isfinite(point.place).all():
            faults.append(f"{path}: {name}: wanted finite x, y, z, got {point.place}")
        elif name not in INSIDE:
            off = float(np.linalg.norm(vertices[point.vertex] - point.place))
            if off > OFF:
                faults.append(
                    f"{path}: {name}: the point is {off * 1000:.1f} mm off its vertex {point.vertex}; "
                    "put the nearest vertex there, or move the point onto the mesh"
                )
    return faults


def _field_faults(folder: Path, face: Face) -> list[str]:
    from realizer.face.deform import deform

    rows = np.zeros((69, 68), np.float32)
    for row in faps()[2:]:
        rows[row.fap, row.fap - 1] = 0.1 * row.most
    moved = np.abs(deform(face, rows) - face.vertices).max(axis=(1, 2))
    faults = []
    if moved[0] > 1e-6:
        faults.append(
            f"{folder / 'fields.npz'}: the neutral face moves by {moved[0]:.6f} m; build the face again"
        )
    for row in faps()[2:]:
        if moved[row.fap] < 1e-6:
            faults.append(
                f"{folder / 'fields.npz'}: FAP {row.fap} {row.name} moves nothing; build the face again"
            )
    return faults


def _hole_faults(folder: Path, face: Face) -> list[str]:
    """Closed rims of the skin beyond the cut under the collar."""
    first, last = face.parts["skin"]
    triangles = face.triangles[(face.triangles >= first).all(axis=1) & (face.triangles < last).all(axis=1)]
    edges = np.sort(
        np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1
    )
    pairs, counts = np.unique(edges, axis=0, return_counts=True)
    rim = pairs[counts == 1]
    if not len(rim):
        return []
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    names, index = np.unique(rim, return_inverse=True)
    index = index.reshape(-1, 2)
    graph = coo_matrix((np.ones(len(index)), (index[:, 0], index[:, 1])), (len(names),) * 2)
    count, label = connected_components(graph, directed=False)
    if count <= EDGES_OF_SKIN:
        return []
    lowest = face.vertices[names, 1]
    bottom = label[int(np.argmin(lowest))]
    other = names[label != bottom]
    return [
        f"{folder / 'mesh.npz'}: the skin has {count - 1} holes beside the cut under the collar, one at "
        f"vertex {other[0]}, {np.round(face.vertices[other[0]], 4).tolist()}; close it"
    ]
