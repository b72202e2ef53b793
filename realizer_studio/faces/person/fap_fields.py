"""FAP displacement fields on the base mesh, computed from expression shapes.

Every field is scaled so that its feature point moves one metre per metre of FAP, in the FAP's direction.
"""

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from realizer.core.array_types import Float64
from realizer.face.basis import JAW_SIN
from realizer_studio.faces.fix_flipped import JAW, LIPS, symmetrize, without_flips
from realizer_studio.faces.mpeg4.rigid import opening_rows, tongue_bends
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.person.far_fields import far_fields
from realizer_studio.faces.person.lids import Lid, lid_fields
from realizer_studio.faces.person.lips import Lips, lip_fields
from realizer_studio.faces.person.makehuman import FORWARD, LEFT, UP, Figure, scaled

BEND = 0.45  # slope in shares of a cardinal spline's; smaller values dip less between the stations
PUFFED_FROM = np.array([0.034, 0.0, 0.010])  # m, from the middle of the cheek inwards, down and back
SINKS = 0.35, 0.70  # shares of the jaw's rotation for the tongue's back and tip; more would hide the tongue
SLACK = 30  # smoothing passes of the throat
BACKWARDS = 0.45  # metres by which the corners of the mouth go back per metre that the chin falls
FROM_MIDDLE = 0.1, 1.0  # places along the lips, 0 in the middle and 1 at a corner, between which that grows
CHEEK = 0.035  # m beside the lips over which it fades
BROW = 0.004, 0.009  # m from a brow's line up to which skin moves with it fully, and up to which at all
BRIDGE = 0.004, 0.013  # the same beside the middle, between the brows
DOWN_BRIDGE = 0.034  # m below the line of the brows over which the movement fades
LOWEST = -0.16  # m; below it only FAPs of the head move vertices

# Position between wing and eye where the nose's side rises most; half axes in m; share of the tip's rise.
WRINKLED = 0.65, (0.016, 0.024, 0.030), 0.85


def face_fields(figure: Figure, jaw_pivot: Float64) -> tuple[dict[int, Float64], Lips]:
    """Return the fields (n, 3) on the base mesh by row number (see `basis`), and the lips."""
    lips = Lips(figure)
    fields = lip_fields(figure, lips)
    fields |= _jaw(figure, lips, jaw_pivot)
    fields |= lid_fields(figure)
    fields |= _brows(figure)
    fields |= _cheeks(figure, lips)
    fields |= _nose(figure, lips)
    fields |= _ears(figure)
    fields |= _tongue(figure)
    quads, twin = figure.mesh.quads["body"], figure.mesh.mirror()
    near = quads[(figure.at[quads, 1] > LOWEST).all(axis=1)]
    triangles = np.concatenate([near[:, [0, 1, 2]], near[:, [0, 2, 3]]]).astype(np.int32)
    fields = symmetrize(fields, twin)
    # Fields of lips and jaw are repaired later, on the finished skin: the lining of the mouth flips, and
    # repairing that here would make lumps.
    remaining = {
        number: field for number, field in fields.items() if number not in LIPS and number not in JAW
    }
    repaired = without_flips(remaining, figure.at, triangles, figure.points, figure.fapu(), jaw_pivot, twin)
    fields |= repaired
    return fields | symmetrize(far_fields(figure, lips, fields), twin), lips


def _jaw(figure: Figure, lips: Lips, pivot: Float64) -> dict[int, Float64]:
    # The share of the jaw's movement for each vertex of the skin, measured on the CC0 jaw-opening shape.
    shape = figure.shape("jawOpen")
    chin = figure.points["2.1"]
    drag = np.clip(np.linalg.norm(shape, axis=1) / np.linalg.norm(shape[chin]), 0, 1)
    drag = np.where(figure.body, drag, 0)
    drag = figure.smoothed(drag, 2)
    under = smooth(drag, 0.0, 0.9) * 0.5 + drag * 0.5
    # The skin below and behind the chin is slack, and folds over a longer distance.
    throat = smooth(figure.at[:, 1], figure.point("2.1")[1] + 0.001, figure.point("2.1")[1] - 0.012)
    under += throat * (figure.smoothed(under, SLACK) - under)
    drag = under / under[chin]
    drag = np.minimum(drag, 1)
    along = _along_tongue(figure)
    tongue = (along >= 0) * 1.0
    opens = drag * (1 - lips.around) + tongue * np.interp(along, (0, 1), SINKS)
    # Thrust and shift move the lower lip, the corners by 0.4, and not the upper lip. The transition is
    # spread over the lips, because a step at the corner would show.
    lip = np.where(
        lips.is_upper, 0.4 * smooth(np.abs(lips.u), 0.4, 1.0), 1 - 0.6 * smooth(np.abs(lips.u), 0.2, 1.0)
    )
    slides = drag * (1 - lips.lips + lips.lips * lip) + tongue
    slides /= slides[chin]
    rows = opening_rows(figure.at, pivot, opens)
    # The cheeks stretch: the corners of the mouth move backwards while the chin falls.
    corners = smooth(np.abs(lips.u), *FROM_MIDDLE) * smooth(lips.distance, CHEEK, 0.0)
    corners *= np.where(lips.fade > 0, lips.fade, figure.body & (figure.at[:, 2] > -0.05))
    fall = figure.point("2.1")[2] - pivot[2]
    rows[JAW_SIN + 1] -= BACKWARDS * fall * figure.smoothed(corners, 2)[:, None] * FORWARD
    return rows | {14: slides[:, None] * FORWARD, 15: -slides[:, None] * LEFT}


