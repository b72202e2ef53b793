"""Displacement fields of FAPs beyond their limits (`basis.LIMITS`), which move more of the surrounding skin.

A feature point that moves further than action units request stretches skin over a wider area; with the area
of smaller movements the skin would fold over.
"""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.basis import BEYOND
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.person.lips import Lips
from realizer_studio.faces.person.makehuman import FORWARD, LEFT, UP, Figure, scaled

LIDS = ("3.1", "3.3"), ("3.2", "3.4")
FOREHEAD, SOCKET, BRIDGE = 0.036, 0.020, 0.022  # m above the brows, below them, and between them downwards
CLIMB, BESIDE = 0.45, 0.010  # metres forwards per metre sideways of skin beside the bridge; m beside it
GLABELLA = -0.6, -0.35, -0.05  # metres forwards per metre sideways at the other brow, the middle, the brow
TEMPLE, BEHIND = 0.012, -0.03  # m beyond the outer end of a brow; z behind which skin does not move
PUFFED = np.array([0.034, 0.0, 0.010]), (0.050, 0.046, 0.052)  # m inwards, down and back; half axes
LIFTED, ABOVE, BULGE = (0.040, 0.036, 0.045), 0.004, 0.6  # m; m; metres forwards per metre upwards
SQUINT = 0.55, 0.25  # metres that the lower lid rises and the upper one falls per metre of the cheek
STRETCHED = 0.014  # m of additional skin beside and below the nose
FLANK = 0.045  # m beyond a wing of the nose, or beyond the corners of the lips
RAISED = 0.006, (0.030, 0.026, 0.036), 0.4  # m below the boss of the chin; half axes; metres forwards
ROOT = 0.010  # m above the eyes, where skin that moves up with the nose ends
BACK = 0.35  # metres backwards per metre outwards of a wing of the nose


def far_fields(figure: Figure, lips: Lips, near: Mapping[int, Float64]) -> dict[int, Float64]:
    """Return BEYOND + FAP -> the field (n, 3) of its movement beyond its limit.

    Args:
        near: FAP -> the field (n, 3) of its movement up to its limit.
    """
    far = _brows(figure) | _cheeks(figure, lips, near) | _nose(figure, lips) | _mouth(figure, lips, near)
    return {BEYOND + fap: field for fap, field in far.items()}


def _off_lids(figure: Figure, radii: tuple[float, float, float]) -> Float64:
    """Return 0 on the lids of both eyes, 1 elsewhere, (n,)."""
    eyes = [figure.ellipsoid((figure.point(a) + figure.point(b)) / 2, radii, 0.5) for a, b in LIDS]
    return np.asarray(1 - np.maximum(*eyes))


def _brows(figure: Figure) -> dict[int, Float64]:
    """Return the fields of FAPs 37 and 38, which move a brow sideways and compress the skin between both."""
    at, out = figure.at, {}
    inner, middle, outer = stations = [figure.point(name) for name in ("4.1", "4.3", "4.5")]
    across = [p[0] for p in stations]
    line = np.interp(np.abs(at[:, 0]), across, [p[1] for p in stations])
    above = at[:, 1] - line
    below = np.where(np.abs(at[:, 0]) < inner[0], BRIDGE, SOCKET)
    high = np.where(above > 0, smooth(above, FOREHEAD, 0.004), smooth(-above / below, 1.0, 0.2))
    high *= figure.body & (at[:, 2] > BEHIND)
    slopes = [(p[2] - q[2]) / (q[0] - p[0]) for p, q in pairwise(stations)]
    knots = [-inner[0], 0, inner[0], (inner[0] + middle[0]) / 2, (middle[0] + outer[0]) / 2]
    for number, name, side in ((37, "4.1", 1), (38, "4.2", -1)):
        x = at[:, 0] * side
        share = smooth(x, -0.7 * inner[0], inner[0]) * smooth(x, outer[0] + TEMPLE, inner[0])
        rise = np.interp(x, knots, [*GLABELLA, *slopes])
        rise += CLIMB * smooth(-above, 0.002, 0.012) * smooth(np.abs(x - BESIDE), 0.014, 0.004)
        field = (share * high * _off_lids(figure, (0.026, 0.010, 0.03)))[:, None]
        field = figure.smoothed(field * (-side * LEFT + rise[:, None] * FORWARD), 3)
        out[number] = scaled(field, figure.points[name], -side * LEFT)
    return out


