"""The check of a face folder, which reports every fault with its file and a remedy."""

import io
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from PIL import Image

from realizer.core.errors import FaceError, TableError
from realizer.core.similar import did_you_mean, similar
from realizer.face.au.file import read_model
from realizer.face.basis import AGAIN, ARRAYS, ROWS, array_faults
from realizer.face.deform import deform
from realizer.face.features import INSIDE, Point, fapu_of, read_features
from realizer.face.load import MESH, folder_of, load_folder, read_head
from realizer.face.mesh_checks import NEEDED, range_faults, surface_faults, value_faults
from realizer.face.model import Face
from realizer.face.reading import read_arrays
from realizer.tables import faps
from realizer.tables.mappings import own_file, read_mapping
from realizer_studio.faces.au.measure import read_shapes
from realizer_studio.faces.mpeg4.parameters import FILE, read_setup
from realizer_studio.faces.mpeg4.zones import mask_faults

FARTHEST = 20  # times the feature point's displacement; the largest displacement of a vertex
MAX_DISTANCE = 0.004  # m; a feature point further than this from its vertex is off the mesh
PARTS = (
    *NEEDED, "upper_teeth", "lower_teeth", "tongue", "tears", "brows", "lashes", "hair", "beard", "shirt",
    "glasses", "other",
)  # fmt: skip
KEYS = ("name", "source", "licence", "says", "parts", "cameras", "deformer", "maps", "cards")
TONGUE = range(43, 48)  # FAPs that may move nothing if there is no tongue

Read = TypeVar("Read")


def check_face(name: str = "default", directory: Path | str | None = None) -> tuple[str, ...]:
    """Return every fault of a face folder, one sentence each; empty if the folder is sound."""
    try:
        folder = folder_of(name, directory)
    except (FaceError, FileNotFoundError) as error:
        return (str(error),)
    faults: list[str] = []

    def tried(read: Callable[[], Read]) -> Read | None:
        try:
            return read()
        except (FaceError, TableError) as error:
            faults.append(str(error))
            return None

    head = tried(lambda: read_head(folder))
    mesh = tried(lambda: read_arrays(folder / "mesh.npz", MESH))
    points = tried(lambda: read_features(folder / "features.csv"))
    stored = tried(lambda: read_arrays(folder / "fields.npz", ARRAYS))
    if mapping_file := tried(lambda: own_file(folder)):
        tried(lambda: read_mapping(mapping_file))
    zones = folder / FILE
    setup = tried(lambda: read_setup(zones)) if zones.is_file() else None
    if (shapes := folder / "au_shapes.npz").is_file():
        tried(lambda: read_shapes(shapes))
    for path in sorted(folder.glob("au_*.toml")):
        tried(lambda path=path: read_model(path))  # type: ignore[misc]
    n = len(mesh["vertices"]) if mesh else None
    values = value_faults(mesh) if mesh else []
    faults += [f"{folder / 'mesh.npz'}: {fault}" for fault in values]
    parts: list[str] = []
    if head:
        parts = _part_faults(folder, head["parts"], n)
        faults += [
            f"{folder / 'face.toml'}: {key!r}: there is no such key{_nearest(key, KEYS)}"
            for key in head
            if key not in KEYS
        ]
        faults += parts
    if points:
        positions = {key: np.array(point.place, np.float32) for key, point in points.items()}
        tried(lambda: fapu_of(positions, folder / "features.csv"))
        if mesh and not values:
            faults += _point_faults(folder, points, mesh["vertices"], mesh["triangles"])
    if stored and n is not None:
        faults += _stored_faults(folder, stored, n)
    if setup and head and not parts:
        faults += [f"{zones}: {fault}" for fault in mask_faults(setup, head["parts"]["skin"])]
    if mesh and not values and head and not parts:
        ranges = {key: (int(a), int(b)) for key, (a, b) in head["parts"].items()}
        mouth = None if not points else (np.array(points["2.2"].place) + np.array(points["2.3"].place)) / 2
        found = surface_faults(np.asarray(mesh["vertices"], float), mesh["triangles"], ranges, mouth)
        faults += [f"{folder / 'mesh.npz'}: {fault}" for fault in found]
    if not faults:
        face = tried(lambda: load_folder(folder, None))
        faults += _field_faults(folder, face) if face else []
        faults += _picture_faults(folder, face.maps.files) if face and face.maps else []
    return tuple(dict.fromkeys(faults))


def _nearest(word: str, words: Any) -> str:
    return did_you_mean(similar(word, words, 1)) or f"; there are: {', '.join(words)}"