def _brows(figure: Figure) -> dict[int, Float64]:
    at, points = figure.at, figure.points
    names = ("browInnerUp", "browOuterUpLeft", "browOuterUpRight")
    raise_ = sum(map(figure.shape, names), np.zeros_like(at))
    raise_ = np.where(figure.body[:, None], raise_, 0)
    stations = [figure.point(name) for name in ("4.1", "4.3", "4.5")]
    across = np.array([p[0] for p in stations])
    line = [raise_[points[name], 1] for name in ("4.1", "4.3", "4.5")]
    # 1 all along the brow, falling off above and below as the shape does.
    local = np.interp(np.abs(at[:, 0]), across, line)
    profile = raise_ / local[:, None]
    profile[:, 1] = np.clip(profile[:, 1], 0, 1.25)
    profile[:, 0] = 0
    profile[:, 2] = np.clip(profile[:, 2], -0.6, 0.6)
    # A brow moves rigidly. The movement fades below it, so that no skin hangs over the eye.
    x, lid = np.abs(at[:, 0]), Lid(figure, 1)
    middle = np.interp(x, across, [p[1] for p in stations])
    rigid = smooth(np.abs(at[:, 1] - middle), *BROW[::-1]) * (raise_[:, 1] > 0)
    profile[:, 1] += rigid * (1 - profile[:, 1])
    edge = np.interp(x, lid.x, lid.high)
    profile *= np.clip((at[:, 1] - edge) / (middle - BROW[0] - edge), 0, 1)[:, None]
    # Between the brows the movement extends down the bridge of the nose, to avoid a ledge.
    bridge = smooth(x, *BRIDGE[::-1]) * smooth(middle - at[:, 1], DOWN_BRIDGE, 0.0) * (at[:, 1] < middle)
    profile[:, 1] = np.maximum(profile[:, 1], np.where(figure.body & (at[:, 2] > 0), bridge, 0))
    # The lid's edge does not follow the brow: it belongs to FAPs 19 and 20.
    lids = (figure.ellipsoid(figure.point(name), (0.024, 0.0095, 0.03), 0.5) for name in ("3.1", "3.2"))
    free = 1 - np.maximum(*lids)
    profile = figure.smoothed(profile * free[:, None], 2)
    out = {}
    for side, names, numbers in (
        (1, ("4.1", "4.3", "4.5"), (31, 33, 35)), (-1, ("4.2", "4.4", "4.6"), (32, 34, 36)),
    ):  # fmt: skip
        for number, name, share in zip(numbers, names, _stations(at[:, 0] * side, across), strict=True):
            out[number] = scaled(profile * share[:, None], points[name], UP)
    _soften(figure, out, [points[f"4.{k}"] for k in range(1, 7)], [31, 32, 33, 34, 35, 36])
    for number, name, side in ((37, "4.1", 1), (38, "4.2", -1)):
        x = at[:, 0] * side
        reach = figure.ellipsoid(figure.point(name), (0.036, 0.024, 0.03)) * smooth(x, 0.0, across[0])
        field = reach[:, None] * (-side * LEFT + 0.15 * FORWARD) * free[:, None]
        out[number] = scaled(figure.smoothed(field, 1), points[name], -side * LEFT)
    return out


def _stations(x: Float64, across: Float64) -> list[Float64]:
    """Return the weights (n,) of the inner, middle and outer brow at x; each is 1 at its station.

    The weights are smooth curves, and their slope is 0 at the inner end of the other side's brow.
    """
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


def _soften(figure: Figure, fields: dict[int, Float64], points: list[int], numbers: list[int]) -> None:
    """Smooth upward fields in place, and combine them so that each moves no other field's feature point."""
    soft = np.stack([figure.smoothed(fields[number], 2) for number in numbers])
    mixed = np.linalg.solve(soft[:, points, 1].T, np.eye(len(points)))
    for k, number in enumerate(numbers):
        fields[number] = np.tensordot(mixed[:, k], soft, 1)


