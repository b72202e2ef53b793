"""The rigid parts of a head: jaw with teeth and tongue, eyeballs, pupils, head and neck."""

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.basis import JAW_COS, JAW_DROP, JAW_SIN, TONGUE_COS, TONGUE_SIN
from realizer.face.mesh_geometry import fit_ball
from realizer_studio.faces.mpeg4.zones import Triple
from realizer_studio.faces.parts import smooth

Parts = Mapping[str, tuple[int, int]]
LIP_POINTS = (
    "2.4", "2.8", "2.3", "2.9", "2.5", "2.7", "2.2", "2.6", "2.4",
    "8.3", "8.7", "8.2", "8.8", "8.4", "8.6", "8.1", "8.5", "8.3",
)  # fmt: skip
# The joint of the jaw, above and in front of the ear lobe, in eye distances.
JOINT = (0.0, -0.51, -0.87)
# The head's rotation fades out below the jaw, along a tilted plane; eye distances.
NECK_TILT, NECK_TOP, NECK_END = 0.30, -0.27, -1.55
PUPIL = 0.0020  # m, if no dark vertices show the pupil's edge
OVER_BALL = 0.0022  # m; the largest distance between lid and ball
TONGUE_MOVES = ("lower_teeth", "tongue")


def jaw_pivot(points: Mapping[str, Triple]) -> Float64:
    """Return the axis of the jaw, (3,) metres."""
    left, right = np.array(points["3.5"]), np.array(points["3.6"])
    eyes = (left + right) / 2
    return np.asarray(
        [eyes[0], eyes[1], eyes[2] - 0.27 * (left[0] - right[0])] + (left[0] - right[0]) * np.array(JOINT)
    )


def jaw_rows(
    at: Float64, points: Mapping[str, Triple], parts: Parts, lower: Int32, pivot: Float64
) -> dict[int, Float64]:
    """Return the fields of the jaw's opening, thrust and shift; FAP 3 does not move the lips.

    Args:
        lower: vertices of the skin below the mouth's slit.
    """
    positions = {name: np.array(value) for name, value in points.items()}
    chin, corner = positions["2.1"], positions["2.13"]
    mouth = (positions["2.4"] + positions["2.5"]) / 2
    below = np.zeros(len(at))
    below[lower] = 1
    # At the corners of the mouth, upper and lower side blend.
    corners = [positions[name] for name in ("2.4", "2.5", "8.3", "8.4")]
    meet = smooth(np.min([np.linalg.norm(at - c, axis=1) for c in corners], axis=0), 0.010, 0.002)
    below = below * (1 - meet) + 0.5 * meet
    # The zone covers the jaw, and ends at the mouth.
    wide, deep = 1.25 * abs(corner[0] - chin[0]), 1.25 * abs(corner[2] - chin[2])
    tall = abs(mouth[1] - chin[1]) * 1.45
    distance = np.linalg.norm((at - chin) / [wide, tall, deep], axis=1)
    drag = below * smooth(distance, 1.0, 0.30)
    # The cheek is stretched beside the mouth, so that no edge shows where the sides of the slit meet.
    beside_mouth = smooth(
        np.abs(at[:, 0] - mouth[0]), abs(positions["8.3"][0]) * 1.0, abs(positions["8.3"][0]) * 1.5
    )
    cheek = smooth(distance, 1.0, 0.30) * smooth(at[:, 1], mouth[1] + 0.006, mouth[1] - 0.022)
    drag = drag * (1 - beside_mouth) + beside_mouth * cheek
    lips, nearest = _to_lips(at, positions)
    lip_share = smooth(lips, 0.95 * float(np.linalg.norm(positions["8.2"] - positions["2.1"])), 0.0025)
    mover = np.zeros(len(at))
    for name in TONGUE_MOVES:
        if name in parts:
            mover[slice(*parts[name])] = 1
    inner = skin_only(len(at), parts)
    opening = drag * (1 - lip_share) * inner + mover
    vertex = int(np.argmin(np.linalg.norm(at - chin, axis=1)))
    opening = np.minimum(opening / max(opening[vertex], 1e-6), 1)
    # Thrust and shift move the lower lip, and half as much the corners.
    lip_corner = smooth(lips, 0.012, 0.002) * nearest
    sliding_share = drag * inner * (1 - 0.5 * lip_corner) + mover
    sliding_share /= max(sliding_share[vertex], 1e-6)
    return opening_rows(at, pivot, opening) | {
        14: sliding_share[:, None] * np.array([0, 0, 1.0]),
        15: sliding_share[:, None] * np.array([-1.0, 0, 0]),
    }


