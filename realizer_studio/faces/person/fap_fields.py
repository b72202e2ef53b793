"""FAP displacement fields on the base mesh, made from identity and expression shapes.

Every field is scaled so that its feature point moves one metre per metre of FAP, in the FAP's direction.
"""

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.basis import JAW_SIN
from realizer_studio.faces.fix_flipped import JAW, LIPS, symmetrize, without_flips
from realizer_studio.faces.mpeg4.rigid import opening_rows, tongue_bends
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.person.far_fields import far_fields
from realizer_studio.faces.person.lids import Lid, lid_fields
from realizer_studio.faces.person.lips import Lips, lip_fields
from realizer_studio.faces.person.makehuman import FORWARD, LEFT, UP, Ground, scaled

BEND = 0.45  # of the slope of a cardinal spline: less dips between the stations, more roundness at them
PUFFED_FROM = np.array([0.034, 0.0, 0.010])  # m, from the middle of the cheek inwards, down and back
SINKS = 0.35, 0.70  # how far the tongue's back and tip sink with the jaw; more would hide it
SLACK = 30  # times that the throat's part in the jaw is softened
BACKWARDS = 0.45  # metres that the corners of the mouth go back for each metre that the chin falls,
FROM_MIDDLE = 0.1, 1.0  # along the lips more and more between these u,
CHEEK = 0.035  # m beside them less and less up to there
BROW = 0.004, 0.009  # m from a brow's line that its skin goes along, and where that has no part any more
BRIDGE = 0.004, 0.013  # m beside the middle, between the brows, where skin goes along
DOWN_BRIDGE = 0.034  # m below their line: less and less
LOWEST = -0.16  # m; below it only the head's FAPs move anything

# Where between wing and eye the side of the nose is raised most, m around, and by what share of the tip.
WRINKLED = 0.65, (0.016, 0.024, 0.030), 0.85


def face_fields(ground: Ground, jaw_pivot: Float64) -> tuple[dict[int, Float64], Lips]:
    """Return row number (FAP number, or others: `basis`) -> field (n, 3) on the base mesh; and the lips."""
    lips = Lips(ground)
    fields = lip_fields(ground, lips)
    fields |= _jaw(ground, lips, jaw_pivot)
    fields |= lid_fields(ground)
    fields |= _brows(ground)
    fields |= _cheeks(ground, lips)
    fields |= _nose(ground, lips)
    fields |= _ears(ground)
    fields |= _tongue(ground)
    quads, twin = ground.mesh.quads["body"], ground.mesh.mirror()
    near = quads[(ground.at[quads, 1] > LOWEST).all(axis=1)]
    triangles = np.concatenate([near[:, [0, 1, 2]], near[:, [0, 2, 3]]]).astype(np.int32)
    fields = symmetrize(fields, twin)
    # Of the lips and the jaw only what the finished skin shows is mended: the lining of the mouth turns over,
    # and to mend that makes lumps.
    others = {number: field for number, field in fields.items() if number not in LIPS and number not in JAW}
    mended = without_flips(others, ground.at, triangles, ground.points, ground.fapu(), jaw_pivot, twin)
    fields |= mended
    return fields | symmetrize(far_fields(ground, lips, fields), twin), lips