def _part_faults(folder: Path, parts: dict[str, Any], n: int | None) -> list[str]:
    path = folder / "face.toml"
    faults = [
        f"parts: {name!r}: there is no such part{_nearest(name, PARTS)}"
        for name in parts
        if name not in PARTS
    ]
    faults += (wrong := range_faults(parts, n))
    if not wrong:
        ordered = sorted(parts, key=lambda name: parts[name])
        faults += [
            f"parts: {one} {parts[one]} and {other} {parts[other]} overlap: a vertex is of one part"
            for one, other in pairwise(ordered)
            if parts[one][1] > parts[other][0]
        ]
    return [f"{path}: {fault}" for fault in faults]


def _point_faults(folder: Path, points: dict[str, Point], vertices: Any, triangles: Any) -> list[str]:
    path, n = folder / "features.csv", len(vertices)
    on_surface = np.zeros(n, bool)
    on_surface[triangles] = True
    faults = []
    for name, point in points.items():
        if not 0 <= point.vertex < n:
            faults.append(f"{path}: {name}: vertex {point.vertex} is out of range 0..{n - 1}")
        elif not np.isfinite(point.place).all():
            faults.append(f"{path}: {name}: wanted finite x, y, z, got {point.place}")
        elif name not in INSIDE:
            distance = float(np.linalg.norm(vertices[point.vertex] - point.place))
            if distance > MAX_DISTANCE:
                faults.append(
                    f"{path}: {name}: the point is {distance * 1000:.1f} mm off its vertex {point.vertex}; "
                    "put the nearest vertex there, or move the point onto the mesh"
                )
            elif not on_surface[point.vertex]:
                faults.append(
                    f"{path}: {name}: vertex {point.vertex} lies on no surface, no triangle has it; "
                    "put the nearest vertex of the surface there"
                )
    return faults


def _stored_faults(folder: Path, stored: dict[str, Any], n: int) -> list[str]:
    """Return the faults of fields that were made for another mesh, or truncated."""
    faults = array_faults(stored, n)
    sides = stored["lid_eye"]
    if len(sides) != len(stored["lid"]) or len(stored["lid_radius"]) != len(sides):
        faults.append(f"lid, lid_eye, lid_radius: wanted as many of each; {AGAIN}")
    if len(sides) and (sides.min() < 0 or sides.max() > 1):
        faults.append(f"lid_eye: wanted 0 or 1, got {sides.min()}..{sides.max()}; {AGAIN}")
    if stored["eye_centre"].shape != (2, 3) or stored["eye_centre"][0, 0] <= stored["eye_centre"][1, 0]:
        faults.append(f"eye_centre: wanted the left eye's middle, then the right's; {AGAIN}")
    farthest = np.abs(stored["move"]).max(initial=0)
    if farthest > FARTHEST:
        faults.append(f"move: wanted at most {FARTHEST} times its point's way, got {farthest:g}; {AGAIN}")
    row, start = stored["row"], stored["start"]
    if len(row) and (row.min() < 3 or row.max() > ROWS or (np.diff(row) <= 0).any()):
        faults.append(f"row: wanted ascending numbers 3..{ROWS}, got {row.min()}..{row.max()}; {AGAIN}")
    if len(start) != len(row) + 1 or (np.diff(start) < 0).any() or start[-1] != len(stored["vertex"]):
        faults.append(f"start: wanted {len(row) + 1} ascending ends of vertex, got others; {AGAIN}")
    if stored["move"].shape != (len(stored["vertex"]), 3):
        faults.append(f"move: wanted 3 numbers a vertex, got {stored['move'].shape}; {AGAIN}")
    return [f"{folder / 'fields.npz'}: {fault}" for fault in faults]


def _field_faults(folder: Path, face: Face) -> list[str]:
    path = folder / "fields.npz"
    rows = np.zeros((69, 68), np.float32)
    for row in faps()[2:]:
        rows[row.fap, row.fap - 1] = 0.1 * row.most
    moved = np.abs(deform(face, rows) - face.vertices).max(axis=(1, 2))
    faults = []
    if moved[0] > 1e-6:
        faults.append(f"{path}: the neutral face moves by {moved[0]:.6f} m; build the face again")
    faults += [
        f"{path}: FAP {row.fap} {row.name} moves nothing; build the face again"
        for row in faps()[2:]
        if moved[row.fap] < 1e-6 and ("tongue" in face.parts or row.fap not in TONGUE)
    ]
    return faults


def _picture_faults(folder: Path, files: Mapping[str, bytes]) -> list[str]:
    """Return the maps that are no pictures, or damaged."""
    faults = []
    for name, raw in files.items():
        try:
            Image.open(io.BytesIO(raw)).load()
        except (OSError, SyntaxError, ValueError, Image.DecompressionBombError):  # of the decoders
            faults.append(
                f"{folder / name}.webp: wanted a picture, got another file or a part of one; build it again"
            )
    return faults