def opening_rows(at: Float64, pivot: Float64, share: Any) -> dict[int, Float64]:
    """Return the three fields of an opening jaw, (n, 3) each; `share`: (n,) how far vertices follow it."""
    # A rotation by a about +x: y' = y cos a - z sin a, z' = y sin a + z cos a.
    y, z = (at - pivot)[:, 1:].T
    none = np.zeros_like(y)
    rows = {JAW_COS: (none, -y, -z), JAW_SIN: (none, -z, y), JAW_DROP: (none, none - 1, none)}
    return {number + 1: (share * np.array(row)).T for number, row in rows.items()}


def skin_only(n: int, parts: Parts) -> Float64:
    """Return 1 on the skin, 0 elsewhere, (n,)."""
    out = np.zeros(n)
    out[slice(*parts["skin"])] = 1
    return out


def _to_lips(at: Float64, positions: Mapping[str, Float64]) -> tuple[Float64, Float64]:
    """Return the distance to the lip contours in metres, and the share of the corners, 0..1."""
    best, corner = np.full(len(at), np.inf), np.zeros(len(at))
    for first, last in pairwise(LIP_POINTS):
        if first == "2.4" and last == "8.3":
            continue
        a, b = positions[first], positions[last]
        along = b - a
        t = np.clip((at - a) @ along / max(float(along @ along), 1e-18), 0, 1)
        distance = np.linalg.norm(at - a - t[:, None] * along, axis=1)
        ends = [name in ("2.4", "2.5", "8.3", "8.4") for name in (first, last)]
        share = (1 - t) * ends[0] + t * ends[1]
        closer = distance < best
        best, corner = np.where(closer, distance, best), np.where(closer, share, corner)
    return best, corner


def tongue_rows(at: Float64, points: Mapping[str, Triple], parts: Parts) -> dict[int, Float64]:
    """Return the fields of FAPs 43 to 46 and of the tongue's roll; empty if there is no tongue."""
    if "tongue" not in parts:
        return {}
    tongue = slice(*parts["tongue"])
    back, front = at[tongue, 2].min(), at[tongue, 2].max()
    along = np.zeros(len(at))
    along[tongue] = np.clip((at[tongue, 2] - back) / max(front - back, 1e-9), 0, 1)
    inside = np.zeros(len(at))
    inside[tongue] = 1
    bend, arch, out = tongue_bends(at, along, inside)
    for fap, name, weight, direction in (
        (43, "6.1", bend, (-1.0, 0, 0)), (44, "6.1", bend, (0, 1.0, 0)),
        (45, "6.1", along**1.5, (0, 0, 1.0)), (46, "6.2", arch, (0, 1.0, 0)),
    ):  # fmt: skip
        tip = tongue.start + int(np.argmin(np.linalg.norm(at[tongue] - np.array(points[name]), axis=1)))
        out[fap] = (weight / max(float(weight[tip]), 1e-6))[:, None] * np.array(direction)
    return out


