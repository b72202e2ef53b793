"""What FAPs move beyond their limits (`basis.LIMITS`), where more skin around goes along.

A point that goes as far as FAPs can ask draws skin over a wider way than a point that goes as far as action
units ask: a short way would fold it over.
"""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.basis import BEYOND
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.person.lips import Lips
from realizer_studio.faces.person.makehuman import FORWARD, LEFT, UP, Ground, scaled

LIDS = ("3.1", "3.3"), ("3.2", "3.4")
FOREHEAD, SOCKET, BRIDGE = 0.036, 0.020, 0.022  # m above brows, below them, and between them downwards
CLIMB, ASIDE = 0.45, 0.010  # metres forwards that skin from beside the bridge climbs it; m
GLABELLA = -0.6, -0.35, -0.05  # metres forwards per metre sideways at the other brow, the middle, the brow
TEMPLE, BEHIND = 0.012, -0.03  # m beyond the outer end of a brow; back
PUFFED = np.array([0.034, 0.0, 0.010]), (0.050, 0.046, 0.052)  # m inwards, down and back; half axes
LIFTED, ABOVE, BULGE = (0.040, 0.036, 0.045), 0.004, 0.6  # m; m; metres forwards per metre upwards
SQUINT = 0.55, 0.25  # metres that the lower lid rises and the upper one falls per metre of the cheek
STRETCHED = 0.014  # m more skin beside and below the nose
FLANK = 0.045  # m beyond a wing of the nose, or the corners of the lips
RAISED = 0.006, (0.030, 0.026, 0.036), 0.4  # m below the boss of the chin; half axes; metres forwards
ROOT = 0.010  # m above the eyes; skin that goes up with the nose ends there
BACK = 0.35  # metres that a wing goes back per metre outwards, as the cheek does


def far_fields(ground: Ground, lips: Lips, near: Mapping[int, Float64]) -> dict[int, Float64]:
    """Return BEYOND + FAP -> what it moves beyond its limit, (n, 3).

    Args:
        near: FAP -> (n, 3), what it moves up to its limit.
    """
    far = _brows(ground) | _cheeks(ground, lips, near) | _nose(ground, lips) | _mouth(ground, lips, near)
    return {BEYOND + fap: field for fap, field in far.items()}


def _calm(ground: Ground, radii: tuple[float, float, float]) -> Float64:
    """Return 0 on the lids of both eyes, 1 (n,) away from them."""
    eyes = [ground.ellipsoid((ground.point(a) + ground.point(b)) / 2, radii, 0.5) for a, b in LIDS]
    return np.asarray(1 - np.maximum(*eyes))


def _brows(ground: Ground) -> dict[int, Float64]:
    """A brow goes sideways as a whole, and the skin between the brows is pressed together evenly."""
    at, out = ground.at, {}
    inner, middle, outer = stations = [ground.point(name) for name in ("4.1", "4.3", "4.5")]
    across = [p[0] for p in stations]
    line = np.interp(np.abs(at[:, 0]), across, [p[1] for p in stations])
    above = at[:, 1] - line
    below = np.where(np.abs(at[:, 0]) < inner[0], BRIDGE, SOCKET)
    high = np.where(above > 0, smooth(above, FOREHEAD, 0.004), smooth(-above / below, 1.0, 0.2))
    high *= ground.body & (at[:, 2] > BEHIND)
    slopes = [(p[2] - q[2]) / (q[0] - p[0]) for p, q in pairwise(stations)]
    places = [-inner[0], 0, inner[0], (inner[0] + middle[0]) / 2, (middle[0] + outer[0]) / 2]
    for number, name, side in ((37, "4.1", 1), (38, "4.2", -1)):
        x = at[:, 0] * side
        share = smooth(x, -0.7 * inner[0], inner[0]) * smooth(x, outer[0] + TEMPLE, inner[0])
        rise = np.interp(x, places, [*GLABELLA, *slopes])
        rise += CLIMB * smooth(-above, 0.002, 0.012) * smooth(np.abs(x - ASIDE), 0.014, 0.004)
        field = (share * high * _calm(ground, (0.026, 0.010, 0.03)))[:, None]
        field = ground.smoothed(field * (-side * LEFT + rise[:, None] * FORWARD), 3)
        out[number] = scaled(field, ground.points[name], -side * LEFT)
    return out


