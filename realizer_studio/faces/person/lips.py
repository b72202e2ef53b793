"""The displacement fields of lip FAPs: splines between two contours of feature points.

A point on the lips has two coordinates: u runs from the right corner (-1) over the middle (0) to the left
corner (1), w from the inner contour (0: FAPs 4-13) to the outer (1: FAPs 51-60). Every FAP has a knot.
"""

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from realizer.core.array_types import Bool, Float64
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.person.makehuman import FORWARD, LEFT, UP, Figure, scaled, walk

# Two vertices of each ring of edges around the mouth, from inside to outside: the middle of the upper lip and
# its neighbour. The lips meet at ring 1; ring 7 is the border of the red.
RINGS = (
    (537, 7282), (520, 7267), (474, 7229), (468, 7224), (509, 7257),
    (467, 7223), (466, 7222), (455, 7214), (362, 7118), (5342, 11945),
)  # fmt: skip
MEET, BORDER = 1, 7
RING_SIZE = 38  # vertices
LOWER_MIDDLE = 19  # index of the middle of the lower lip in a ring
TENSION = 0.45  # equal FAPs overshoot by less than 4 % between the knots; more tension makes steps
END_TENSION = 0.55  # at the corners; less tension flips triangles there
ROUND = 0.25  # share of an ellipse's angle in the splines' coordinate
KNOTS = 5  # right corner, right half, middle, left half, left corner
CLOSED_GAP = 0.00005  # m between closed lips
ROLL = 0.0010  # m from where the lips meet back to a lip's innermost ring; less makes slivers fold over
FOLD = 0.40, 0.006, (0.015, 0.020, 0.025)  # share of FAPs 55 and 56 at the nasolabial fold; m; half axes
ARC = 0.30  # metres forwards per metre of rise of the lower lip, which moves on the arc of the jaw


def _stretch() -> tuple[Float64, Float64]:
    # Maps coordinate u of a vertex to the u of the splines; the knots at 0, 0.5 and 1 are fixed.
    u = np.linspace(0, 1, 201)
    mixed = (1 - ROUND) * u + ROUND * np.arcsin(u) / (np.pi / 2)
    half = float(np.interp(0.5, u, mixed))
    return u, np.where(mixed < half, mixed / half / 2, 0.5 + (mixed - half) / (1 - half) / 2)


_STRETCH = _stretch()


def spline_basis(u: Any) -> Float64:
    """Return cardinal splines (5, n) with knots u = -1, -0.5, 0, 0.5, 1, each 1 at its knot and 0 at others.

    The weights sum to 1 everywhere, so equal FAPs move a lip evenly.
    """
    u = np.clip(np.asarray(u, float), -1, 1)
    # A mean of u and the angle of an ellipse: open mouths have round corners, smiles sharp ones.
    u = np.sign(u) * np.interp(np.abs(u), *_STRETCH)
    piece = np.clip(np.floor((u + 1) * 2).astype(int), 0, 3)
    t = (u + 1) * 2 - piece
    out = np.zeros((KNOTS, len(u)))
    basis = (2 * t**3 - 3 * t**2 + 1, t**3 - 2 * t**2 + t, -2 * t**3 + 3 * t**2, t**3 - t**2)
    for knot in range(KNOTS):
        value = np.eye(KNOTS)[knot]
        slope = np.gradient(value) * (1 - TENSION)
        slope[[0, -1]] *= (1 - END_TENSION) / (1 - TENSION)
        ends = (value[piece], slope[piece], value[piece + 1], slope[piece + 1])
        out[knot] = sum(share * end for share, end in zip(basis, ends, strict=True))
    return out