def _cheeks(figure: Figure, lips: Lips) -> dict[int, Float64]:
    points, out = figure.points, {}
    free = (1 - lips.lips)[:, None]
    far = smooth(lips.distance, 0.0, 0.032)[:, None]
    for side, number, name in ((1, 39, "5.1"), (-1, 40, "5.2")):
        half = figure.shape("cheekPuff") * far * smooth(figure.at[:, 0] * side, -0.008, 0.008)[:, None]
        size = figure.smoothed(np.where(figure.body, np.linalg.norm(half, axis=1), 0), 2)
        # A cheek is inflated from inside the mouth, so it moves radially.
        outward = figure.at - (figure.point(name) - PUFFED_FROM * np.array([side, 1, 1]))
        outward /= np.maximum(np.linalg.norm(outward, axis=1), 0.010)[:, None]
        out[number] = scaled(size[:, None] * outward, points[name], side * LEFT)
    for side, number, name, word in ((1, 41, "5.3", "Left"), (-1, 42, "5.4", "Right")):
        lifted = np.where(figure.body[:, None], figure.shape(f"cheekSquint{word}"), 0) * free
        eye = figure.point("3.3" if side > 0 else "3.4")
        lifted *= (1 - figure.ellipsoid(eye + np.array([0, 0.004, 0]), (0.026, 0.018, 0.03), 0.2))[:, None]
        mound = figure.ellipsoid(figure.point(name), (0.034, 0.026, 0.036))[:, None] * (UP + 0.35 * FORWARD)
        lift = lifted[points[name], 1]
        mixed = mound + 0.5 * (lifted / lift if lift > 1e-4 else 0)
        # The lid's edge belongs to other FAPs.
        off_lid = 1 - figure.ellipsoid(eye + np.array([0, 0.002, 0]), (0.030, 0.014, 0.03), 0.30)
        out[number] = scaled(figure.smoothed(mixed * free * off_lid[:, None], 3), points[name], UP)
    return out


def _nose(figure: Figure, lips: Lips) -> dict[int, Float64]:
    points, free = figure.points, (1 - lips.lips)[:, None]
    out = {}
    for number, name, side, base in ((61, "9.1", 1, "9.5"), (62, "9.2", -1, "9.4")):
        # A nostril widens radially (Paul 2010, 4.4.3).
        wing = figure.point(name)
        nostril = (wing + figure.point(base)) / 2
        reach = figure.ellipsoid(wing - 0.002 * side * LEFT, (0.015, 0.014, 0.018), 0.1) * smooth(
            figure.at[:, 0] * side, 0.000, 0.009
        )
        spread = (figure.at - nostril) / np.linalg.norm(wing - nostril)
        direction = 0.5 * side * LEFT + 0.5 * np.clip(spread, -1.2, 1.2)
        out[number] = scaled(figure.smoothed(reach[:, None] * direction, 2), points[name], side * LEFT)
    tip = figure.point("9.3")
    reach = figure.ellipsoid(tip - [0, 0.001, 0.008], (0.025, 0.024, 0.032), 0.35)[:, None]
    # The sides of a raised nose move up with its tip.
    along, axes, share = WRINKLED
    for wing_name, corner_name in (("9.1", "3.11"), ("9.2", "3.8")):
        flank = along * figure.point(wing_name) + (1 - along) * figure.point(corner_name)
        reach = np.maximum(reach, share * figure.ellipsoid(flank, axes, 0.2)[:, None])
    out[63] = scaled(figure.smoothed(reach * (UP + 0.1 * FORWARD) * free, 1), points["9.3"], UP)
    reach = figure.ellipsoid(tip - [0, -0.004, 0.008], (0.026, 0.030, 0.032), 0.2)[:, None]
    out[64] = scaled(figure.smoothed(reach * -LEFT * free, 1), points["9.3"], -LEFT)
    return out


def _ears(figure: Figure) -> dict[int, Float64]:
    points, out = figure.points, {}
    for side, top, back, up, pull in ((1, "10.1", "10.3", 65, 67), (-1, "10.2", "10.4", 66, 68)):
        centre = (figure.point(top) + figure.point("10.5" if side > 0 else "10.6")) / 2
        reach = figure.ellipsoid(centre + np.array([0.006 * side, 0, -0.004]), (0.024, 0.048, 0.032), 0.60)
        reach = figure.smoothed(reach, 1)[:, None]
        out[up] = scaled(reach * UP, points[top], UP)
        # An ear that is pulled out turns about its front edge.
        swing = reach * smooth(centre[2] - figure.at[:, 2], -0.016, 0.010)[:, None]
        out[pull] = scaled(swing * side * LEFT, points[back], side * LEFT)
    return out


def _along_tongue(figure: Figure) -> Float64:
    """Return the position along the tongue, (n,): 0 at its back, 1 at its tip, -1 elsewhere."""
    tongue = np.unique(figure.mesh.quads["helper-tongue"])
    depth = figure.at[tongue, 2]
    along = np.full(len(figure.at), -1.0)
    along[tongue] = (depth - depth.min()) / np.ptp(depth)
    return along


def _tongue(figure: Figure) -> dict[int, Float64]:
    along = _along_tongue(figure)
    inside = along >= 0
    along = np.maximum(along, 0)
    tip, body = figure.points["6.1"], figure.points["6.2"]
    bend, arch, roll = tongue_bends(figure.at, along, inside)
    return roll | {
        43: scaled(bend[:, None] * -LEFT, tip, -LEFT),
        44: scaled(bend[:, None] * UP, tip, UP),
        45: scaled((along**1.5)[:, None] * FORWARD, tip, FORWARD),
        46: scaled(arch[:, None] * UP, body, UP),
    }