def _cheeks(ground: Ground, lips: Lips, near: Mapping[int, Float64]) -> dict[int, Float64]:
    at, points, out = ground.at, ground.points, {}
    free = smooth(lips.away, 0.002, 0.030)
    for side, number, name in ((1, 39, "5.1"), (-1, 40, "5.2")):
        inwards, radii = PUFFED
        place = ground.point(name)
        away = at - (place - inwards * np.array([side, 1, 1]))
        away /= np.maximum(np.linalg.norm(away, axis=1), 0.010)[:, None]
        dome = ground.ellipsoid(place, radii) * free * _calm(ground, (0.028, 0.020, 0.04))
        out[number] = scaled(ground.smoothed(dome[:, None] * away, 4), points[name], side * LEFT)
    for number, name, lid in ((41, "5.3", 21), (42, "5.4", 22)):
        mound = ground.ellipsoid(ground.point(name) + ABOVE * UP, LIFTED, 0.15) * free
        mound *= _calm(ground, (0.025, 0.018, 0.03))
        field = ground.smoothed(mound[:, None] * (UP + BULGE * FORWARD), 3)
        field += SQUINT[0] * near[lid] + SQUINT[1] * near[lid - 2]
        out[number] = scaled(field, points[name], UP)
    return out


def _nose(ground: Ground, lips: Lips) -> dict[int, Float64]:
    at, points, free = ground.at, ground.points, 1 - lips.lips
    out = {}
    still = _calm(ground, (0.024, 0.019, 0.03)) * free * ground.body * (at[:, 2] > -0.02)
    tip, lip = ground.point("9.3"), ground.point("8.1")
    for number, name, side in ((61, "9.1", 1), (62, "9.2", -1)):
        wing = ground.point(name)
        x = at[:, 0] * side
        wide = np.abs(wing[0])
        share = np.where(x < wide, np.clip(x / wide, 0, 1), smooth(x, wide + FLANK, wide))
        up = smooth(at[:, 1], wing[1] + 0.028, wing[1] + 0.004) * smooth(at[:, 1], lip[1], wing[1] - 0.008)
        way = side * LEFT - BACK * np.clip(x / wide, 0, 1)[:, None] * FORWARD
        field = (share * up * still)[:, None] * way
        out[number] = scaled(ground.smoothed(field, 2), points[name], side * LEFT)
    base = ground.point("9.15")[1]
    up = np.interp(at[:, 1], [lip[1] - 0.002, base, tip[1], ROOT], [0, 1, 1, 0])
    # Below the nose, where skin is stretched, more of it goes along.
    spread = STRETCHED * smooth(at[:, 1], base + 0.006, base - 0.004)
    share = smooth(np.abs(at[:, 0]), abs(ground.point("9.1")[0]) + 0.018 + spread, 0.008 - spread / 2)
    field = (up * share * still)[:, None] * UP
    out[63] = scaled(ground.smoothed(field, 3), points["9.3"], UP)
    return out


def _mouth(ground: Ground, lips: Lips, near: Mapping[int, Float64]) -> dict[int, Float64]:
    """The corners draw the cheek, and a jaw that is shifted draws both lips."""
    at, points, out = ground.at, ground.points, {}
    front = ground.body & (at[:, 2] > -0.05)
    fade = np.where(lips.fade > 0, lips.fade, front)
    for side, names, numbers in ((1, ("2.4", "8.3"), (6, 53)), (-1, ("2.5", "8.4"), (7, 54))):
        u = np.clip(lips.u * side, 0, 1)
        reach = 0.012 + (FLANK - 0.012) * smooth(u, 0.4, 1.0)
        share = u**1.4 * smooth(lips.away / reach, 1.0, 0.0) * fade
        back = np.interp(u, [0, 0.5, 1], [0, -0.30, -0.62])
        field = share[:, None] * (side * LEFT + back[:, None] * FORWARD)
        field = np.where((lips.away > 0.0005)[:, None], ground.smoothed(field, 3), field)
        for number, name, mine in zip(numbers, names, (1 - lips.w, lips.w), strict=True):
            out[number] = scaled(field * mine[:, None], points[name], side * LEFT)
    base, low = ground.point("9.15")[1], ground.point("8.2")[1] - 0.004
    level = smooth(at[:, 1], base + 0.004, low) * smooth(np.abs(at[:, 0]), 0.055, 0.020) * front
    shifted = np.maximum(-near[15][:, 0], level * fade)
    out[15] = scaled(ground.smoothed(shifted, 6)[:, None] * -LEFT, points["2.1"], -LEFT)
    # The chin rises as a whole, and its skin is pressed forwards.
    chin = ground.ellipsoid(ground.point("2.10") - RAISED[0] * UP, RAISED[1]) * (1 - lips.lips)
    raised = ground.smoothed(chin[:, None] * (UP + RAISED[2] * FORWARD), 2)
    out[18] = scaled(raised, points["2.10"], UP)
    tongue = ~ground.body
    out[15][tongue] = near[15][tongue]
    return out