def _cheeks(figure: Figure, lips: Lips, near: Mapping[int, Float64]) -> dict[int, Float64]:
    at, points, out = figure.at, figure.points, {}
    free = smooth(lips.distance, 0.002, 0.030)
    for side, number, name in ((1, 39, "5.1"), (-1, 40, "5.2")):
        inwards, radii = PUFFED
        position = figure.point(name)
        outward = at - (position - inwards * np.array([side, 1, 1]))
        outward /= np.maximum(np.linalg.norm(outward, axis=1), 0.010)[:, None]
        dome = figure.ellipsoid(position, radii) * free * _off_lids(figure, (0.028, 0.020, 0.04))
        out[number] = scaled(figure.smoothed(dome[:, None] * outward, 4), points[name], side * LEFT)
    for number, name, lid in ((41, "5.3", 21), (42, "5.4", 22)):
        mound = figure.ellipsoid(figure.point(name) + ABOVE * UP, LIFTED, 0.15) * free
        mound *= _off_lids(figure, (0.025, 0.018, 0.03))
        field = figure.smoothed(mound[:, None] * (UP + BULGE * FORWARD), 3)
        field += SQUINT[0] * near[lid] + SQUINT[1] * near[lid - 2]
        out[number] = scaled(field, points[name], UP)
    return out


def _nose(figure: Figure, lips: Lips) -> dict[int, Float64]:
    at, points, free = figure.at, figure.points, 1 - lips.lips
    out = {}
    movable = _off_lids(figure, (0.024, 0.019, 0.03)) * free * figure.body * (at[:, 2] > -0.02)
    tip, lip = figure.point("9.3"), figure.point("8.1")
    for number, name, side in ((61, "9.1", 1), (62, "9.2", -1)):
        wing = figure.point(name)
        x = at[:, 0] * side
        wide = np.abs(wing[0])
        share = np.where(x < wide, np.clip(x / wide, 0, 1), smooth(x, wide + FLANK, wide))
        up = smooth(at[:, 1], wing[1] + 0.028, wing[1] + 0.004) * smooth(at[:, 1], lip[1], wing[1] - 0.008)
        direction = side * LEFT - BACK * np.clip(x / wide, 0, 1)[:, None] * FORWARD
        field = (share * up * movable)[:, None] * direction
        out[number] = scaled(figure.smoothed(field, 2), points[name], side * LEFT)
    base = figure.point("9.15")[1]
    up = np.interp(at[:, 1], [lip[1] - 0.002, base, tip[1], ROOT], [0, 1, 1, 0])
    # More of the stretched skin below the nose moves.
    spread = STRETCHED * smooth(at[:, 1], base + 0.006, base - 0.004)
    share = smooth(np.abs(at[:, 0]), abs(figure.point("9.1")[0]) + 0.018 + spread, 0.008 - spread / 2)
    field = (up * share * movable)[:, None] * UP
    out[63] = scaled(figure.smoothed(field, 3), points["9.3"], UP)
    return out


def _mouth(figure: Figure, lips: Lips, near: Mapping[int, Float64]) -> dict[int, Float64]:
    """Return the fields of the corners, which pull the cheeks, of a shifted jaw, and of the chin."""
    at, points, out = figure.at, figure.points, {}
    front = figure.body & (at[:, 2] > -0.05)
    fade = np.where(lips.fade > 0, lips.fade, front)
    for side, names, numbers in ((1, ("2.4", "8.3"), (6, 53)), (-1, ("2.5", "8.4"), (7, 54))):
        u = np.clip(lips.u * side, 0, 1)
        reach = 0.012 + (FLANK - 0.012) * smooth(u, 0.4, 1.0)
        share = u**1.4 * smooth(lips.distance / reach, 1.0, 0.0) * fade
        back = np.interp(u, [0, 0.5, 1], [0, -0.30, -0.62])
        field = share[:, None] * (side * LEFT + back[:, None] * FORWARD)
        field = np.where((lips.distance > 0.0005)[:, None], figure.smoothed(field, 3), field)
        for number, name, contour in zip(numbers, names, (1 - lips.w, lips.w), strict=True):
            out[number] = scaled(field * contour[:, None], points[name], side * LEFT)
    base, low = figure.point("9.15")[1], figure.point("8.2")[1] - 0.004
    level = smooth(at[:, 1], base + 0.004, low) * smooth(np.abs(at[:, 0]), 0.055, 0.020) * front
    shifted = np.maximum(-near[15][:, 0], level * fade)
    out[15] = scaled(figure.smoothed(shifted, 6)[:, None] * -LEFT, points["2.1"], -LEFT)
    # The chin rises rigidly, and its skin is pressed forwards.
    chin = figure.ellipsoid(figure.point("2.10") - RAISED[0] * UP, RAISED[1]) * (1 - lips.lips)
    raised = figure.smoothed(chin[:, None] * (UP + RAISED[2] * FORWARD), 2)
    out[18] = scaled(raised, points["2.10"], UP)
    tongue = ~figure.body
    out[15][tongue] = near[15][tongue]
    return out
