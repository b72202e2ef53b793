"""A coarse mask with lips, lids and a tongue, numbered as the base mesh numbers them."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from realizer.face.features import NAMES
from realizer.face.load import folder_of, load_face
from realizer_studio.faces.parts import Part
from realizer_studio.faces.person import fap_fields, lids, lips, skin_colours
from realizer_studio.faces.person.bust import assemble
from realizer_studio.faces.person.makehuman import BaseMesh, Figure
from realizer_studio.faces.person.person import Person
from realizer_studio.faces.person.recipe import Recipe
from realizer_studio.faces.skin.maps import SkinMaps, bake
from realizer_studio.faces.skin.skin import Skin
from realizer_studio.faces.skin.skin_atlas import corners
from realizer_studio.faces.skin.texels import Texels

STEP = 0.006  # m between the vertices of the mask
COUNT = 13_400  # above the highest number that the rings have
MOUTH, EYE = np.array([0, -0.072]), np.array([0.031, 0.0])
# Feature points on the rings of the mouth: inner point, outer point, place on the ring.
ON_LIPS = (
    ("2.2", "8.1", 0), ("2.3", "8.2", 19), ("2.4", "8.3", 9), ("2.5", "8.4", 29),
    ("2.6", "8.5", 3), ("2.7", "8.6", 35), ("2.8", "8.7", 16), ("2.9", "8.8", 22),
)  # fmt: skip
ON_LIDS = {"3.1": ("3.2", 7), "3.3": ("3.4", 21), "3.11": ("3.8", 14), "3.7": ("3.12", 0)}


def curved(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return places (..., 3) on the front of a head."""
    return np.stack([x, y, 0.03 - 6 * x**2 - 1.5 * (y + 0.05) ** 2], -1)


def mouth_ring(k: int) -> np.ndarray:
    """Return ring k of the mouth (38, 3) from the middle of the upper lip to the left corner and around."""
    half = np.concatenate([np.linspace(0, np.pi / 2, 10), np.linspace(np.pi / 2, np.pi, 11)[1:]])
    turn = np.concatenate([half, -half[-2:0:-1]])
    wide, tall = 0.022 + 0.0008 * k, 0.0005 + 0.0012 * k
    return curved(MOUTH[0] + wide * np.sin(turn), MOUTH[1] + tall * np.cos(turn)) + np.array([0, 0, 0.004])


def lid_ring(k: int) -> np.ndarray:
    """Return ring k of the left eye (28, 3) from its outer corner over the upper lid."""
    turn = np.arange(28) * 2 * np.pi / 28
    wide, tall = 0.014 + 0.0015 * k, 0.0045 + 0.002 * k
    return curved(EYE[0] + wide * np.cos(turn), EYE[1] + tall * np.sin(turn)) + np.array([0, 0, 0.004])


class Mask:
    """Vertices and quads as they are collected."""

    def __init__(self) -> None:
        self.at = np.tile([0, -9.0, 0], (COUNT, 1))  # vertices of no part are far away
        numbered = {i for pair in (*lips.RINGS, *lids.RINGS) for i in pair}
        self.free = iter([i for i in range(COUNT) if i not in numbered])
        self.quads: dict[str, list[list[int]]] = {}

    def put(self, places: np.ndarray, numbers: tuple[int, ...] = ()) -> list[int]:
        index = [*numbers, *(next(self.free) for _ in range(len(places) - len(numbers)))]
        self.at[index] = places
        return index

    def join(self, rows: list[list[int]], part: str = "body", closed: bool = False) -> None:
        for low, high in pairwise(rows):
            for k in range(len(low) if closed else len(low) - 1):
                after = (k + 1) % len(low)
                self.quads.setdefault(part, []).append([low[k], low[after], high[after], high[k]])


@pytest.fixture(scope="session")
def figure() -> Figure:
    """A mask whose feature points lie about where people's do, with the shapes that fields are made of."""
    mask, points = Mask(), {}
    x, y = np.arange(-13, 14) * STEP, np.arange(-44, 17) * STEP
    sheet = [mask.put(curved(x, np.full_like(x, height))) for height in y]
    mask.join(sheet)
    mouth = [mask.put(mouth_ring(k), pair) for k, pair in enumerate(lips.RINGS)]
    mask.join(mouth, closed=True)
    left = [mask.put(lid_ring(k), pair) for k, pair in enumerate(lids.RINGS)]
    right = [mask.put(mask.at[ring] * [-1, 1, 1]) for ring in left]
    mask.join(left, closed=True)
    mask.join([ring[::-1] for ring in right], closed=True)
    depth = np.linspace(-0.04, 0.01, 9)
    across = np.linspace(-0.012, 0.012, 5)
    tongue = [mask.put(np.stack([across, np.full(5, -0.076), np.full(5, z)], 1)) for z in depth]
    mask.join(tongue, "helper-tongue")
    for inner, outer, place in ON_LIPS:
        points |= {inner: mouth[lips.MEET][place], outer: mouth[lips.BORDER][place]}
    for name, (twin, place) in ON_LIDS.items():
        points |= {name: left[0][place], twin: right[0][place]}
    points |= {"6.1": tongue[8][2], "6.2": tongue[5][2], "6.3": tongue[6][4], "6.4": tongue[6][0]}
    skin, face = np.concatenate(sheet), load_face("ada")
    for name in NAMES:
        if name not in points and name not in ("3.5", "3.6", "7.1", "9.8", "9.9", "9.10", "9.11", "11.5"):
            off = np.linalg.norm((mask.at[skin] - face.points[name])[:, :2], axis=1)
            points[name] = int(skin[np.argmin(off)])
    quads = {name: np.array(rows, np.int32) for name, rows in mask.quads.items()}
    mesh = BaseMesh(mask.at * 10, quads, *texture_of(mask.at, quads["body"]))
    return Figure(mesh, mask.at, points, shape_of(mask.at))