def tongue_bends(at: Float64, along: Float64, inside: Any) -> tuple[Float64, Float64, dict[int, Float64]]:
    """Return the weights by which a tongue's vertices bend and arch, (n,) each, and the fields of its roll.

    Args:
        at: (n, 3) metres; along: (n,) 0 at the back of the tongue, 1 at its tip; inside: (n,) 1 on it.
    """
    bend = smooth(along, 0.35, 1.0) * along
    arch = np.sin(np.pi * np.clip((along - 0.15) / 0.85, 0, 1)) ** 2 * inside
    # The tongue rolls about its middle line: both borders rise.
    edge = smooth(along, 0.30, 0.65) * inside
    turn_cos, turn_sin = np.zeros_like(at), np.zeros_like(at)
    turn_cos[:, 0], turn_sin[:, 1] = -at[:, 0] * edge, np.abs(at[:, 0]) * edge
    return bend, arch, {TONGUE_COS + 1: turn_cos, TONGUE_SIN + 1: turn_sin}


def balls(at: Float64, parts: Parts) -> list[tuple[Float64, float]]:
    """Return centre and radius of the best-fitting balls of the left and right eye."""
    return [fit_ball(at[slice(*parts[name])]) for name in ("left_eye", "right_eye")]


def pupil_rows(
    at: Float64, colours: Any, parts: Parts, eyes: list[tuple[Float64, float]]
) -> dict[int, Float64]:
    """Return the fields of FAPs 29 and 30, which widen a pupil by a metre per metre of FAP."""
    out = {}
    for fap, name, (centre, _) in zip((29, 30), ("left_eye", "right_eye"), eyes, strict=True):
        eye = slice(*parts[name])
        offset = at[eye] - centre
        distance = np.hypot(offset[:, 0], offset[:, 1])
        dark = (np.asarray(colours)[eye].max(axis=1) < 40) & (offset[:, 2] > 0) & (distance < 0.004)
        edge = float(distance[dark].max()) if dark.any() and distance[dark].max() > 5e-4 else PUPIL
        # The black of the pupil grows evenly; the iris is compressed up to its border.
        share = np.where(distance <= edge, distance / edge, smooth(distance, 2.9 * edge, edge)) / 2
        ring = (
            offset[:, :2]
            / np.maximum(distance, 1e-9)[:, None]
            * np.where(offset[:, 2] > 0, share, 0)[:, None]
        )
        row = np.zeros_like(at)
        row[eye, :2] = ring
        out[fap] = row
    return out


def head_weight(at: Float64, points: Mapping[str, Triple], parts: Parts) -> Float64:
    """Return the share of the head's rotation for each vertex, (n,): 1 above the jaw, 0 below the neck.

    All parts but skin and clothes rotate fully.
    """
    left, right, chin = (np.array(points[name]) for name in ("3.5", "3.6", "2.1"))
    eyes = float(left[0] - right[0])
    level = at[:, 1] + NECK_TILT * at[:, 2]
    jaw = float(chin[1] + NECK_TILT * chin[2])
    out = np.asarray(smooth(level, jaw + NECK_END * eyes, jaw + NECK_TOP * eyes))
    for name, part in parts.items():
        if name not in ("skin", "shirt"):
            out[slice(*part)] = 1
    return out


def sliding(
    rows: Mapping[int, Float64], at: Float64, parts: Parts, eyes: list[tuple[Float64, float]]
) -> tuple[Any, Any, Any]:
    """Return the vertices of skin, lashes and tears that slide over an eyeball, its index, and the radius."""
    index, side, radius = [], [], []
    candidates = skin_only(len(at), parts) > 0
    for name in ("lashes", "tears"):
        if name in parts:
            candidates[slice(*parts[name])] = True
    for k, (centre, size) in enumerate(eyes):
        moves = sum(np.abs(rows[fap][:, 1]) for fap in (19 + k, 21 + k) if fap in rows)
        distance = np.linalg.norm(at - centre, axis=1)
        selected = np.flatnonzero(
            candidates
            & (np.asarray(moves) > 0.02)
            & (distance > size + 0.0001)
            & (at[:, 2] > centre[2] + 0.002)
        )
        index.append(selected)
        side.append(np.full(len(selected), k))
        radius.append(np.minimum(distance[selected], size + OVER_BALL))
    return np.concatenate(index), np.concatenate(side), np.concatenate(radius)
