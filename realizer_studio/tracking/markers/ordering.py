"""The order of markers: which blob of a picture is which point (Wojdel 2005, 7.1.3)."""

from collections.abc import Iterable, Sequence

import numpy as np

from realizer.core.array_types import Float64, Index
from realizer_studio.tracking.markers.layout import Layout, broken, constraints

REACH = 0.45  # of the least usual distance of neighbours: how far a marker moves from picture to picture
WIDER = (1.0, 1.5, 2.0)  # radii that are tried one after the other
TURNS = np.radians((0, -12, 12, -25, 25))  # of the head, which are tried where a face is looked for
FAR = 0.35  # of the layout's size: the farthest that a marker is from where the layout puts it
FITS = 12  # rounds of the fit of a layout
ENOUGH = 0.6  # share of the markers that is needed to know where the face is
NEIGHBOURS = 5  # that a lost marker moves with
EXCHANGES = 12  # pairs that are forbidden before points are given up
NEVER = 1e12
MISSING = -1
COMPLEX = np.array([1, 1j])  # x and y as one number


class Order:
    """Follows the markers of a face from picture to picture.

    Places have x to the right and y up, in pixels.
    """

    def __init__(self, layout: Layout) -> None:
        """
        Args:
            layout: in pixels, where the face is in the first picture that is passed on.
        """
        self.layout = layout
        self._rules = constraints(layout)
        apart = np.linalg.norm(layout.places[:, None] - layout.places, axis=-1)
        self._near = np.argsort(apart, axis=1, kind="stable")[:, 1 : NEIGHBOURS + 1]
        self._radius = REACH * float(np.quantile(np.sort(apart, axis=1)[:, 1], 0.2))
        self._last = layout.places.copy()

    def __call__(self, blobs: Float64) -> Float64:
        """Return the places (k, 2) of the points among blobs (n, 3) of the next picture; NaN: missing."""
        chosen = self._chosen(blobs)
        if (chosen != MISSING).sum() < ENOUGH * len(self.layout):
            placed, _ = locate(self.layout, blobs)
            if placed is None:
                return np.full((len(self.layout), 2), np.nan)
            self._last = placed
            chosen = self._chosen(blobs)
        found = _taken(blobs, chosen)
        self._advance(found)
        return found

    def _chosen(self, blobs: Float64) -> Index:
        """Return the row of the blob of each point, or MISSING, after the shift of all was found."""
        wide = _assigned(self._last, blobs, self.layout.colours, 2 * WIDER[-1] * self._radius, {})
        moved = _taken(blobs, wide) - self._last
        there = np.isfinite(moved[:, 0])
        expected = self._last + (np.median(moved[there], axis=0) if there.any() else 0.0)
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
        """Return the assignment of least cost that keeps the constraints.

        As long as some are broken, the pair that breaks most is forbidden; in the end, its point is missing.
        """
        forbidden: set[tuple[int, int]] = set()
        while True:
            chosen = _assigned(expected, blobs, self.layout.colours, radius, forbidden)
            wrong = broken(_taken(blobs, chosen), self._rules)
            if not wrong.any():
                return chosen
            away = np.nan_to_num(np.linalg.norm(_taken(blobs, chosen) - expected, axis=1))
            worst = int(np.lexsort((away, wrong))[-1])
            if len(forbidden) < EXCHANGES:
                forbidden.add((worst, int(chosen[worst])))
            else:
                forbidden |= {(worst, k) for k in range(len(blobs))}

    def _advance(self, found: Float64) -> None:
        """Keep where points were seen last; those that are missing move with their neighbours."""
        moved = found - self._last
        there = np.isfinite(moved[:, 0])
        if not there.any():
            return
        usual = np.median(moved[there], axis=0)
        for k in np.flatnonzero(~there):
            near = self._near[k][there[self._near[k]]]
            moved[k] = moved[near].mean(axis=0) if len(near) else usual
        self._last = self._last + moved


