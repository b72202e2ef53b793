"""The import of a GLB head with ARKit blend shapes into a face folder, with a report."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.core.errors import FaceError
from realizer.face.au.regions import fit_mouth, shares
from realizer.face.au.units import units
from realizer.face.basis import unpack
from realizer.face.features import Point, write_features
from realizer.face.load import load_face
from realizer.face.maps import NAMES
from realizer.face.mesh_geometry import fit_ball, vertex_normals
from realizer.face.model import Face
from realizer_studio.faces.arkit.head import Head, Report, fap_sources, read_head
from realizer_studio.faces.arkit.mesh_merge import Surface
from realizer_studio.faces.arkit.mouth import drag_of, joint_of, mouth_of
from realizer_studio.faces.arkit.part_classifier import ball_behind
from realizer_studio.faces.arkit.points import points_of
from realizer_studio.faces.arkit.shape_fields import ShapedSkin, shape_fields
from realizer_studio.faces.arkit.texture_atlas import SIZE, Atlas, make_atlas
from realizer_studio.faces.au.measure import OPEN, UnitMeasurement, write_shapes
from realizer_studio.faces.face_files import write_fields, write_head, write_mesh
from realizer_studio.faces.mpeg4.defaults import default_setup, split_sides
from realizer_studio.faces.mpeg4.rigid import opening_rows, sliding
from realizer_studio.faces.mpeg4.zone_build import apply_zones, extend_field
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.person.skin_colours import occlusion

# Gloss of surfaces without roughness in the file, or without textures.
GLOSS = {
    "skin": 0.16, "brows": 0.05, "lashes": 0.0, "left_eye": 1.0, "right_eye": 1.0, "upper_teeth": 0.75,
    "lower_teeth": 0.75, "tongue": 0.35, "hair": 0.10, "beard": 0.08, "shirt": 0.0, "other": 0.1,
}  # fmt: skip
DIRECTIONS, CELL = 48, 0.003  # of the baked occlusion: enough for vertices millimetres apart
INSIDE = ("upper_teeth", "lower_teeth", "tongue")
SHAPES = "au_shapes.npz"
LINED = ("brows", "lashes", *INSIDE)  # parts that cast no shadow: thin ones, and those behind closed lips


def inspect_head(path: Path) -> Report:
    """Return what `import_head` would report, without writing anything.

    Raises:
        FaceError: the file cannot be read, or has no shapes of a face.
    """
    head = read_head(path)
    for material in head.surface.materials:
        for _, texture in material.textures:
            head.gltf.pixels(texture.image)
    return replace(head.report, missing=(*head.report.missing, *head.gltf.notes))


def import_head(path: Path, folder: Path, name: str | None = None) -> Report:
    """Write a face folder from a GLB or glTF head with ARKit-named morph targets.

    Args:
        path: the file; name: the face's name, None for the folder's.
        folder: the folder to write; an error leaves it unchanged.

    Raises:
        FaceError: the file cannot be read, has no shapes of a face, or no skin, eyes or mouth.
    """
    head = read_head(path)
    folder.parent.mkdir(parents=True, exist_ok=True)
    # The draft is beside the folder, so that files are complete and moving them is atomic.
    with TemporaryDirectory(prefix=f".{folder.name}-", dir=folder.parent) as beside:
        draft = Path(beside) / folder.name
        draft.mkdir()
        report = _write(head, draft, name or folder.name)
        folder.mkdir(exist_ok=True)
        for old in (*(f"{name}.webp" for name in NAMES), "cards.npz", SHAPES):
            (folder / old).unlink(missing_ok=True)
        for file in draft.iterdir():
            file.replace(folder / file.name)
    return report


def _write(head: Head, folder: Path, name: str) -> Report:
    surface, ranges = head.surface, head.ranges
    describe_head(folder / "face.toml", name, head)
    points, guesses = points_of(surface, ranges, head.painted)
    write_features(folder / "features.csv", points)
    atlas = make_atlas(head.gltf, surface, ranges)
    write_surface(folder, surface, ranges, atlas)
    shape_faps, notes = _write_fields(folder, head, points)
    report = head.report
    if atlas is not None:
        notes = (f"{len(surface.materials)} materials in maps of {SIZE} x {SIZE} texels", *notes)
    found = (*report.found, f"{len(shape_faps)} FAPs move by its shapes, the others by zones", *notes)
    unsure = report.unsure
    try:
        measured = measure_units(load_face(folder.name, folder.parent), surface)
    except FaceError as error:
        measured, unsure = {}, (*unsure, f"no shapes for the model of action units: {error}")
    if measured:
        write_shapes(folder / SHAPES, measured)
        found = (*found, f"{len(measured)} action units for realizer faces fit {folder.name}")
    if guesses:
        unsure = (*unsure, f"feature points that are guessed, look at them: {', '.join(guesses)}")
    sources = fap_sources(shape_faps, guesses, ranges, head.painted)
    return Report(found, (*report.missing, *head.gltf.notes), unsure, sources)


def describe_head(path: Path, name: str, head: Head) -> None:
    """Write face.toml, with author and licence from the file."""
    asset = head.gltf.json["asset"]
    extras = asset.get("extras") if isinstance(asset.get("extras"), dict) else {}
    author = str(extras.get("author") or asset.get("generator") or "its maker")
    licence = str(extras.get("license") or asset.get("copyright") or "not stated: ask who made it")
    source = f"{head.gltf.path.name}, by {author}"
    description = f"Imported from {head.gltf.path.name}"
    values = {"name": name, "source": source, "licence": licence, "says": description}
    write_head(path, values, head.ranges)


def write_surface(
    folder: Path, surface: Surface, ranges: dict[str, tuple[int, int]], atlas: Atlas | None
) -> None:
    """Write mesh.npz and the maps; without maps, vertices get the colours of their materials."""
    at, n = surface.vertices, len(surface.vertices)
    part = np.empty(n, object)
    for name, ends in ranges.items():
        part[slice(*ends)] = name
    casts = ~np.isin(part[surface.triangles[:, 0]].astype(str), LINED)
    normals = vertex_normals(at, surface.triangles)
    visible_sky = occlusion(at, normals, surface.triangles[casts], DIRECTIONS, CELL)
    light, gloss = 0.25 + 0.75 * visible_sky, np.zeros(n)
    for name, ends in ranges.items():
        gloss[slice(*ends)] = GLOSS[name]
        if name in INSIDE:
            # Light reaches the front of an open mouth, but not its back.
            z = at[slice(*ends), 2]
            light[slice(*ends)] = 0.10 + 0.85 * smooth(z.max() - z, 0.030, 0.002)
    path, triangles = folder / "mesh.npz", surface.triangles
    if atlas is None:
        write_mesh(path, at, triangles, surface.painted_colours(), light, gloss)
        return
    has_gloss = ~np.isnan(atlas.gloss)
    gloss[triangles[has_gloss]] = atlas.gloss[has_gloss, None]
    maps = {"uv": atlas.uv, "see_through": atlas.see_through}
    write_mesh(path, at, triangles, surface.colours, light, gloss, maps)
    for name, picture in atlas.files.items():
        (folder / f"{name}.webp").write_bytes(picture)


def _write_fields(
    folder: Path, head: Head, points: dict[str, Point]
) -> tuple[tuple[int, ...], tuple[str, ...]]:
    """Write fields.npz; return the FAPs that shapes move, and notes for the report."""
    surface, ranges = head.surface, head.ranges
    at, (first, last) = surface.vertices, ranges["skin"]
    positions = {name: point.place for name, point in points.items()}
    apply_zones(folder, default_setup(at, surface.triangles, positions, (first, last)))
    with np.load(folder / "fields.npz") as file:
        stored: dict[str, Any] = {name: file[name] for name in file.files}
    rows = unpack(stored, len(at))
    shaped = _shaped_skin(surface, ranges, points, rows)
    shape_rows = shape_fields(shaped)
    notes = _jaw(shaped, surface, ranges, rows, stored, points, shape_rows)
    for fap, field in shape_rows.items():
        rows[fap] = extend_field(at, ranges, field, rows[fap])
    if head.painted:
        rows |= _gaze_rows(surface, ranges)
    fit = ball_behind if head.painted else fit_ball
    eyes = [fit(at[slice(*ranges[part])]) for part in ("left_eye", "right_eye")]
    lids = sliding(rows, at, ranges, eyes)
    if head.painted:
        lids = (lids[0][:0], lids[1][:0], lids[2][:0])
    centres = [centre for centre, _ in eyes]
    pivots = stored["jaw_pivot"], stored["head_pivot"]
    write_fields(folder / "fields.npz", rows, stored["head"], *pivots, centres, lids)
    jaw = () if shaped.move("jawOpen") is None else (3,)
    return tuple(sorted({*jaw, *shape_rows})), notes


def _shaped_skin(
    surface: Surface, ranges: dict[str, tuple[int, int]], points: dict[str, Point], rows: dict[int, Float64]
) -> ShapedSkin:
    at, (first, last) = surface.vertices, ranges["skin"]
    skin = surface.subset(np.arange(first, last))
    positions = {name: point.place for name, point in points.items()}
    sides = split_sides(at, surface.triangles, positions, (first, last))
    upper = sides["upper_lip"] - first
    lids = {}
    for side, word in ((1, "left"), (-1, "right")):
        lids[side] = np.zeros(last - first)
        lids[side][sides[f"upper_lid_{word}"] - first] = 1
    mouth = mouth_of(skin.vertices, skin.triangles, positions, upper)
    vertex = {name: point.vertex - first for name, point in points.items() if first <= point.vertex < last}
    zones = {fap: field[first:last] for fap, field in rows.items()}
    return ShapedSkin(skin.vertices, skin.triangles, skin.moves, positions, vertex, mouth, lids, zones)


def _jaw(
    shaped: ShapedSkin, surface: Surface, ranges: dict[str, tuple[int, int]], rows: dict[int, Float64],
    stored: dict[str, Any], points: dict[str, Point], shape_rows: dict[int, Float64],
) -> tuple[str, ...]:  # fmt: skip
    """Replace the fields of the jaw's opening, thrust and shift where the head has shapes for them."""
    first, last = ranges["skin"]
    chin = points["2.1"].vertex
    notes: tuple[str, ...] = ()
    opening = shaped.move("jawOpen")
    if opening is not None:
        displacement, default = surface.move("jawOpen"), np.asarray(stored["jaw_pivot"], float)
        # Teeth move rigidly with the jaw bone, skin follows less.
        bone = slice(*ranges.get("lower_teeth", (0, 0)))
        bone = bone if np.abs(displacement[bone]).max(initial=0) > 0.004 else slice(first, last)
        pivot, found = joint_of(surface.vertices[bone], displacement[bone], default, shaped.eyes)
        suffix = "" if found else ", by proportions"
        notes = (f"the jaw turns about {np.round(pivot, 3).tolist()}{suffix}",)
        stored["jaw_pivot"] = pivot
        # FAP 3 is the shape without the lips.
        weight = np.zeros(len(surface.vertices))
        weight[first:last] = drag_of(shaped.skin, opening, pivot, chin - first) * (1 - shaped.lip_share)
        weight[first:last] /= max(float(weight[chin]), 1e-6)
        weight = np.clip(weight, 0, 1)
        for part in ("lower_teeth", "tongue"):
            if part in ranges:
                weight[slice(*ranges[part])] = 1
        weight = extend_field(surface.vertices, ranges, weight[first:last, None], weight[:, None])[:, 0]
        rows |= opening_rows(surface.vertices, pivot, weight)
    thrust = shaped.move("jawForward")
    sideways = shaped.move("jawRight", "jawLeft")
    for fap, shape in (
        (14, None if thrust is None else thrust * [0, 0, 1]),
        (
            15,
            None if sideways is None else (shaped.moves["jawRight"] - shaped.moves["jawLeft"]) * [1.0, 0, 0],
        ),
    ):
        field = None if shape is None else shaped.exact(fap, shape)
        if field is not None:
            shape_rows[fap] = field
    return notes