class Lips:
    """The position of every vertex of the base mesh relative to the lips.

    Attributes:
        u, w: (n,) coordinates; a vertex off the lips has those of the nearest point of the lips.
        is_upper: (n,) bool, whether a vertex belongs to the upper lip.
        inside: (n,) bool, whether it is in the mouth.
        distance: (n,) metres from the border of the red, 0 on the lips and in the mouth.
        lips: (n,) from 1 on the lips to 0 a centimetre away; the share that other FAPs do not move.
        upper, corners: (n,) the share of `lips` on the upper lip and at the corners.
        around: (n,) from 1 on the lips to 0 at the chin; the share that FAP 3 does not move.
        fade: (n,) 1 on the lips, decreasing into the mouth.
    """

    def __init__(self, figure: Figure) -> None:
        at, n = figure.at, len(figure.at)
        edges = figure.mesh.edges
        rings = []
        for first, second in RINGS:
            ring = walk(edges, first, second)
            rings.append(ring if at[ring[1], 0] > 0 else [ring[0], *ring[:0:-1]])
        self.rings = rings
        self.u, self.w = np.zeros(n), np.zeros(n)
        self.is_upper: Bool = np.zeros(n, bool)
        on_ring = np.full(n, -1)
        for k, ring in enumerate(rings):
            corner = max(range(LOWER_MIDDLE), key=lambda i, r=ring: float(at[r[i], 0]))  # type: ignore[misc]
            reach = at[ring[corner], 0]
            for index, vertex in enumerate(ring):
                self.u[vertex] = np.clip(at[vertex, 0] / reach, -1, 1)
                self.is_upper[vertex] = min(index, RING_SIZE - index) <= corner
                on_ring[vertex] = k
        self._measure_across(at)
        self._align_knots(figure)
        self.fade = np.zeros(n)
        self.fade[on_ring >= 0] = 1
        inside = self._extend_inwards(figure, on_ring)
        self._extend_outwards(figure, on_ring, inside)
        ringed = (on_ring >= 0) & (on_ring <= BORDER)
        self.distance[ringed | inside] = 0
        self.inside = inside
        near = figure.body & (at[:, 2] > -0.03)
        self.lips = np.where(ringed, 1.0, np.where(near, smooth(self.distance, 0.010, 0.001), 0.0))
        self.lips[inside] = self.fade[inside]
        self.upper = self.lips * self.is_upper
        self.corners = self.lips * smooth(np.abs(self.u), 0.6, 1.0)
        reach = np.where(self.is_upper, 0.020, 0.021 + 0.006 * smooth(np.abs(self.u), 0.4, 1.0))
        self.around = np.where(ringed, 1.0, np.where(near, smooth(self.distance / reach, 1.0, 0.06), 0.0))
        self.around[inside] = self.fade[inside]

    def _measure_across(self, at: Float64) -> None:
        """Set w to the share of the length across the lip, from where the lips meet to the border."""
        red = np.array(self.rings[MEET : BORDER + 1])
        length = np.cumsum(np.linalg.norm(np.diff(at[red], axis=0), axis=2), axis=0)
        share = length / length[-1]
        self.w[red[1:]] = (np.roll(share, 1, axis=1) + 2 * share + np.roll(share, -1, axis=1)) / 4
        self.w[np.array(self.rings[BORDER:])] = 1

    def _align_knots(self, figure: Figure) -> None:
        """Rescale u so that the feature points between middle and corner are at 0.5."""
        for is_upper, names in ((True, ("2.6", "8.5")), (False, ("2.8", "8.7"))):
            inner, outer = (float(self.u[figure.points[name]]) for name in names)
            for k, ring in enumerate(self.rings):
                half_ring = np.array([i for i in ring if self.is_upper[i] == is_upper])
                half = inner + (outer - inner) * np.clip((k - MEET) / (BORDER - MEET), 0, 1)
                u = np.abs(self.u[half_ring])
                self.u[half_ring] = np.sign(self.u[half_ring]) * np.interp(u, [0, half, 1], [0, 0.5, 1])

    def _extend_inwards(self, figure: Figure, on_ring: Any) -> Bool:
        """Extend the coordinates of the inner ring into the mouth, and return the vertices there."""
        n = len(figure.at)
        inside: Bool = np.zeros(n, bool)
        visited = on_ring >= 0
        front = np.flatnonzero(on_ring == 0)
        near = figure.average
        for step in range(60):
            found: dict[int, list[int]] = {}
            for vertex in front:
                for other in near.indices[near.indptr[vertex] : near.indptr[vertex + 1]]:
                    if not visited[other]:
                        found.setdefault(int(other), []).append(int(vertex))
            for other, parents in found.items():
                self.u[other] = np.mean(self.u[parents])
                self.is_upper[other] = bool(np.mean(self.is_upper[parents]) > 0.5)
                self.fade[other] = max(0.0, 1 - 0.12 * (step + 1))
                self.w[other] = 0
                inside[other] = True
            front = np.array(list(found), int)
            visited[front] = True
            if not len(front):
                break
        return inside

    def _extend_outwards(self, figure: Figure, on_ring: Any, inside: Bool) -> None:
        """Set the coordinates of all other vertices to those of the nearest point on the border."""
        at = figure.at
        ring = np.array(self.rings[BORDER] + self.rings[BORDER][:1])
        # The ring is divided into short segments, so that the coordinates change smoothly.
        t = np.linspace(0, RING_SIZE, RING_SIZE * 12, endpoint=False)
        k, part = t.astype(int), (t - t.astype(int))[:, None]
        line = at[ring[k]] * (1 - part) + at[ring[k + 1]] * part
        u = self.u[ring[k]] * (1 - part[:, 0]) + self.u[ring[k + 1]] * part[:, 0]
        upper = self.is_upper[ring[np.where(part[:, 0] < 0.5, k, k + 1)]]
        distance, nearest = (np.asarray(found) for found in cKDTree(line).query(at))
        self.distance: Float64 = distance.astype(np.float64)
        other = figure.body & ~inside & ((on_ring < 0) | (on_ring > BORDER))
        self.u[other], self.is_upper[other], self.w[other] = u[nearest[other]], upper[nearest[other]], 1