def _jaw(ground: Ground, lips: Lips, pivot: Float64) -> dict[int, Float64]:
    # How far the chin drags each vertex of the skin, measured on the CC0 jaw-opening shape.
    shape = ground.shape("jawOpen")
    chin = ground.points["2.1"]
    drag = np.clip(np.linalg.norm(shape, axis=1) / np.linalg.norm(shape[chin]), 0, 1)
    drag = np.where(ground.body, drag, 0)
    drag = ground.smoothed(drag, 2)
    under = smooth(drag, 0.0, 0.9) * 0.5 + drag * 0.5
    # Below and behind the chin the skin is slack: it folds over a longer way.
    throat = smooth(ground.at[:, 1], ground.point("2.1")[1] + 0.001, ground.point("2.1")[1] - 0.012)
    under += throat * (ground.smoothed(under, SLACK) - under)
    drag = under / under[chin]
    drag = np.minimum(drag, 1)
    along = _along_tongue(ground)
    tongue = (along >= 0) * 1.0
    opens = drag * (1 - lips.around) + tongue * np.interp(along, (0, 1), SINKS)
    # Thrust and shift take the lower lip along; the upper one stays.
    # The corners, shared by both, go 0.4 of the way.
    # The lips are stretched between: a shelf at the corner would show.
    lip = np.where(
        lips.is_upper, 0.4 * smooth(np.abs(lips.u), 0.4, 1.0), 1 - 0.6 * smooth(np.abs(lips.u), 0.2, 1.0)
    )
    slides = drag * (1 - lips.lips + lips.lips * lip) + tongue
    slides /= slides[chin]
    rows = opening_rows(ground.at, pivot, opens)
    # The cheeks are stretched: the corners go backwards while the chin falls.
    corners = smooth(np.abs(lips.u), *FROM_MIDDLE) * smooth(lips.away, CHEEK, 0.0)
    corners *= np.where(lips.fade > 0, lips.fade, ground.body & (ground.at[:, 2] > -0.05))
    fall = ground.point("2.1")[2] - pivot[2]
    rows[JAW_SIN + 1] -= BACKWARDS * fall * ground.smoothed(corners, 2)[:, None] * FORWARD
    return rows | {14: slides[:, None] * FORWARD, 15: -slides[:, None] * LEFT}


def _brows(ground: Ground) -> dict[int, Float64]:
    at, points = ground.at, ground.points
    names = ("browInnerUp", "browOuterUpLeft", "browOuterUpRight")
    raise_ = sum(map(ground.shape, names), np.zeros_like(at))
    raise_ = np.where(ground.body[:, None], raise_, 0)
    stations = [ground.point(name) for name in ("4.1", "4.3", "4.5")]
    across = np.array([p[0] for p in stations])
    line = [raise_[points[name], 1] for name in ("4.1", "4.3", "4.5")]
    # 1 all along the brow, falling off above and below as the shape does.
    local = np.interp(np.abs(at[:, 0]), across, line)
    profile = raise_ / local[:, None]
    profile[:, 1] = np.clip(profile[:, 1], 0, 1.25)
    profile[:, 0] = 0
    profile[:, 2] = np.clip(profile[:, 2], -0.6, 0.6)
    # A brow goes as a whole, and the skin below it less and less, so that none hangs over the eye.
    x, lid = np.abs(at[:, 0]), Lid(ground, 1)
    middle = np.interp(x, across, [p[1] for p in stations])
    whole = smooth(np.abs(at[:, 1] - middle), *BROW[::-1]) * (raise_[:, 1] > 0)
    profile[:, 1] += whole * (1 - profile[:, 1])
    edge = np.interp(x, lid.x, lid.high)
    profile *= np.clip((at[:, 1] - edge) / (middle - BROW[0] - edge), 0, 1)[:, None]
    # Between the brows the way is spread down the bridge of the nose, which would have a ledge.
    bridge = smooth(x, *BRIDGE[::-1]) * smooth(middle - at[:, 1], DOWN_BRIDGE, 0.0) * (at[:, 1] < middle)
    profile[:, 1] = np.maximum(profile[:, 1], np.where(ground.body & (at[:, 2] > 0), bridge, 0))
    # The lid's edge does not follow the brow: FAPs 19 and 20 own it.
    lids = (ground.ellipsoid(ground.point(name), (0.024, 0.0095, 0.03), 0.5) for name in ("3.1", "3.2"))
    calm = 1 - np.maximum(*lids)
    profile = ground.smoothed(profile * calm[:, None], 2)
    out = {}
    for side, names, numbers in (
        (1, ("4.1", "4.3", "4.5"), (31, 33, 35)), (-1, ("4.2", "4.4", "4.6"), (32, 34, 36)),
    ):  # fmt: skip
        for number, name, share in zip(numbers, names, _stations(at[:, 0] * side, across), strict=True):
            out[number] = scaled(profile * share[:, None], points[name], UP)
    _soften(ground, out, [points[f"4.{k}"] for k in range(1, 7)], [31, 32, 33, 34, 35, 36])
    for number, name, side in ((37, "4.1", 1), (38, "4.2", -1)):
        x = at[:, 0] * side
        reach = ground.ellipsoid(ground.point(name), (0.036, 0.024, 0.03)) * smooth(x, 0.0, across[0])
        field = reach[:, None] * (-side * LEFT + 0.15 * FORWARD) * calm[:, None]
        out[number] = scaled(ground.smoothed(field, 1), points[name], -side * LEFT)
    return out


