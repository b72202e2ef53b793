"""The eyelids, whose edges slide along the opening so that both meet, and the wet line on the lower ones."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from realizer.core.array_types import Float64
from realizer.face.mesh_geometry import grid
from realizer_studio.faces.parts import Part, Submesh, smooth
from realizer_studio.faces.person.makehuman import FORWARD, UP, Ground, scaled, walk

# Two vertices each of the rings around the left eye, from the edge of the lid outwards.
RINGS = ((13352, 13369), (6785, 6844), (11465, 11485), (6787, 6845), (6789, 6846), (11515, 11493))

DEEP, LINING = 6, 0.85  # rings of the lining that follow the edge; the share that each passes on


class Lid:
    """The lids of one eye.

    Attributes:
        rings: base vertices around the eye, from the lid's edge outwards.
        upper: the edge's upper vertices, from inner to outer corner.
        opening: x (|x|, metres) -> how far the lids are apart there, relative to the feature points.
    """

    def __init__(self, ground: Ground, side: int) -> None:
        self.side = side
        at = ground.at
        edges = ground.mesh.edges
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
        # The ring is widest a little above the corner where the lids meet.
        inner, outer = (ground.points[name] for name in (("3.11", "3.7") if side > 0 else ("3.8", "3.12")))
        self.inner, self.outer = inner, outer
        turned = edge[edge.index(inner) :] + edge[: edge.index(inner)]
        cut = turned.index(outer)
        one, other = turned[: cut + 1], [inner, *turned[: cut - 1 : -1]]
        self.upper, self.lower = (one, other) if at[one, 1].mean() > at[other, 1].mean() else (other, one)
        names = ("3.1", "3.3") if side > 0 else ("3.2", "3.4")
        self.aperture = float(at[ground.points[names[0]], 1] - at[ground.points[names[1]], 1])
        x = np.linspace(at[inner, 0] * side, at[outer, 0] * side, 60)
        high, low = (np.interp(x, at[row, 0] * side, at[row, 1]) for row in (self.upper, self.lower))
        self.x, self.high, self.low = x, high, low

    def followers(self, ground: Ground) -> tuple[dict[int, int], list[tuple[int, list[int], int]]]:
        """Return the vertices that follow each vertex of the edge.

        Returns:
            vertex of a ring -> the edge's vertex that it lies behind; and of the lids' lining, inwards:
            (vertex, those that it follows, how many steps from the edge).
        """
        near = ground.average
        beside = {
            int(i): {int(j) for j in near.indices[near.indptr[i] : near.indptr[i + 1]]}
            for i in np.flatnonzero(np.linalg.norm(ground.at - ground.at[self.inner], axis=1) < 0.06)
        }
        leader = {vertex: vertex for vertex in self.rings[0]}
        for last, ring in pairwise(self.rings):
            for vertex in ring:
                # Behind a corner several meet: the nearest one leads.
                found = [other for other in last if other in beside[vertex]] or last
                away = ((ground.at[found] - ground.at[vertex]) ** 2).sum(axis=1)
                leader[vertex] = leader[found[int(np.argmin(away))]]
        known, front, lining = set(leader), list(self.rings[0]), []
        for depth in range(1, DEEP + 1):
            inwards: dict[int, list[int]] = {}
            for vertex in front:
                for other in beside[vertex] - known:
                    inwards.setdefault(other, []).append(vertex)
            lining += [(vertex, parents, depth) for vertex, parents in inwards.items()]
            known |= set(inwards)
            front = list(inwards)
        return leader, lining

    def gap(self, x: Float64) -> Float64:
        """Return the distance between the lids at x in metres, 0 beyond the corners."""
        return np.asarray(
            np.interp(x * self.side, self.x, np.maximum(self.high - self.low, 0), left=0, right=0)
        )

    def gap_of(self, at: Float64, upper: bool) -> Float64:
        """Return the distance from each vertex of the upper (lower) edge straight to the other edge."""
        mine, other = (self.upper, self.lower) if upper else (self.lower, self.upper)
        x, order = at[other, 0] * self.side, np.argsort(at[other, 0] * self.side, kind="stable")
        there = np.interp(at[mine, 0] * self.side, x[order], at[other, 1][order])
        out = np.maximum((at[mine, 1] - there) * (1 if upper else -1), 0)
        out[[0, -1]] = 0
        return np.asarray(out)

    def middle(self, x: Float64) -> Float64:
        """Return the height half-way between the lids at x."""
        return np.asarray(np.interp(x * self.side, self.x, (self.high + self.low) / 2))


def lid_fields(ground: Ground) -> dict[int, Float64]:
    """Return fields of FAPs 19-22, and of the lids under 27 and 28; `deform` pushes them over the balls."""
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
        ringed, lining = lid.followers(ground)
        # A ball that is pushed out takes the lids along; nothing else on the face does.
        ball = ground.ellipsoid(centre + FORWARD * 0.002, (0.027, 0.021, 0.034), 0.50)
        out[27 if side > 0 else 28] = ground.smoothed(ball, 2)[:, None] * FORWARD
        # The share of the edge's movement by a vertex's distance above (below) the edge; the CC0 blink
        # says where the lid ends.
        for number, name, upper in ((numbers[0], names[0], True), (numbers[1], names[1], False)):
            row = lid.upper if upper else lid.lower
            edge = np.zeros(len(at))
            edge[row] = lid.gap_of(at, upper) / lid.aperture
            # Near the corners the opening is steep: vertices beyond an edge vertex follow that vertex, not
            # the one at their own x.
            led, mine = gap.copy(), above if upper else ~above
            for vertex, leader in ringed.items():
                led[vertex] = edge[leader]
                mine[vertex] = leader in row
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
            deep = ground.ellipsoid(centre, (0.045, 0.045, 0.030), 0.6)
            weight = np.where(here & mine, share * led, 0) * deep
            weight = _edged(ground.smoothed(weight, 2), edge, lid, ringed, lining)
            out[number] = scaled(
                weight[:, None] * (-UP if upper else UP), ground.points[name], -UP if upper else UP
            )
    return out


def _edged(
    weight: Float64, edge: Float64, lid: Lid, ringed: dict[int, int], lining: list[tuple[int, list[int], int]]
) -> Float64:
    """Return the weight with the lid's edge, front and lining moving as one, because a lid is thick."""
    out = weight.copy()
    out[lid.rings[0]] = edge[lid.rings[0]]
    for vertex in lid.rings[1]:
        out[vertex] = edge[ringed[vertex]]
    for vertex, parents, depth in lining:
        out[vertex] = out[parents].mean() * LINING**depth
    return out


