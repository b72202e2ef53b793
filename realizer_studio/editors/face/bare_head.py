"""The import of a head without shapes (GLB, OBJ or PLY) into a face folder with zones."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.core.errors import FaceError
from realizer.face.features import write_features
from realizer.face.mesh_checks import surface_faults
from realizer.face.mesh_geometry import fit_ball
from realizer_studio.faces.arkit.gltf import Gltf
from realizer_studio.faces.arkit.head import Head, Report
from realizer_studio.faces.arkit.importer import describe_head, write_surface
from realizer_studio.faces.arkit.mesh_merge import Surface, cut, merge_pieces, part_of
from realizer_studio.faces.arkit.orientation import EYE_DISTANCES, UNITS, USUAL_EYE_DISTANCE
from realizer_studio.faces.arkit.part_classifier import FLOOR, HALF_WIDTH, ROUND, sort_parts
from realizer_studio.faces.arkit.points import points_of
from realizer_studio.faces.arkit.scene import read_pieces
from realizer_studio.faces.arkit.texture_atlas import make_atlas
from realizer_studio.faces.mpeg4.defaults import default_setup
from realizer_studio.faces.mpeg4.parameters import FILE, write_setup
from realizer_studio.faces.mpeg4.zone_build import apply_zones
from realizer_studio.faces.mpeg4.zones import mirrorable

SUFFIXES = (".glb", ".gltf", ".obj", ".ply")
FEWEST = 24  # vertices of an eyeball
ALIKE = 0.15  # of a radius; largest difference between two eyeballs
EYES = "name the eyes' meshes or materials eye, or give each a ball of its own, +y up and facing +z"


def import_bare(path: Path, folder: Path, name: str) -> tuple[str, ...]:
    """Write a face folder with zones from a head, whose shapes are ignored.

    Args:
        path: the head, upright and facing +z; name: the face's name.

    Returns:
        Notes for the user: sentences, then guessed feature points as "guess 2.1".

    Raises:
        FaceError: the file cannot be read, or the head has no skin or no eyes.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise FaceError(
            f"{path.name}: wanted a head as {', '.join(SUFFIXES)}, got {path.suffix or 'no suffix'}"
        )
    with TemporaryDirectory() as temporary:
        gltf = Gltf(
            path
            if path.suffix.lower() in SUFFIXES[:2]
            else _as_glb(path, Path(temporary) / f"{path.stem}.glb")
        )
        pieces = [replace(piece, moves={}) for piece in read_pieces(gltf)]
        if len(pieces) == 1:
            pieces[0].names = ("", "", "")  # a name of the whole head does not tell its parts
        if not pieces:
            raise FaceError(f"{path.name}: wanted a head, found no triangles; export the head's meshes")
        try:
            surface, notes = _upright(merge_pieces(pieces))
            parts = sort_parts(surface)
        except FaceError as error:
            raise FaceError(f"{path.name}: {error}") from None
        surface, ranges = parts.arranged(surface)
        folder.mkdir(parents=True, exist_ok=True)
        describe_head(folder / "face.toml", name, Head(surface, ranges, False, gltf, Report((), (), ())))
        points, guesses = points_of(surface, ranges)
        write_features(folder / "features.csv", points)
        write_surface(folder, surface, ranges, make_atlas(gltf, surface, ranges))
    positions = {key: point.place for key, point in points.items()}
    setup = default_setup(surface.vertices, surface.triangles, positions, ranges["skin"])
    setup = mirrorable(setup, surface.vertices[slice(*ranges["skin"])])
    write_setup(folder / FILE, setup)
    apply_zones(folder, setup)
    mouth = (np.array(positions["2.2"]) + np.array(positions["2.3"])) / 2
    holes = surface_faults(surface.vertices, surface.triangles, ranges, mouth)
    return (*notes, *parts.unsure, *holes, *(f"guess {key}" for key in guesses))


def _as_glb(path: Path, glb: Path) -> Path:
    """Return the mesh of an OBJ or PLY file as a GLB."""
    import trimesh

    try:
        options: Any = {"split_object": True, "skip_materials": True} if path.suffix.lower() == ".obj" else {}
        scene: Any = trimesh.load_scene(path, process=False, **options)
        scene.export(glb)
    except Exception as error:  # trimesh's readers raise many kinds of errors on broken files
        raise FaceError(f"{path.name}: wanted a mesh, got what cannot be read: {error}") from None
    return glb


def _upright(surface: Surface) -> tuple[Surface, tuple[str, ...]]:
    """Return the surface in metres with its origin between the eyes, cut to a bust, and notes.

    Raises:
        FaceError: no two eyeballs side by side.
    """
    left, right = _eyes(surface)
    apart = float(np.linalg.norm(left - right))
    sizes = [size for size in UNITS.values() if EYE_DISTANCES[0] <= apart * size <= EYE_DISTANCES[1]]
    notes = () if sizes else (f"its eyes stand {apart:.4g} units apart: scaled to {USUAL_EYE_DISTANCE} m",)
    scale = sizes[0] if sizes else USUAL_EYE_DISTANCE / apart
    surface = replace(surface, vertices=(surface.vertices - (left + right) / 2) * scale)
    surface = cut(surface, surface.vertices[:, 1] - FLOOR)
    return cut(surface, HALF_WIDTH - np.abs(surface.vertices[:, 0])), notes


def _eyes(surface: Surface) -> tuple[Float64, Float64]:
    """Return the centres of the two eyeballs in the file's unit, found by names or by shape."""
    label, named = surface.components(), [part_of(names) for names in surface.names]
    size = float(np.ptp(surface.vertices, axis=0).max())
    balls = []
    for k in range(int(label.max()) + 1):
        piece = np.flatnonzero(label == k)
        at = surface.vertices[piece]
        if len(piece) < FEWEST:
            continue
        centre, radius = fit_ball(at)
        deviation = np.abs(np.linalg.norm(at - centre, axis=1) - radius)
        is_eye = named[surface.piece[piece[0]]] == "eye"
        if radius < 0.2 * size and np.percentile(deviation, 80) < (3 if is_eye else 1) * ROUND * radius:
            balls.append((not is_eye, float(radius), centre))
    pairs = [
        (one[0] + other[0], -one[1], one[2], other[2])
        for one in balls
        for other in balls
        if one[2][0] > other[2][0]
        and abs(one[1] - other[1]) < ALIKE * one[1]
        and np.abs(one[2] - other[2])[1:].max() < one[1]
        and one[2][0] - other[2][0] > 2 * one[1]
    ]
    if not pairs:
        raise FaceError(f"wanted two eyeballs side by side, got {len(balls)} balls that are no pair; {EYES}")
    best = min(pairs, key=lambda pair: pair[:2])
    return best[2], best[3]