def _stations(x: Float64, across: Float64) -> list[Float64]:
    """Return the shares (n,) of a side's inner, middle and outer brow at x; 1 at its own station.

    A bent strip, not a chain of straight ones: the curve through the stations has no corner anywhere, and at
    the other side's inner end it is still.
    """
    from scipy.interpolate import CubicHermiteSpline

    a, b, c = across
    knots = np.array([-a, a, b, c])
    out = []
    for station in range(3):
        value = np.eye(4)[1 + station]
        slope = np.zeros(4)
        slope[1:3] = (value[2:] - value[:2]) / (knots[2:] - knots[:2])
        spline = CubicHermiteSpline(knots, value, slope * BEND)
        out.append(np.asarray(spline(np.clip(x, -a, c)), np.float64))
    return out


def _soften(ground: Ground, fields: dict[int, Float64], points: list[int], numbers: list[int]) -> None:
    """Take the kinks off fields of one way, and mix them so that each leaves the others' points alone."""
    soft = np.stack([ground.smoothed(fields[number], 2) for number in numbers])
    mixed = np.linalg.solve(soft[:, points, 1].T, np.eye(len(points)))
    for k, number in enumerate(numbers):
        fields[number] = np.tensordot(mixed[:, k], soft, 1)


def _cheeks(ground: Ground, lips: Lips) -> dict[int, Float64]:
    points, out = ground.points, {}
    free = (1 - lips.lips)[:, None]
    far = smooth(lips.away, 0.0, 0.032)[:, None]
    for side, number, name in ((1, 39, "5.1"), (-1, 40, "5.2")):
        half = ground.shape("cheekPuff") * far * smooth(ground.at[:, 0] * side, -0.008, 0.008)[:, None]
        size = ground.smoothed(np.where(ground.body, np.linalg.norm(half, axis=1), 0), 2)
        # A cheek is blown up from inside the mouth: away from there, not along one line.
        away = ground.at - (ground.point(name) - PUFFED_FROM * np.array([side, 1, 1]))
        away /= np.maximum(np.linalg.norm(away, axis=1), 0.010)[:, None]
        out[number] = scaled(size[:, None] * away, points[name], side * LEFT)
    for side, number, name, word in ((1, 41, "5.3", "Left"), (-1, 42, "5.4", "Right")):
        lifted = np.where(ground.body[:, None], ground.shape(f"cheekSquint{word}"), 0) * free
        eye = ground.point("3.3" if side > 0 else "3.4")
        lifted *= (1 - ground.ellipsoid(eye + np.array([0, 0.004, 0]), (0.026, 0.018, 0.03), 0.2))[:, None]
        mound = ground.ellipsoid(ground.point(name), (0.034, 0.026, 0.036))[:, None] * (UP + 0.35 * FORWARD)
        here = lifted[points[name], 1]
        mixed = mound + 0.5 * (lifted / here if here > 1e-4 else 0)
        # The lid's edge belongs to other FAPs.
        rest = 1 - ground.ellipsoid(eye + np.array([0, 0.002, 0]), (0.030, 0.014, 0.03), 0.30)
        out[number] = scaled(ground.smoothed(mixed * free * rest[:, None], 3), points[name], UP)
    return out