def order(pictures: Sequence[Float64], layout: Layout, start: int) -> Float64:
    """Return the places (n, k, 2) of the points in pictures, NaN for missing ones; x right, y up.

    Args:
        pictures: blobs (m, 3) of each.
        layout: in pixels, as it lies in picture `start`.
    """
    found = np.full((len(pictures), len(layout), 2), np.nan)
    for numbers in (range(start, len(pictures)), range(start - 1, -1, -1)):
        follow = Order(layout)
        for k in numbers:
            found[k] = follow(pictures[k])
    return found


def locate(layout: Layout, blobs: Float64) -> tuple[Float64 | None, float]:
    """Return where the points (k, 2) of a layout are among blobs, and how far off they are on average.

    The layout is turned, moved and stretched until its points are near blobs of their colours (iterative
    closest points); the best of several turns is taken. None: fewer blobs than needed.
    """
    if len(blobs) < max(3, ENOUGH * len(layout)):
        return None, np.inf
    best: tuple[Float64 | None, float] = None, np.inf
    centred = layout.places - layout.places.mean(axis=0)
    middle = np.median(blobs[:, :2], axis=0)
    spread = np.median(np.linalg.norm(blobs[:, :2] - middle, axis=1))
    scale = spread / max(float(np.median(np.linalg.norm(centred, axis=1))), 1e-9)
    for turn in TURNS:
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        placed = centred @ rotation.T * scale + middle
        for step in range(FITS):
            far = FAR * layout.size * scale * max(0.4, 2 - 2 * step / FITS)
            chosen = _assigned(placed, blobs, layout.colours, far, {})
            there = chosen != MISSING
            if there.sum() < 3:
                break
            placed = _fitted(centred, there, blobs[chosen[there], :2], affine=step > FITS // 2)
        off = np.linalg.norm(_taken(blobs, chosen) - placed, axis=1)
        cost = float(np.where(there, np.nan_to_num(off), far).mean())
        if there.sum() >= ENOUGH * len(layout) and cost < best[1]:
            best = placed, cost
    return best


def nearest(placed: Float64, layout: Layout, blobs: Float64) -> Float64:
    """Return the blobs (k, 2) of points that were located; a missing one is where it was placed."""
    chosen = _assigned(placed, blobs, layout.colours, FAR * layout.at(placed).size, {})
    found = _taken(blobs, chosen)
    return np.where(np.isfinite(found), found, placed)


def _fitted(centred: Float64, there: Index | Float64, places: Float64, *, affine: bool) -> Float64:
    """Return all points, moved by the map that fits some of them to places best."""
    some = centred[there]
    if affine and len(some) >= 6:
        ones = np.ones((len(some), 1))
        matrix = np.linalg.lstsq(np.hstack([some, ones]), places, rcond=None)[0]
        return np.asarray(np.hstack([centred, np.ones((len(centred), 1))]) @ matrix)
    a, b = some - some.mean(axis=0), places - places.mean(axis=0)
    # A turn and a scale, as one complex number.
    factor = np.vdot(a @ COMPLEX, b @ COMPLEX) / max(float(np.square(a).sum()), 1e-12)
    turned = (centred - some.mean(axis=0)) @ COMPLEX * factor
    return np.asarray(np.stack([turned.real, turned.imag], axis=1) + places.mean(axis=0))


def _assigned(
    expected: Float64, blobs: Float64, colours: Index, radius: float, forbidden: Iterable[tuple[int, int]]
) -> Index:
    """Return the row of the blob of each point: the least sum of squares; a missing point costs `radius`."""
    from scipy.optimize import linear_sum_assignment

    count = len(expected)
    cost = np.full((count, len(blobs) + count), NEVER)
    away = np.square(expected[:, None] - blobs[:, :2]).sum(axis=-1)
    possible = (away < radius**2) & (colours[:, None] == blobs[:, 2])
    cost[:, : len(blobs)][possible] = away[possible]
    for pair in forbidden:
        cost[pair] = NEVER
    cost[np.arange(count), len(blobs) + np.arange(count)] = radius**2
    chosen = linear_sum_assignment(cost)[1]
    return np.where(chosen < len(blobs), chosen, MISSING)


def _taken(blobs: Float64, chosen: Index) -> Float64:
    """Return the places (k, 2) of chosen blobs, NaN for MISSING."""
    places = np.vstack([blobs[:, :2], [[np.nan, np.nan]]])
    return np.asarray(places[chosen])