TALL = 0.00045  # m up the eye
# From the lid's edge up the eye: share of the way, and of the edge's distance from the eye; tears are hollow.
TEAR_RINGS = (0.0, 1.0), (0.4, 0.3), (1.0, 0.0)
THIN = 0.00015  # m before the eye at the top
DARK = 0.78  # brightness of tears beside the pink of the eye's corner, which is seen through them


def tears(
    ground: Ground, lids: Sequence[Lid], eyes: Sequence[tuple[Float64, float]], pink: Sequence[float]
) -> Part:
    """Return the strips of both eyes, which follow the edges of the lids.

    Args:
        eyes: centre (3,) and radius of each ball.
        pink: sRGB, of the eye's corner.
    """
    places: list[Float64] = []
    sources: list[int] = []
    triangles = []
    for lid, (centre, radius) in zip(lids, eyes, strict=True):
        edge = ground.at[lid.lower]
        count = len(edge)
        # Into the corners it gets thin.
        tall = TALL * np.sqrt(np.sin(np.pi * np.arange(count) / (count - 1)))
        room = np.linalg.norm(edge - centre, axis=1) - radius
        rows = []
        for share, before in TEAR_RINGS:
            way = edge + share * tall[:, None] * UP - centre
            far = radius + THIN + before * np.maximum(room - THIN, 0)
            rows.append(centre + way * (far / np.linalg.norm(way, axis=1))[:, None])
        turned = grid(len(TEAR_RINGS), count)
        triangles.append((turned if lid.side < 0 else turned[:, ::-1]) + len(sources))
        places.append(np.concatenate(rows))
        sources += lid.lower * len(TEAR_RINGS)
    at, source = np.concatenate(places), np.array(sources)
    n, tint = len(at), DARK * np.array(pink, float)
    mix = sp.csr_matrix((np.ones(n), (np.arange(n), source)), (n, len(ground.at)))
    patch = Submesh(mix, at - ground.at[source], np.concatenate(triangles).astype(np.int32))
    return Part("tears", patch, at, patch.triangles, np.tile(tint, (n, 1)), np.ones(n), np.full(n, 0.85))
