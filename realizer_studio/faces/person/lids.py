"""The displacement fields of the eyelids, which close along the whole opening, and the tear lines."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from realizer.core.array_types import Float64
from realizer.face.mesh_geometry import grid
from realizer_studio.faces.parts import Part, Submesh, smooth
from realizer_studio.faces.person.makehuman import FORWARD, UP, Figure, scaled, walk

# Two vertices each of the rings around the left eye, from the edge of the lid outwards.
RINGS = ((13352, 13369), (6785, 6844), (11465, 11485), (6787, 6845), (6789, 6846), (11515, 11493))

DEEP, LINING = 6, 0.85  # rings of the lining that follow the edge; ratio of neighbouring rings' movement


class Lid:
    """The lids of one eye.

    Attributes:
        rings: base vertices around the eye, from the lid's edge outwards.
        upper: the edge's upper vertices, from inner to outer corner.
        lower: its lower vertices; inner, outer: the vertices of the corners.
        aperture: metres between the feature points of the upper and the lower lid.
        x, high, low: |x| from corner to corner, and the heights of upper and lower edge there.
    """

    def __init__(self, figure: Figure, side: int) -> None:
        self.side = side
        at = figure.at
        edges = figure.mesh.edges
        rings = []
        for first, _ in RINGS:
            tips = [next(iter(e - {first})) for e in edges if first in e]
            found = [walk(edges, first, tip) for tip in tips]
            rings.append(next(ring for ring in found if len(ring) == 28))
        if side < 0:
            twin = figure.mesh.mirror()
            rings = [[int(i) for i in twin[ring]] for ring in rings]
        self.rings = rings
        edge = rings[0]
        # The ring is widest a little above the corner where the lids meet.
        inner, outer = (figure.points[name] for name in (("3.11", "3.7") if side > 0 else ("3.8", "3.12")))
        self.inner, self.outer = inner, outer
        turned = edge[edge.index(inner) :] + edge[: edge.index(inner)]
        cut = turned.index(outer)
        one, other = turned[: cut + 1], [inner, *turned[: cut - 1 : -1]]
        self.upper, self.lower = (one, other) if at[one, 1].mean() > at[other, 1].mean() else (other, one)
        names = ("3.1", "3.3") if side > 0 else ("3.2", "3.4")
        self.aperture = float(at[figure.points[names[0]], 1] - at[figure.points[names[1]], 1])
        x = np.linspace(at[inner, 0] * side, at[outer, 0] * side, 60)
        high, low = (np.interp(x, at[row, 0] * side, at[row, 1]) for row in (self.upper, self.lower))
        self.x, self.high, self.low = x, high, low

    def followers(self, figure: Figure) -> tuple[dict[int, int], list[tuple[int, list[int], int]]]:
        """Return the vertices that follow each vertex of the edge.

        Returns:
            vertex of a ring -> the vertex of the edge that it follows; and for the vertices of the lids'
            lining, inwards: (vertex, vertices that it follows, steps from the edge).
        """
        near = figure.average
        beside = {
            int(i): {int(j) for j in near.indices[near.indptr[i] : near.indptr[i + 1]]}
            for i in np.flatnonzero(np.linalg.norm(figure.at - figure.at[self.inner], axis=1) < 0.06)
        }
        leader = {vertex: vertex for vertex in self.rings[0]}
        for last, ring in pairwise(self.rings):
            for vertex in ring:
                # Several vertices meet at a corner: the nearest one is followed.
                candidates = [other for other in last if other in beside[vertex]] or last
                distance = ((figure.at[candidates] - figure.at[vertex]) ** 2).sum(axis=1)
                leader[vertex] = leader[candidates[int(np.argmin(distance))]]
        visited, front, lining = set(leader), list(self.rings[0]), []
        for depth in range(1, DEEP + 1):
            inwards: dict[int, list[int]] = {}
            for vertex in front:
                for other in beside[vertex] - visited:
                    inwards.setdefault(other, []).append(vertex)
            lining += [(vertex, parents, depth) for vertex, parents in inwards.items()]
            visited |= set(inwards)
            front = list(inwards)
        return leader, lining

    def gap(self, x: Float64) -> Float64:
        """Return the distance between the lids at x in metres, 0 beyond the corners."""
        return np.asarray(
            np.interp(x * self.side, self.x, np.maximum(self.high - self.low, 0), left=0, right=0)
        )

    def gap_of(self, at: Float64, upper: bool) -> Float64:
        """Return the vertical distance from each vertex of the upper (lower) edge to the other edge."""
        edge, other = (self.upper, self.lower) if upper else (self.lower, self.upper)
        x, order = at[other, 0] * self.side, np.argsort(at[other, 0] * self.side, kind="stable")
        opposite = np.interp(at[edge, 0] * self.side, x[order], at[other, 1][order])
        out = np.maximum((at[edge, 1] - opposite) * (1 if upper else -1), 0)
        out[[0, -1]] = 0
        return np.asarray(out)

    def middle(self, x: Float64) -> Float64:
        """Return the height half-way between the lids at x."""
        return np.asarray(np.interp(x * self.side, self.x, (self.high + self.low) / 2))


def lid_fields(figure: Figure) -> dict[int, Float64]:
    """Return the fields of FAPs 19-22, 27 and 28 on the lids; `deform` keeps lids outside the eyeballs."""
    out = {}
    for side, numbers, names in ((1, (19, 21), ("3.1", "3.3")), (-1, (20, 22), ("3.2", "3.4"))):
        lid = Lid(figure, side)
        at = figure.at
        centre = (at[lid.inner] + at[lid.outer]) / 2
        word = "Left" if side > 0 else "Right"
        blink = np.where(figure.body[:, None], figure.shape(f"eyeBlink{word}"), 0)
        near_eye = np.linalg.norm(at - centre, axis=1) < 0.05
        above = at[:, 1] > lid.middle(at[:, 0])
        edge_x = np.clip(at[:, 0] * side, lid.x[0], lid.x[-1]) * side
        gap = lid.gap(edge_x) / lid.aperture
        ringed, lining = lid.followers(figure)
        # FAPs 27 and 28 push an eyeball out, and its lids with it.
        ball = figure.ellipsoid(centre + FORWARD * 0.002, (0.027, 0.021, 0.034), 0.50)
        out[27 if side > 0 else 28] = figure.smoothed(ball, 2)[:, None] * FORWARD
        # A vertex moves with the edge by a share that falls with its distance above (below) the edge; the
        # CC0 blink shape shows where the upper lid ends.
        for number, name, upper in ((numbers[0], names[0], True), (numbers[1], names[1], False)):
            row = lid.upper if upper else lid.lower
            edge = np.zeros(len(at))
            edge[row] = lid.gap_of(at, upper) / lid.aperture
            # Near the corners the opening is steep: vertices follow the edge vertex that they lie behind,
            # not the one at the same x.
            opening, on_lid = gap.copy(), above if upper else ~above
            for vertex, leader in ringed.items():
                opening[vertex] = edge[leader]
                on_lid[vertex] = leader in row
            edge_y = np.interp(at[:, 0] * side, at[row, 0] * side, at[row, 1])
            edge_distance = (at[:, 1] - edge_y) * (1 if upper else -1)
            reach = 0.0105 if upper else 0.013
            share = smooth(edge_distance, reach, -0.0005)
            if upper:
                fallen = np.clip(-blink[:, 1] / np.max(-blink[lid.upper, 1]), 0, 1)
                share = np.maximum(share, 0.0) * smooth(fallen, 0.0, 0.10)
            # Beyond the corners the movement fades.
            past = np.maximum(lid.x[0] - at[:, 0] * side, at[:, 0] * side - lid.x[-1])
            share = share * smooth(past, 0.006, -0.002)
            deep = figure.ellipsoid(centre, (0.045, 0.045, 0.030), 0.6)
            weight = np.where(near_eye & on_lid, share * opening, 0) * deep
            weight = _edged(figure.smoothed(weight, 2), edge, lid, ringed, lining)
            out[number] = scaled(
                weight[:, None] * (-UP if upper else UP), figure.points[name], -UP if upper else UP
            )
    return out


def _edged(
    weight: Float64, edge: Float64, lid: Lid, ringed: dict[int, int], lining: list[tuple[int, list[int], int]]
) -> Float64:
    """Return the weight with the edge, front and lining of the lid moving together: a lid is thick."""
    out = weight.copy()
    out[lid.rings[0]] = edge[lid.rings[0]]
    for vertex in lid.rings[1]:
        out[vertex] = edge[ringed[vertex]]
    for vertex, parents, depth in lining:
        out[vertex] = out[parents].mean() * LINING**depth
    return out


TALL = 0.00045  # m; height of the tear line on the eye
# Rings from the lid's edge up the eye: share of the height, and of the edge's distance from the eye.
TEAR_RINGS = (0.0, 1.0), (0.4, 0.3), (1.0, 0.0)
THIN = 0.00015  # m between the eye and the upper edge of the tear line
DARK = 0.78  # brightness of tears relative to the pink of the eye's corner, which shows through


def tears(
    figure: Figure, lids: Sequence[Lid], eyes: Sequence[tuple[Float64, float]], pink: Sequence[float]
) -> Part:
    """Return the tear lines of both eyes, which follow the edges of the lids.

    Args:
        eyes: centre (3,) and radius of each ball.
        pink: sRGB, of the eye's corner.
    """
    positions: list[Float64] = []
    sources: list[int] = []
    triangles = []
    for lid, (centre, radius) in zip(lids, eyes, strict=True):
        edge = figure.at[lid.lower]
        count = len(edge)
        # The tear line gets thin towards the corners.
        tall = TALL * np.sqrt(np.sin(np.pi * np.arange(count) / (count - 1)))
        room = np.linalg.norm(edge - centre, axis=1) - radius
        rows = []
        for share, before in TEAR_RINGS:
            direction = edge + share * tall[:, None] * UP - centre
            far = radius + THIN + before * np.maximum(room - THIN, 0)
            rows.append(centre + direction * (far / np.linalg.norm(direction, axis=1))[:, None])
        turned = grid(len(TEAR_RINGS), count)
        triangles.append((turned if lid.side < 0 else turned[:, ::-1]) + len(sources))
        positions.append(np.concatenate(rows))
        sources += lid.lower * len(TEAR_RINGS)
    at, source = np.concatenate(positions), np.array(sources)
    n, tint = len(at), DARK * np.array(pink, float)
    mix = sp.csr_matrix((np.ones(n), (np.arange(n), source)), (n, len(figure.at)))
    patch = Submesh(mix, at - figure.at[source], np.concatenate(triangles).astype(np.int32))
    return Part("tears", patch, at, patch.triangles, np.tile(tint, (n, 1)), np.ones(n), np.full(n, 0.85))
