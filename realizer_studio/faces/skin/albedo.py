"""The albedo map of a skin, painted in layers."""

from functools import partial
from typing import Any

import numpy as np

from realizer.core.array_types import Float32
from realizer_studio.faces.hair.brows import Brow, tint_of
from realizer_studio.faces.hair.strands import shadow
from realizer_studio.faces.hair.style import colour_of, style_of
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.person import skin_colours
from realizer_studio.faces.person.scalp import Scalp
from realizer_studio.faces.skin.noise import ridges
from realizer_studio.faces.skin.skin import Skin

EDGE = 0.0012  # m, of the noise in large spots
NEAR = np.array([0.035, 0.018])  # m around the middle of a brow
BROW = 0.8  # opacity of the paint between the hairs of brows
LASHES = 0.75, 0.35  # opacity of the paint at the roots of upper and lower lashes


def paint_albedo(skin: Skin, pores: Float32, lines: Float32) -> Float32:
    """Return the colour of the skin (k, 3), sRGB 0..255.

    Args:
        pores: (k,) 0..1, darkness of pores; lines: (k,) 0..1, depth of lines.
    """
    out = skin.texels.spread(skin.part.colours)
    _mottle(skin, out)
    out *= (1 - pores)[:, None]
    out *= 1 - lines[:, None] * Skin.float([0.10, 0.17, 0.20])
    _vessels(skin, out)
    _spots(skin, out)
    _lips(skin, out)
    _beard(skin, out)
    _scalp(skin, out)
    _brows(skin, out)
    _margins(skin, out)
    _mouth(skin, out)
    return np.clip(out, 0, 255)


def _mottle(skin: Skin, out: Float32) -> None:
    number = 10
    for name in ("blood", "melanin"):
        row = skin.table[name]
        change = sum(
            share * skin.noise(length, number + k)
            for k, (length, share) in enumerate(zip(row["lengths"], row["share"], strict=True))
        )
        number += 2
        out *= 1 + np.clip(change, -0.08, 0.08)[:, None] * Skin.float(row["tint"])
    row = skin.table["speckle"]
    out *= (1 + row["share"] * skin.noise(row["length"], number))[:, None]


def _vessels(skin: Skin, out: Float32) -> None:
    """Tint veins at temples and lids, and capillaries of cheeks and nose, which grow with age."""
    temples = skin.around("3.7", "3.12", radii=(0.028, 0.034, 0.05), offset=(0.018, 0.018, -0.02))
    lids = skin.around("3.1", "3.2", "3.3", "3.4", radii=(0.020, 0.012, 0.02))
    flushed = skin.around("5.3", "5.4", "9.1", "9.2", radii=(0.026, 0.022, 0.03))
    for name, where in (
        ("veins", 0.8 * temples + 0.6 * lids),
        ("capillaries", flushed * (0.15 + 0.6 * skin.look.age)),
    ):
        row = skin.table[name]
        length, number = row["length"], skin.seed + len(name)
        line = skin.within(where > 0.01, partial(ridges, length=length, seed=number))
        line = line * np.clip(0.5 + 0.6 * skin.noise(length * 2, 20 + len(name)), 0, 1)
        out *= 1 - (line * np.clip(where, 0, 1))[:, None] * (1 - Skin.float(row["tint"]))


def _spots(skin: Skin, out: Float32) -> None:
    look = skin.look
    dry = skin.dry * (1 - skin.red)
    sunny = skin.around("5.3", "5.4", "9.3", "9.12", radii=(0.045, 0.032, 0.06))
    upper = skin.float(smooth(skin.at[:, 1], -0.17, -0.05))
    for name, where, number, firm in (
        ("freckles", (sunny * look.freckles + 0.012 * upper) * dry, 30, 0.5),
        ("spots", upper * dry * look.age, 31, 0.2),
        ("moles", dry * look.moles, 32, 0.6),
    ):
        found, radius = skin.mark(name, where, number)
        share = skin.texels.stamp(found, radius, partial(_disc, firm))
        share *= np.clip(0.75 + 0.25 * skin.noise(EDGE, 34, share), 0.2, 1)
        out *= 1 - share[:, None] * (1 - Skin.float(skin.table[name]["tint"]))


def _disc(firm: float, distance: Any) -> Any:
    return smooth(distance, 1.0, firm)


def crease(skin: Skin) -> Float32:
    """Return the creases across the lips, 0..1 (k,), in the coordinates of the lips."""
    along = skin.field(skin.lips.u) * 0.025
    coordinates = np.stack([along, 0.0005 * skin.ring, np.zeros_like(along)], 1)
    length = skin.table["lips"]["crease"]

    def field(at: Any) -> Any:
        fine = ridges(at, (length, 0.004, 1.0), skin.seed + 40)
        return np.maximum(0.7 * fine, ridges(at, (length * 2.2, 0.006, 1.0), skin.seed + 41))

    return skin.red * skin.within(skin.red, field, coordinates)