def _nose(ground: Ground, lips: Lips) -> dict[int, Float64]:
    points, free = ground.points, (1 - lips.lips)[:, None]
    out = {}
    for number, name, side, base in ((61, "9.1", 1, "9.5"), (62, "9.2", -1, "9.4")):
        # A nostril widens away from its middle, not along one line (Paul 2010, 4.4.3).
        wing = ground.point(name)
        nostril = (wing + ground.point(base)) / 2
        reach = ground.ellipsoid(wing - 0.002 * side * LEFT, (0.015, 0.014, 0.018), 0.1) * smooth(
            ground.at[:, 0] * side, 0.000, 0.009
        )
        spread = (ground.at - nostril) / np.linalg.norm(wing - nostril)
        way = 0.5 * side * LEFT + 0.5 * np.clip(spread, -1.2, 1.2)
        out[number] = scaled(ground.smoothed(reach[:, None] * way, 2), points[name], side * LEFT)
    tip = ground.point("9.3")
    reach = ground.ellipsoid(tip - [0, 0.001, 0.008], (0.025, 0.024, 0.032), 0.35)[:, None]
    # A nose that is raised wrinkles: its sides go up with the tip.
    along, axes, share = WRINKLED
    for wing_name, corner_name in (("9.1", "3.11"), ("9.2", "3.8")):
        flank = along * ground.point(wing_name) + (1 - along) * ground.point(corner_name)
        reach = np.maximum(reach, share * ground.ellipsoid(flank, axes, 0.2)[:, None])
    out[63] = scaled(ground.smoothed(reach * (UP + 0.1 * FORWARD) * free, 1), points["9.3"], UP)
    reach = ground.ellipsoid(tip - [0, -0.004, 0.008], (0.026, 0.030, 0.032), 0.2)[:, None]
    out[64] = scaled(ground.smoothed(reach * -LEFT * free, 1), points["9.3"], -LEFT)
    return out


def _ears(ground: Ground) -> dict[int, Float64]:
    points, out = ground.points, {}
    for side, top, back, up, pull in ((1, "10.1", "10.3", 65, 67), (-1, "10.2", "10.4", 66, 68)):
        centre = (ground.point(top) + ground.point("10.5" if side > 0 else "10.6")) / 2
        reach = ground.ellipsoid(centre + np.array([0.006 * side, 0, -0.004]), (0.024, 0.048, 0.032), 0.60)
        reach = ground.smoothed(reach, 1)[:, None]
        out[up] = scaled(reach * UP, points[top], UP)
        # Pulled out, the ear swings about its front edge.
        swing = reach * smooth(centre[2] - ground.at[:, 2], -0.016, 0.010)[:, None]
        out[pull] = scaled(swing * side * LEFT, points[back], side * LEFT)
    return out


def _along_tongue(ground: Ground) -> Float64:
    """Return 0 at the tongue's back, 1 at its tip, -1 elsewhere, (n,)."""
    mine = np.unique(ground.mesh.quads["helper-tongue"])
    depth = ground.at[mine, 2]
    along = np.full(len(ground.at), -1.0)
    along[mine] = (depth - depth.min()) / np.ptp(depth)
    return along


def _tongue(ground: Ground) -> dict[int, Float64]:
    along = _along_tongue(ground)
    mine = along >= 0
    along = np.maximum(along, 0)
    tip, body = ground.points["6.1"], ground.points["6.2"]
    bend, arch, roll = tongue_bends(ground.at, along, mine)
    return roll | {
        43: scaled(bend[:, None] * -LEFT, tip, -LEFT),
        44: scaled(bend[:, None] * UP, tip, UP),
        45: scaled((along**1.5)[:, None] * FORWARD, tip, FORWARD),
        46: scaled(arch[:, None] * UP, body, UP),
    }