def texture_of(at: np.ndarray, quads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return texture coordinates like the head's, which lies on its side, and those of the quads' corners."""
    used, first, inverse = np.unique(quads, return_index=True, return_inverse=True)
    order = np.argsort(first)
    places = np.stack([0.8 - at[used[order], 1] / 2, 0.4835 + at[used[order], 0] / 2], 1)
    return places, np.argsort(order)[inverse].reshape(quads.shape).astype(np.int32)


def shape_of(at: np.ndarray) -> Callable[[str], np.ndarray]:
    """Return shapes by their names: bumps about the place that moves."""

    def bump(x: float, y: float, reach: float, way: tuple[float, float, float]) -> np.ndarray:
        return np.exp(-((at[:, :2] - [x, y]) ** 2).sum(axis=1) / reach**2)[:, None] * np.array(way)

    def shape(name: str) -> np.ndarray:
        side = -1 if name.endswith("Right") else 1
        made: np.ndarray = {
            "jawOpen": lambda: bump(0, -0.12, 0.05, (0, -0.02, -0.005)),
            "eyeBlink": lambda: bump(0.031 * side, 0.004, 0.012, (0, -0.009, 0)),
            "browInnerUp": lambda: bump(0, 0.025, 0.03, (0, 0.006, 0)),
            "browOuterUp": lambda: bump(0.04 * side, 0.025, 0.03, (0, 0.006, 0)),
            "cheekPuff": lambda: sum(bump(0.045 * s, -0.05, 0.02, (0.004 * s, 0, 0.004)) for s in (1, -1)),
            "cheekSquint": lambda: bump(0.038 * side, -0.03, 0.02, (0, 0.004, 0.002)),
            "mouthSmile": lambda: bump(0.026 * side, -0.072, 0.02, (0.004 * side, 0.006, 0)),
            "mouthStretch": lambda: bump(0.026 * side, -0.072, 0.02, (0.006 * side, -0.001, 0)),
        }[name.removesuffix("Left").removesuffix("Right")]()
        return made

    return shape


@pytest.fixture(scope="session")
def person(figure: Figure) -> Person:
    """The mask as a person."""
    centres = (np.array([s * 0.031, 0, 0.005]) for s in (1, -1))
    face = float(figure.point("11.1")[1] - figure.point("2.1")[1])
    balls = tuple((centre, 0.012) for centre in centres)
    jaw, head = np.array([0, -0.03, -0.05]), np.array([0, -0.08, -0.06])
    return Person(figure, balls, face, jaw, head, floor=-0.25, arch=(0.02, 0.03))


@pytest.fixture(scope="session")
def mask_lips(figure: Figure) -> lips.Lips:
    return lips.Lips(figure)


@pytest.fixture(scope="session")
def mask_lids(figure: Figure) -> list[lids.Lid]:
    """The lids of the left and the right eye."""
    return [lids.Lid(figure, side) for side in (1, -1)]


@pytest.fixture(scope="session")
def recipe() -> Recipe:
    """A recipe with ada's colours, plain hair and the plain look."""
    colours = tomllib.loads((folder_of("ada") / "recipe.toml").read_text("utf-8"))["colours"]
    return Recipe("A mask", {}, colours)


@pytest.fixture(scope="session")
def parts(person: Person, mask_lips: lips.Lips, mask_lids: list[lids.Lid], recipe: Recipe) -> list[Part]:
    """The bust of the mask in full light: baked shadows would take most of the time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(skin_colours, "occlusion", lambda vertices, *_: np.ones(len(vertices)))
        return assemble(person, mask_lips, mask_lids, recipe)


@pytest.fixture(scope="session")
def maps(
    person: Person, mask_lips: lips.Lips, mask_lids: list[lids.Lid], recipe: Recipe, parts: list[Part]
) -> SkinMaps:
    """The maps of the mask, small."""
    return bake("mask", person, mask_lips, mask_lids, recipe, parts[0], 256)


@pytest.fixture(scope="session")
def fields(figure: Figure, person: Person) -> dict[int, np.ndarray]:
    """The fields of the mask as they are before triangles that turn over are mended."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fap_fields, "without_flips", lambda fields, *_: dict(fields))
        return fap_fields.face_fields(figure, person.jaw_pivot)[0]


@pytest.fixture(scope="session")
def skin(
    person: Person, mask_lips: lips.Lips, mask_lids: list[lids.Lid], recipe: Recipe, parts: list[Part]
) -> Skin:
    """The skin of an old mask with freckles and stubble, on small maps."""
    part = parts[0]
    assert part.patch is not None
    texels = Texels(part.vertices, part.triangles, corners(person.figure.mesh, part.patch), 256)
    old = Recipe("An old mask", {}, recipe.colours, {}, {"age": 0.8, "freckles": 1.0, "stubble": 0.8})
    return Skin(texels, part, person, mask_lips, mask_lids, old, seed=5)
