"""The assignment of the blobs of a picture to points of a layout (Wojdel 2005, 7.1.3)."""

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from realizer.core.array_types import Float64, Index
from realizer_studio.tracking.markers.layout import Layout, broken, constraints

REACH = 0.45  # largest move of a marker between pictures, in distances of close neighbours
WIDER = (1.0, 1.5, 2.0)  # factors of that radius, tried in order
TURNS = np.radians((0, -12, 12, -25, 25))  # initial rotations of the head
FAR = 0.35  # largest distance of a marker from its point in the layout, relative to the layout's size
FITS = 12  # iterations of the fit of a layout
ENOUGH = 0.6  # least share of the markers that locates a face
NEIGHBOURS = 5  # that determine the motion of a lost marker
EXCHANGES = 12  # pairs that are forbidden before points are treated as missing
NEVER = 1e12
MISSING = -1
COMPLEX = np.array([1, 1j])  # x and y as one number


class Order:
    """A tracker of the markers of a face; positions have x to the right and y up, in pixels."""

    def __init__(self, layout: Layout) -> None:
        """
        Args:
            layout: in pixels, at its position in the first picture.
        """
        self.layout = layout
        self._rules = constraints(layout)
        apart = np.linalg.norm(layout.positions[:, None] - layout.positions, axis=-1)
        self._near = np.argsort(apart, axis=1, kind="stable")[:, 1 : NEIGHBOURS + 1]
        self._radius = REACH * float(np.quantile(np.sort(apart, axis=1)[:, 1], 0.2))
        self._last = layout.positions.copy()

    def __call__(self, blobs: Float64) -> Float64:
        """Return the positions (k, 2) of points among blobs (n, 3) of the next picture; NaN if missing."""
        chosen = self._chosen(blobs)
        if (chosen != MISSING).sum() < ENOUGH * len(self.layout):
            placed, _ = locate(self.layout, blobs)
            if placed is None:
                return np.full((len(self.layout), 2), np.nan)
            self._last = placed
            chosen = self._chosen(blobs)
        found = _positions_of(blobs, chosen)
        self._advance(found)
        return found

    def _chosen(self, blobs: Float64) -> Index:
        """Return the row of each point's blob, or MISSING, after estimating the common shift."""
        first_assignment = _assign(self._last, blobs, self.layout.colours, 2 * WIDER[-1] * self._radius, {})
        moved = _positions_of(blobs, first_assignment) - self._last
        known = np.isfinite(moved[:, 0])
        expected = self._last + (np.median(moved[known], axis=0) if known.any() else 0.0)
        best = None
        for wider in WIDER:
            found = self._consistent(expected, blobs, wider * self._radius)
            missing = int((found == MISSING).sum())
            if best is None or missing < (best == MISSING).sum():
                best = found
            if not missing or missing == len(found) or len(found) - missing == len(blobs):
                break
        assert best is not None
        return best

    def _consistent(self, expected: Float64, blobs: Float64, radius: float) -> Index:
        """Return the assignment of least cost that satisfies the constraints.

        The pair that breaks most constraints is forbidden, until none is broken; after `EXCHANGES` pairs, the
        point becomes missing.
        """
        forbidden: set[tuple[int, int]] = set()
        while True:
            chosen = _assign(expected, blobs, self.layout.colours, radius, forbidden)
            breaks = broken(_positions_of(blobs, chosen), self._rules)
            if not breaks.any():
                return chosen
            distance = np.nan_to_num(np.linalg.norm(_positions_of(blobs, chosen) - expected, axis=1))
            worst = int(np.lexsort((distance, breaks))[-1])
            if len(forbidden) < EXCHANGES:
                forbidden.add((worst, int(chosen[worst])))
            else:
                forbidden |= {(worst, k) for k in range(len(blobs))}

    def _advance(self, found: Float64) -> None:
        """Update the last positions; missing points move with their neighbours."""
        moved = found - self._last
        known = np.isfinite(moved[:, 0])
        if not known.any():
            return
        median_move = np.median(moved[known], axis=0)
        for k in np.flatnonzero(~known):
            neighbours = self._near[k][known[self._near[k]]]
            moved[k] = moved[neighbours].mean(axis=0) if len(neighbours) else median_move
        self._last = self._last + moved