def close_lips(figure: Figure) -> Float64:
    """Return the base mesh (n, 3) with closed lips; each lip moves half the distance.

    The lining is moved back where full lips have their inner rings too far in front.
    """
    lips = Lips(figure)
    at = figure.at.copy()
    for k, share in ((0, 1.0), (1, 1.0), (2, 0.55), (3, 0.25), (4, 0.10)):
        meet = lips.rings[min(k, MEET)]
        upper = sorted((i for i in meet if lips.is_upper[i]), key=lambda i: float(figure.at[i, 0]))
        lower = sorted((i for i in meet if not lips.is_upper[i]), key=lambda i: float(figure.at[i, 0]))
        for i in lips.rings[k]:
            x = figure.at[i, 0]
            high, low = (np.interp(x, figure.at[row, 0], figure.at[row, 1]) for row in (upper, lower))
            # The gap is negative where lips overlap.
            gap = high - low - CLOSED_GAP
            at[i, 1] += share * gap / 2 * (-1 if lips.is_upper[i] else 1)
    inner, meeting = (np.array(lips.rings[k]) for k in (0, MEET))
    back = np.maximum(at[inner, 2] - at[meeting, 2] + ROLL, 0)
    lining = (lips.inside | (lips.w == 0)) & (lips.fade > 0)
    lining[meeting] = False
    for half in (lips.is_upper, ~lips.is_upper):
        in_half, behind = half[inner], lining & half
        order = np.argsort(lips.u[inner[in_half]])
        u, shift = lips.u[inner[in_half]][order], back[in_half][order]
        at[behind, 2] -= lips.fade[behind] * np.interp(lips.u[behind], u, shift)
    return at