def _gaze_rows(surface: Surface, ranges: dict[str, tuple[int, int]]) -> dict[int, Float64]:
    """Return the fields of FAPs 23 to 26 in metres per radian, from the eyeLook shapes, for painted eyes."""
    rows = {}
    for part, word, yaw, pitch, left in (
        ("left_eye", "Left", 23, 25, "Out"), ("right_eye", "Right", 24, 26, "In"),
    ):  # fmt: skip
        right = "In" if left == "Out" else "Out"
        _, radius = ball_behind(surface.vertices[slice(*ranges[part])])
        for fap, one, other in ((yaw, left, right), (pitch, "Down", "Up")):
            move = (surface.move(f"eyeLook{one}{word}") - surface.move(f"eyeLook{other}{word}")) / 2
            size = float(np.linalg.norm(move, axis=1).max())
            angle = float(np.arcsin(np.clip(size / max(radius, 1e-6), 0.1, 0.9)))
            rows[fap] = move / angle
    return rows


def measure_units(face: Face, surface: Surface) -> dict[int, UnitMeasurement]:
    """Return the displacement units that the shapes contain, on the left half of the skin.

    Raises:
        FaceError: the points of the mouth are not in order from the middle to the left corner.
    """
    first, last = face.parts["skin"]
    skin = face.vertices[first:last].astype(np.float64)
    half = skin[:, 0] > -1e-6
    visible = face.occlusion[first:last][half] > OPEN
    upper = shares(face, fit_mouth(face))[first:last][half]
    out = {}
    for unit in units().values():
        move = _mixed(surface, unit.mixture) if unit.kind == "displacement" else None
        if move is not None and move[first:last][half].any():
            out[unit.au] = UnitMeasurement(unit.au, skin[half], move[first:last][half], visible, upper)
    return out


def _mixed(surface: Surface, mixture: dict[str, float]) -> Float64 | None:
    """Return the sum of weighted shapes of both sides, or None if a shape is missing."""
    out = np.zeros_like(surface.vertices)
    for name, weight in mixture.items():
        sides = (name,) if name in surface.moves else (f"{name}Left", f"{name}Right")
        if any(side not in surface.moves for side in sides):
            return None
        for side in sides:
            out += weight * surface.moves[side]
    return out