def order(pictures: Sequence[Float64], layout: Layout, start: int) -> Float64:
    """Return the positions (n, k, 2) of the points in pictures, NaN for missing ones; x right, y up.

    Args:
        pictures: blobs (m, 3) of each.
        layout: in pixels, at its position in picture `start`.
    """
    found = np.full((len(pictures), len(layout), 2), np.nan)
    for numbers in (range(start, len(pictures)), range(start - 1, -1, -1)):
        follow = Order(layout)
        for k in numbers:
            found[k] = follow(pictures[k])
    return found


def locate(layout: Layout, blobs: Float64) -> tuple[Float64 | None, float]:
    """Return the positions (k, 2) of a layout among blobs, and their mean distance from the blobs.

    The layout is rotated, moved and stretched to blobs of its points' colours (iterative closest points),
    from several initial rotations. The positions are None if there are too few blobs.
    """
    if len(blobs) < max(3, ENOUGH * len(layout)):
        return None, np.inf
    best: tuple[Float64 | None, float] = None, np.inf
    centred = layout.positions - layout.positions.mean(axis=0)
    middle = np.median(blobs[:, :2], axis=0)
    spread = np.median(np.linalg.norm(blobs[:, :2] - middle, axis=1))
    scale = spread / max(float(np.median(np.linalg.norm(centred, axis=1))), 1e-9)
    for turn in TURNS:
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        positions = centred @ rotation.T * scale + middle
        for step in range(FITS):
            far = FAR * layout.size * scale * max(0.4, 2 - 2 * step / FITS)
            chosen = _assign(positions, blobs, layout.colours, far, {})
            known = chosen != MISSING
            if known.sum() < 3:
                break
            positions = _fit(centred, known, blobs[chosen[known], :2], affine=step > FITS // 2)
        distance = np.linalg.norm(_positions_of(blobs, chosen) - positions, axis=1)
        cost = float(np.where(known, np.nan_to_num(distance), far).mean())
        if known.sum() >= ENOUGH * len(layout) and cost < best[1]:
            best = positions, cost
    return best


def nearest(positions: Float64, layout: Layout, blobs: Float64) -> Float64:
    """Return the blobs (k, 2) of located points; a missing one keeps its located position."""
    chosen = _assign(positions, blobs, layout.colours, FAR * layout.with_positions(positions).size, {})
    found = _positions_of(blobs, chosen)
    return np.where(np.isfinite(found), found, positions)


def _fit(centred: Float64, chosen_rows: Index | Float64, targets: Float64, *, affine: bool) -> Float64:
    """Return all points, moved by the map that fits some of them best to targets."""
    some = centred[chosen_rows]
    if affine and len(some) >= 6:
        ones = np.ones((len(some), 1))
        matrix = np.linalg.lstsq(np.hstack([some, ones]), targets, rcond=None)[0]
        return np.asarray(np.hstack([centred, np.ones((len(centred), 1))]) @ matrix)
    a, b = some - some.mean(axis=0), targets - targets.mean(axis=0)
    # Rotation and scale as one complex number.
    factor = np.vdot(a @ COMPLEX, b @ COMPLEX) / max(float(np.square(a).sum()), 1e-12)
    turned = (centred - some.mean(axis=0)) @ COMPLEX * factor
    return np.asarray(np.stack([turned.real, turned.imag], axis=1) + targets.mean(axis=0))


def _assign(
    expected: Float64, blobs: Float64, colours: Index, radius: float, forbidden: Iterable[tuple[int, int]]
) -> Index:
    """Return the row of each point's blob by least squares; a missing point costs `radius` squared."""
    count = len(expected)
    cost = np.full((count, len(blobs) + count), NEVER)
    squares = np.square(expected[:, None] - blobs[:, :2]).sum(axis=-1)
    possible = (squares < radius**2) & (colours[:, None] == blobs[:, 2])
    cost[:, : len(blobs)][possible] = squares[possible]
    for pair in forbidden:
        cost[pair] = NEVER
    cost[np.arange(count), len(blobs) + np.arange(count)] = radius**2
    chosen = linear_sum_assignment(cost)[1]
    return np.where(chosen < len(blobs), chosen, MISSING)


def _positions_of(blobs: Float64, chosen: Index) -> Float64:
    """Return the positions (k, 2) of chosen blobs, NaN for MISSING."""
    positions = np.vstack([blobs[:, :2], [[np.nan, np.nan]]])
    return np.asarray(positions[chosen])