def _lips(skin: Skin, out: Float32) -> None:
    look, row = skin.look, skin.table["lips"]
    u, upper = np.abs(skin.field(skin.lips.u)), skin.field(skin.lips.is_upper)
    strength = look.lips * (1 - 0.25 * look.age)
    full = strength + (1 - strength) * 0.75 * smooth(skin.ring, 4.0, 1.0)
    share = skin.red * skin.float(full * (1 - 0.55 * smooth(u, 0.85, 1.0)))
    # The upper lip faces down and is darker; the red is strongest where the lips meet.
    tone = (1 - 0.06 * upper) * (1 - 0.05 * smooth(skin.ring, 5, 1)) * (1 - row["dark"] * crease(skin))
    tone = tone * (1 + 0.03 * skin.noise(0.0016, 42, skin.red))
    colour = Skin.float(skin.recipe.colours["lips"]) * skin.float(tone)[:, None]
    out += share[:, None] * (colour - out)
    # A pale line around the red.
    rim = np.exp(-(((skin.ring - 8.0) / 0.7) ** 2)) * skin.dry
    out *= 1 + 0.035 * skin.float(rim * (1 - look.age))[:, None]
    out *= skin.float(1 - 0.42 * smooth(skin.ring, 2.3, 0.6) * (skin.ring < 3) * skin.dry)[:, None]


def _margins(skin: Skin, out: Float32) -> None:
    edge, caruncle = skin.margins()
    # The wet edge of a lid is pink; between it and the lashes the skin keeps its colour.
    share = np.maximum(0.45 * smooth(edge, 0.35, 0.9), 0.7 * caruncle)
    out += skin.float(share)[:, None] * (Skin.float(skin.recipe.colours["corner"]) * 0.92 - out)
    rooted = np.zeros(len(skin.person.figure.at))
    for lid in skin.lids:
        for row, share in zip((lid.lower, lid.upper), LASHES[::-1], strict=True):
            rooted[row[2:-1]] = share
    roots = skin.field(rooted)
    out += skin.float(roots * smooth(edge, 0.15, 0.6) * (1 - caruncle))[:, None] * (
        Skin.float(skin.recipe.colours["lashes"]) - out
    )


def _brows(skin: Skin, out: Float32) -> None:
    figure, look = skin.person.figure, skin.look
    points = {name: figure.point(name) for name in figure.points}
    colour = Skin.float(0.9 * tint_of(skin.recipe.colours["brows"], look))
    for side in (1, -1):
        line = Brow(points, side, look)
        near = np.abs(skin.at[:, :2] * [side, 1] - [points["4.3"][0], points["4.3"][1]]) < NEAR
        mask = near.all(axis=1) & (skin.at[:, 2] > points["3.7"][2] - NEAR[1])

        def shade(at: Any, line: Brow = line, side: int = side) -> Any:
            return line.shade(at[:, :2] * np.array([side, 1.0]), skin.seed + 46)

        out += (BROW * skin.within(mask, shade))[:, None] * (colour - out)


def _beard(skin: Skin, out: Float32) -> None:
    grown = min(1.0, 2 * skin.look.beard)  # skin does not show through a beard
    amount = max(skin.look.stubble, grown)
    if not amount:
        return
    where = skin.field(skin_colours.beard(skin.person.figure, skin.lips)) * (1 - skin.red) * skin.dry
    where *= np.clip(1 + 0.25 * skin.noise(0.006, 43), 0.7 * grown, 1.2)
    hair = Skin.float(colour_of(style_of(skin.recipe.hair), skin.recipe.colours["hair"]))
    shade = (np.clip(where, 0, 1) * amount * 0.30 + smooth(where, 0.3, 0.8) * grown * 0.65)[:, None]
    out += shade * (hair * (0.6 + 0.15 * grown) + (1 - grown) * Skin.float([30, 36, 40]) - out)
    _dots(skin, out, "stubble", np.clip(where * 1.6, 0, 1) * min(1.0, amount * 2), hair)


def _dots(skin: Skin, out: Float32, name: str, where: Any, colour: Float32) -> None:
    """Paint the roots of hairs."""
    row = skin.table[name]
    found, radius = skin.mark(name, where, 44)
    radius = np.maximum(radius, 0.8 * skin.texels.width[found])
    share = skin.texels.stamp(found, radius, lambda distance: smooth(distance, 1.0, 0.1)) * row["share"]
    out += share[:, None] * (colour * 0.8 - out)


def _scalp(skin: Skin, out: Float32) -> None:
    patch, figure, style = skin.part.submesh, skin.person.figure, style_of(skin.recipe.hair)
    points = {name: figure.point(name) for name in figure.points}
    scalp = Scalp(patch.positions(figure.at), patch.triangles, points, style.line, style.rise)
    ragged = 0.004 * skin.noise(0.005, 45)
    where = np.clip(skin.texels.broad(partial(shadow, scalp, style)) * (1 + 40 * ragged), 0, 1)
    hair = Skin.float(colour_of(style, skin.recipe.colours["hair"]))
    out += (0.45 * where)[:, None] * (hair - out)
    _dots(skin, out, "roots", where, hair)


def _mouth(skin: Skin, out: Float32) -> None:
    """Paint the lining of the mouth, which is red and darkens to the back."""
    front = float(skin.person.figure.point("2.2")[2])
    lining = skin_colours.lining(skin.recipe.colours, front - skin.at[:, 2])
    share = skin.float(smooth(skin.ring, 1.0, 0.3) * ~skin.dry)[:, None]
    out += share * (skin.float(lining) - out)
