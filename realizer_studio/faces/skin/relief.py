"""The relief map of a skin (pores, fine lines, wrinkles, folds of expressions) and its surface map."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from realizer.core.array_types import Float32
from realizer.face.mesh_geometry import vertex_normals
from realizer.tables import toml_table
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.skin.albedo import crease
from realizer_studio.faces.skin.lines import Line, engrave
from realizer_studio.faces.skin.noise import ridges
from realizer_studio.faces.skin.skin import Skin, distance_through

# Depth in metres of the darkest lines below their surroundings; radius of these surroundings in texels.
DEEP, AROUND = 0.00018, 6.0


@dataclass(frozen=True, eq=False)
class Relief:
    """Heights of a skin at its texels."""

    rest: Float32  # (k,) metres at rest
    folds: Float32  # (k,) metres, of the complete folds of all expressions
    pores: Float32  # (k,) 0..1, depth of pores
    lines: Float32  # (k,) 0..1, depth of lines at rest


def relief_of(skin: Skin, lines: list[Line]) -> Relief:
    """Return the relief of a skin with these lines."""
    rest, folds = engrave(skin, lines)
    table = toml_table("skin_lines.toml")
    rest += _neck(skin, table["neck"])
    fan, fold = _around_mouth(skin, table["around_mouth"])
    rest, folds = rest + fan, np.minimum(folds, fold)
    dimples = table["dimples"]
    chin = skin.around("2.10", radii=(0.022, 0.017, 0.03))
    folds = folds + dimples["depth"] * chin * skin.noise(dimples["length"], 60) * 0.6
    deep = np.clip((skin.texels.blurred(rest, AROUND) - rest) / DEEP, 0, 1)
    slack, loose = table["slack"], skin.look.age * _loose(skin)
    for k, length in enumerate(slack["lengths"]):
        net = skin.within(loose > 0, partial(ridges, length=length, seed=skin.seed + 61 + k))
        rest = rest - slack["depth"] * net * loose
    pores, holes = _pores(skin)
    rest = rest - holes - _network(skin) - skin.table["lips"]["depth"] * crease(skin)
    rest = rest + _bumps(skin)
    return Relief(skin.float(rest), skin.float(folds), skin.float(pores), skin.float(deep))


def _loose(skin: Skin) -> Float32:
    """Return the weight (k,) 0..1 of skin that age loosens: below the eyes, beside the mouth, on the neck."""
    eyes = skin.around("3.3", "3.4", "3.7", "3.12", radii=(0.032, 0.024, 0.04), offset=(0, -0.008, 0))
    mouth = skin.around("8.3", "8.4", radii=(0.035, 0.040, 0.05), offset=(0.01, -0.01, 0))
    neck = skin.float(smooth(skin.at[:, 1], -0.10, -0.13))
    return skin.float(np.clip(0.25 + eyes + 0.7 * mouth + neck, 0, 1)) * skin.dry * (1 - skin.red)


def _network(skin: Skin) -> Any:
    row = skin.table["network"]
    fine, wide = (ridges(skin.at, length, skin.seed + 64 + k) for k, length in enumerate(row["lengths"]))
    return row["depth"] * (fine + wide) * skin.dry * (1 - 0.7 * skin.red)


def _pores(skin: Skin) -> tuple[Any, Any]:
    """Return the darkness of pores, (k,) 0..1, and their depth, (k,) metres."""
    row, where = skin.table["pores"], skin.pored()
    dark, deep = np.zeros((2, len(where)), np.float32)
    open_skin = skin.dry * (1 - skin.red)
    for k, mask in enumerate((where, 1 - where)):
        apart = row["apart"][k]
        rng = skin.rng(66 + k)
        # About as many pores as fit.
        found = skin.texels.scatter(skin.float(mask * open_skin / apart**2), apart * 0.7, rng)
        radius = row["radius"][k] * rng.uniform(0.75, 1.25, len(found))
        radius = np.maximum(radius, 1.1 * skin.texels.width[found])
        hole = skin.texels.stamp(found, skin.float(radius), lambda distance: (1 - distance**2) ** 2)
        hole *= np.clip(0.8 + 0.15 * skin.noise(0.004, 68 + k), 0.3, 1.2)
        dark, deep = np.maximum(dark, row["dark"][k] * hole), np.maximum(deep, row["depth"][k] * hole)
    return dark, deep


def _bumps(skin: Skin) -> Any:
    found, radius = skin.mark("moles", skin.dry * skin.look.moles, 32)
    bump = skin.texels.stamp(found, radius, lambda distance: smooth(distance, 1.0, 0.2))
    return bump * skin.table["moles"]["height"]


def _neck(skin: Skin, row: dict[str, Any]) -> Any:
    """Return the lines around the neck."""
    chin = skin.person.figure.point("2.1")
    below = chin[1] - 0.015 - (skin.at[:, 1] + 0.35 * (skin.at[:, 2] - chin[2] + 0.05))
    below = below + 0.0025 * skin.noise(0.030, 70) + 0.0006 * skin.noise(0.006, 71)
    number = np.round(below / row["apart"])
    distance = np.abs(below - number * row["apart"])
    extent = smooth(below, 0.4 * row["apart"], row["apart"]) * smooth(below, 0.13, 0.08)
    front = smooth(skin.at[:, 2] - chin[2], -0.16, -0.10)
    uneven = np.clip(0.5 + 0.5 * skin.noise(0.022, 72), 0, 1)
    depth = row["depth"] * (row["young"] + (1 - row["young"]) * skin.look.age)
    groove = np.exp(-((distance / row["width"]) ** 2))
    return skin.float(-depth * groove * extent * front * uneven) * skin.dry


def _around_mouth(skin: Skin, row: dict[str, Any]) -> tuple[Float32, Float32]:
    """Return the heights of the lines around the lips in metres, of the face at rest and of pursed lips."""
    lips = skin.lips
    along, distance = skin.field(lips.u) * 0.030, skin.field(lips.distance)
    coordinates = np.stack([along, distance / 3, skin.field(lips.is_upper * 0.05)], 1)
    reach = row["long"] * np.clip(0.8 + 0.3 * skin.noise(0.006, 74), 0.3, 1.3)
    reach = reach * (0.6 + 0.4 * skin.field(lips.is_upper * 1.0))
    cover = smooth(skin.ring, 6.5, 8.5) * np.clip(1 - distance / reach, 0, 1) * skin.dry
    cover = cover * smooth(np.abs(skin.field(lips.u)), 1.0, 0.85)
    fan = partial(ridges, length=(row["apart"] * 0.7, 0.006, 0.02), seed=skin.seed + 73)
    line = skin.within(cover, fan, coordinates)
    fold = skin.float(-row["depth"] * line * cover)
    return fold * row["age"] * np.float32(skin.look.age), fold


CAVITY = 1500.0  # share of the light that is lost per metre of depth below the surroundings
CAVITY_AROUND = 6.0  # radius of these surroundings in texels
EVEN, MATT = 0.6, 0.35  # brightness of skin, 0..1, below which it is rougher; roughness per brightness
WET, TEARS = 0.35, 0.14  # roughness of the lining of the mouth, and of the lids' edges


def surface_of(skin: Skin, relief: Relief) -> Float32:
    """Return occlusion, roughness and thickness of the texels, (k, 3) 0..1."""
    return np.stack([_cavities(skin, relief), _roughness(skin), _thickness(skin)], 1)


def _cavities(skin: Skin, relief: Relief) -> Float32:
    below = skin.texels.blurred(relief.rest, CAVITY_AROUND) - relief.rest
    return skin.float(np.clip(1 - CAVITY * np.maximum(below, 0), 0.6, 1))


def _roughness(skin: Skin) -> Float32:
    row = skin.table["roughness"]
    lids = skin.around("3.1", "3.2", "3.3", "3.4", radii=(0.020, 0.010, 0.02))
    out = row["cheek"] + (row["oily"] - row["cheek"]) * skin.oily()
    out = out + (row["lids"] - out) * np.clip(lids, 0, 1) * 0.6
    # Dark skin gets weaker highlights, because strong ones would look wet.
    dark = EVEN - float(np.mean(skin.recipe.colours["skin"])) / 255
    out = out + 0.06 * skin.look.age + MATT * max(0.0, dark)
    out = out + row["fine"] * (skin.noise(0.0012, 80) + 0.5 * skin.noise(0.005, 81))
    out = out + (row["lips"] + 0.03 * skin.noise(0.0010, 82, skin.red) - out) * skin.red
    wet = smooth(skin.ring, 2.0, 1.0)
    tears = np.maximum(*skin.margins())
    out = out + (WET - out) * wet
    return skin.float(np.clip(out + (TEARS - out) * tears, 0.12, 1))


def _thickness(skin: Skin) -> Float32:
    full = skin.table["thickness"]["full"]
    part = skin.part
    normals = vertex_normals(part.vertices, part.triangles)
    # No light passes from inside the mouth.
    outside = np.flatnonzero(part.submesh.mix @ (~skin.lips.inside * 1.0) > 0.5)
    through = distance_through(part.vertices, normals, outside, full) / full
    # Light passes through ears and nose only: behind lids and lips are eyes and teeth.
    ears = skin.around("10.1", "10.2", "10.3", "10.4", "10.7", "10.8", radii=(0.04, 0.04, 0.04))
    wings = skin.around("9.1", "9.2", radii=(0.016, 0.014, 0.016))
    airy = np.clip(2 * np.maximum(ears, wings), 0, 1)
    return skin.float(1 - airy * (1 - np.clip(skin.texels.spread(through), 0, 1)))
