"""The eyelids: each edge falls along the eye's own opening, so that upper and lower meet all along it."""

from __future__ import annotations

import numpy as np

from realizer.arrays import Float64
from realizer.face.ground import FORWARD, UP, Ground, scaled
from realizer.face.parts import smooth

__all__: list[str] = []

# Two vertices each of the rings around the left eye, from the edge of the lid outwards.
RINGS = ((13352, 13369), (6785, 6844), (11465, 11485), (6787, 6845), (6789, 6846), (11515, 11493))


class Lid:
    """One eye's lids.

    Attributes:
        rings: base vertices around the eye, from the lid's edge outwards.
        upper: the edge's upper vertices, from inner to outer corner.
        opening: x (|x|, metres) -> how far the lids are apart there, relative to the feature points.
    """

    def __init__(self, ground: Ground, side: int) -> None:
        from realizer.face.hm08 import walk

        self.side = side
        at = ground.at
        edges = ground.mesh.edges()
        rings = []
        for first, _ in RINGS:
            tips = [next(iter(e - {first})) for e in edges if first in e]
            found = [walk(edges, first, tip) for tip in tips]
            rings.append(next(ring for ring in found if len(ring) == 28))
        if side < 0:
            twin = ground.mesh.mirror()
            rings = [[int(i) for i in twin[ring]] for ring in rings]
        self.rings = rings
        edge = rings[0]
        inner = min(edge, key=lambda i: float(at[i, 0] * side))
        outer = max(edge, key=lambda i: float(at[i, 0] * side))
        self.inner, self.outer = inner, outer
        one, other = self._halves(edge, inner, outer)
        self.upper, self.lower = (one, other) if at[one, 1].mean() > at[other, 1].mean() else (other, one)
        names = ("3.1", "3.3") if side > 0 else ("3.2", "3.4")
        self.aperture = float(at[ground.points[names[0]], 1] - at[ground.points[names[1]], 1])
        x = np.linspace(at[inner, 0] * side, at[outer, 0] * side, 60)
        high, low = (np.interp(x, at[row, 0] * side, at[row, 1]) for row in (self.upper, self.lower))
        self.x, self.high, self.low = x, high, low

    @staticmethod
    def _halves(ring: list[int], inner: int, outer: int) -> tuple[list[int], list[int]]:
        turned = ring[ring.index(inner) :] + ring[: ring.index(inner)]
        cut = turned.index(outer)
        return turned[: cut + 1], [inner, *turned[: cut - 1 : -1]]

    def gap(self, x: Float64) -> Float64:
        """Metres between the lids at x, 0 beyond the corners."""
        return np.asarray(
            np.interp(x * self.side, self.x, np.maximum(self.high - self.low, 0), left=0, right=0)
        )

    def middle(self, x: Float64) -> Float64:
        """Height half-way between the lids at x."""
        return np.asarray(np.interp(x * self.side, self.x, (self.high + self.low) / 2))


def lid_fields(ground: Ground) -> dict[int, Float64]:
    """Fields of FAPs 19-22, and what 27 and 28 do to the lids; `deform` pushes them over the balls."""
    out = {}
    for side, numbers, names in ((1, (19, 21), ("3.1", "3.3")), (-1, (20, 22), ("3.2", "3.4"))):
        lid = Lid(ground, side)
        at = ground.at
        centre = (at[lid.inner] + at[lid.outer]) / 2
        word = "Left" if side > 0 else "Right"
        blink = np.where(ground.body[:, None], ground.shape(f"eyeBlink{word}"), 0)
        here = np.linalg.norm(at - centre, axis=1) < 0.05
        above = at[:, 1] > lid.middle(at[:, 0])
        edge_x = np.clip(at[:, 0] * side, lid.x[0], lid.x[-1]) * side
        gap = lid.gap(edge_x) / lid.aperture
        # A ball that is pushed out takes the lids along; nothing else on the face does.
        ball = ground.ellipsoid(centre + FORWARD * 0.002, (0.036, 0.026, 0.034), 0.55)
        out[27 if side > 0 else 28] = ground.smoothed(ball, 1)[:, None] * FORWARD
        # How much of the edge's way a vertex goes: by how far above (below) the edge it lies; the CC0 blink
        # says where the lid ends.
        for number, name, upper in ((numbers[0], names[0], True), (numbers[1], names[1], False)):
            row = lid.upper if upper else lid.lower
            edge_y = np.interp(at[:, 0] * side, at[row, 0] * side, at[row, 1])
            off = (at[:, 1] - edge_y) * (1 if upper else -1)
            reach = 0.0105 if upper else 0.013
            share = smooth(off, reach, -0.0005)
            if upper:
                fallen = np.clip(-blink[:, 1] / np.max(-blink[lid.upper, 1]), 0, 1)
                share = np.maximum(share, 0.0) * smooth(fallen, 0.0, 0.10)
            # Beyond the corners the pull dies away.
            past = np.maximum(lid.x[0] - at[:, 0] * side, at[:, 0] * side - lid.x[-1])
            share = share * smooth(past, 0.006, -0.002)
            side_of = above if upper else ~above
            deep = ground.ellipsoid(centre, (0.045, 0.045, 0.030), 0.6)
            weight = np.where(here & side_of, share * gap, 0) * deep
            soft = ground.smoothed(weight, 2)
            fixed = np.zeros(len(at), bool)
            for ring in lid.rings[:2]:
                fixed[ring] = True
            weight = np.where(fixed, weight, soft)
            for ring in lid.rings[:2]:
                for vertex in ring:
                    belongs = above[vertex] if upper else not above[vertex]
                    weight[vertex] = gap[vertex] if belongs else 0.0
            out[number] = scaled(
                weight[:, None] * (-UP if upper else UP), ground.points[name], -UP if upper else UP
            )
    return out