def lip_fields(figure: Figure, lips: Lips) -> dict[int, Float64]:
    """Return the fields of FAPs 4-13, 16-18 and 51-60."""
    at, points = figure.at, figure.points
    knots = spline_basis(lips.u)
    in_front = figure.body & (at[:, 2] > -0.03)
    soft = np.where(lips.is_upper, 0.015, 0.026)
    # The mean of a linear and a smooth falloff, which is flat enough for the fold of the chin.
    near = 0.5 * np.clip(1 - lips.distance / soft, 0, 1) + 0.5 * smooth(lips.distance / soft, 1.0, 0.0)
    fall = np.where(in_front, near, 0) * np.where(lips.fade > 0, lips.fade, 1.0)
    upper, lower = lips.is_upper * fall, ~lips.is_upper * fall
    inner, outer = 1 - lips.w, lips.w
    right, half_right, middle, half_left, left = knots
    out: dict[int, Float64] = {}

    def add(number: int, name: str, weight: Float64, motion: Any, direction: Any) -> None:
        field = weight[:, None] * np.asarray(motion)
        # On the lips the spline is smooth; only the rest is smoothed.
        field = np.where((lips.distance > 0.0005)[:, None], figure.smoothed(field, 2), field)
        out[number] = scaled(field, points[name], direction)

    down = -UP
    # FAPs 55 and 56 also move the nasolabial fold.
    part, sideways, axes = FOLD
    beyond = part * smooth(lips.distance, 0.004, 0.012) * ~lips.inside
    folds: dict[int, Any] = {}
    for number, wing, corner, outward in ((55, "9.1", "8.3", LEFT), (56, "9.2", "8.4", -LEFT)):
        centre = (figure.point(wing) + figure.point(corner)) / 2 + sideways * (outward + UP)
        folds[number] = figure.ellipsoid(centre, axes) * beyond
    for share, numbers, names in (
        (inner, (4, 8, 9, 5, 10, 11), ("2.2", "2.6", "2.7", "2.3", "2.8", "2.9")),
        (outer, (51, 55, 56, 52, 57, 58), ("8.1", "8.5", "8.6", "8.2", "8.7", "8.8")),
    ):
        for number, name, knot in zip(numbers[:3], names[:3], (middle, half_left, half_right), strict=True):
            add(number, name, upper * share * knot + folds.get(number, 0), down, down)
        for number, name, knot in zip(numbers[3:], names[3:], (middle, half_left, half_right), strict=True):
            add(number, name, lower * share * knot, UP + ARC * FORWARD, UP)
    out |= _corners(figure, lips, left, right, inner, outer)
    bow = (1 + np.cos(np.pi * np.clip(lips.u, -1, 1))) / 2
    add(17, "2.2", upper * bow, FORWARD, FORWARD)
    add(16, "2.3", lower * bow, FORWARD, FORWARD)
    boss = figure.ellipsoid(figure.point("2.10") - [0, 0.002, 0], (0.024, 0.0155, 0.03))
    field = (boss * (1 - lips.lips))[:, None] * (UP + 0.15 * FORWARD)
    out[18] = scaled(figure.smoothed(field, 1), points["2.10"], UP)
    return out


def _corners(
    figure: Figure, lips: Lips, left: Float64, right: Float64, inner: Float64, outer: Float64
) -> dict[int, Float64]:
    """Return the fields of FAPs 6, 7, 12, 13, 53, 54, 59, 60: splines on the lips, shapes on the cheeks."""
    at, points, out = figure.at, figure.points, {}
    in_front = figure.body & (at[:, 2] > -0.06)
    # The field changes from the spline on the lips to the shape on the cheeks.
    cheek = np.where(in_front, smooth(lips.distance, 0.001, 0.014), 0)
    cheek[lips.fade > 0] = np.where(lips.distance[lips.fade > 0] > 0, cheek[lips.fade > 0], 0)
    mouth = np.where(in_front, smooth(lips.distance, 0.030, 0.0), 0) * np.where(lips.fade > 0, lips.fade, 1.0)
    for side, knot, numbers, names, word in (
        (1, left, ((6, 12), (53, 59)), ("2.4", "8.3"), "Left"),
        (-1, right, ((7, 13), (54, 60)), ("2.5", "8.4"), "Right"),
    ):
        corner = points[names[1]]
        smile, stretch = (
            np.where(figure.body[:, None], figure.shape(f"mouth{k}{word}"), 0) for k in ("Smile", "Stretch")
        )
        # Two shapes are combined so that the corner moves exactly upwards, or exactly outwards.
        pull = np.array(
            [[smile[corner, 0] * side, stretch[corner, 0] * side], [smile[corner, 1], stretch[corner, 1]]]
        )
        mixes = np.linalg.solve(pull, np.eye(2))
        out_shape = smile * mixes[0, 0] + stretch * mixes[1, 0]
        up_shape = smile * mixes[0, 1] + stretch * mixes[1, 1]
        u = np.clip(lips.u * side, 0, 1)
        ramp = u**1.4
        # A lip that moves outwards follows the arch of the teeth backwards.
        slope = np.interp(u, [0, 0.5, 1], [0, -0.30, -0.62])
        draw = np.stack([side * ramp, np.zeros_like(ramp), slope * ramp], 1)
        lift = np.stack([np.zeros_like(knot), knot, -0.12 * knot], 1)
        for (across, upward), name, share in zip(numbers, names, (inner, outer), strict=True):
            for number, on_lips, shape, direction in (
                (across, draw, out_shape, side * LEFT),
                (upward, lift, up_shape, UP),
            ):
                field = (1 - cheek)[:, None] * on_lips * mouth[:, None] + cheek[:, None] * shape
                field = field * share[:, None]
                field = np.where((lips.distance > 0.0005)[:, None], figure.smoothed(field, 3), field)
                out[number] = scaled(field, points[name], direction)
    return out
