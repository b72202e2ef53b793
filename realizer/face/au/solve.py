"""Points and how they moved in, the functions that move them so out (Wojdel 2005, 4.2.3)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from realizer.arrays import Float64
from realizer.face.au.functions import ANGLE, GAUSSIAN, angle, density, direction

__all__: list[str] = []

STILL = 0.35  # weight of a point that does not move: leaks count, but less than what is seen to move
SOFT = 0.004  # of the largest move; a miss below it counts by its square, so that the cost has a slope at 0
# Pull towards the start: too weak to change a fit to many points, it keeps what they do not decide from
# running away; of few landmarks more is undecided.
CALM, FEW = 1e-3, 5.0
# How often the weights of a sum of lengths are renewed: in the direction's cost, and in the joint one.
ROUNDS = (4, 8)


@dataclass(frozen=True)
class Free:
    """An affine map from the parameters that are free to all of them: symmetry is built in, not hoped for."""

    matrix: Float64
    offset: Float64

    def __call__(self, free: Any) -> Float64:
        return np.asarray(self.matrix @ free + self.offset)


def mirrored_angles() -> tuple[Free, Free]:
    """Alpha is a right angle plus what is odd in x, beta is even in x: both sides move as mirror images."""
    alpha = np.zeros((ANGLE, 7))
    start = np.zeros(ANGLE)
    for column, row in enumerate((0, 1, 2, 5, 12, 13, 15)):  # xx, yy, zz, yz times x; xy, xz; x
        alpha[row, column] = 1
    start[6], start[18] = 1, np.pi / 2
    beta = np.zeros((ANGLE, 13))
    for column, row in enumerate((0, 1, 2, 5, 7, 8, 9, 10, 11, 14, 16, 17, 18)):
        beta[row, column] = 1
    return Free(alpha, start), Free(beta, np.zeros(ANGLE))


def mirrored_gaussians(layout: str) -> Free:
    """`p` is a pair, one on each side; `c` lies in the middle: "pc" are three Gaussians."""
    blocks = []
    for kind in layout:
        if kind == "p":
            twin = np.diag([1.0, -1, 1, 1, 1, -1, 1, -1, 1, 1])
            blocks.append(np.concatenate([np.eye(GAUSSIAN), twin]))
        else:
            middle = np.eye(GAUSSIAN)
            blocks.append(middle[:, [0, 2, 3, 4, 6, 8, 9]])
    rows = sum(len(block) for block in blocks)
    matrix = np.zeros((rows, sum(block.shape[1] for block in blocks)))
    row = column = 0
    for block in blocks:
        matrix[row : row + len(block), column : column + block.shape[1]] = block
        row, column = row + len(block), column + block.shape[1]
    return Free(matrix, np.zeros(rows))


LAYOUTS = {1: ("c",), 2: ("c", "cc", "p"), 4: ("p", "pcc", "pp")}


@dataclass(frozen=True)
class Found:
    """What a fit found: (k, 10) Gaussians, (19,) alpha and beta; what it costs."""

    gaussians: Float64
    alpha: Float64
    beta: Float64
    cost: float


def least(residual: Callable[[Any], tuple[Float64, Float64]], start: Float64, evaluations: int) -> Float64:
    """The parameters that make the squares of the residual least; `residual` gives it and its derivatives."""
    from scipy.optimize import least_squares

    calm = max(CALM, FEW / len(residual(start)[0])) * np.eye(len(start))
    cache: dict[bytes, tuple[Float64, Float64]] = {}

    def both(x: Float64) -> tuple[Float64, Float64]:
        key = x.tobytes()
        if key not in cache:
            cache.clear()
            value, by = residual(x)
            cache[key] = np.concatenate([value, calm @ (x - start)]), np.concatenate([by, calm])
        return cache[key]

    def miss(x: Float64) -> Float64:
        return both(x)[0]

    def slopes(x: Float64) -> Float64:
        return both(x)[1]

    found = least_squares(miss, start, slopes, method="lm", x_scale="jac", max_nfev=evaluations)
    return np.asarray(found.x, np.float64)


def lengths(miss: Float64, weight: Float64) -> Float64:
    """Weights (n,) under which the sum of squares has the same slope as the weighted sum of lengths."""
    return np.asarray(np.sqrt(weight / np.sqrt((miss**2).sum(axis=1) + SOFT**2)))


class Fit:
    """The fit of one motion.

    Args:
        at: (n, 3) centimetres from the motion's origin; the half x >= 0 is enough.
        moves: (n, 3), the largest about 1.
        weight: (n,) how much each point counts.
    """

    def __init__(self, at: Float64, moves: Float64, weight: Float64) -> None:
        self.at, self.moves, self.weight = at, moves, weight
        self.length = np.linalg.norm(moves, axis=1)
        self.alpha, self.beta = mirrored_angles()

    def directions(self) -> list[tuple[Float64, float]]:
        """Free parameters of the direction function with its cost (4.8), the best first."""
        share = self.weight * self.length
        seen = self.length > 0.01
        at, moves, weight, length = self.at[seen], self.moves[seen], self.weight[seen], self.length[seen]
        mean = (share[:, None] * self.moves).sum(axis=0)
        lean = np.arctan2(mean[1], mean[2])
        found = []
        for tilt in (lean, lean + 1.2, lean - 1.2):
            for slope in (-0.4, 0.4):
                x = np.zeros(20)
                # The linear form of beta's cubic part must not start at 0 with its quadratic form.
                x[6], x[11], x[12], x[19] = slope, 0.01, 0.01, tilt
                for _ in range(ROUNDS[0]):
                    way = self._way(x, at)[0]
                    by = lengths(moves - length[:, None] * way, weight)

                    def residual(x: Float64, by: Float64 = by) -> tuple[Float64, Float64]:
                        way, slopes = self._way(x, at)
                        scale = (by * length)[:, None]
                        return (
                            (scale * way - by[:, None] * moves).ravel(),
                            (scale[:, None] * slopes).reshape(-1, 20),
                        )

                    x = least(residual, x, 12)
                miss = moves - length[:, None] * self._way(x, at)[0]
                found.append((x, float(weight @ np.linalg.norm(miss, axis=1))))
        return sorted(found, key=lambda one: one[1])

    def densities(self, layout: str) -> tuple[Float64, float]:
        """Free parameters of the density function of this layout with its cost (4.9)."""
        form = mirrored_gaussians(layout)
        x = np.array(list(self._bells(layout)))

        def residual(x: Float64) -> tuple[Float64, Float64]:
            value, slopes = density(form(x).reshape(-1, GAUSSIAN), self.at)
            by = np.sqrt(self.weight)
            return by * (value - self.length), by[:, None] * (slopes @ form.matrix)

        x = least(residual, x, 150)
        return x, float((residual(x)[0] ** 2).sum())

    def joint(self, layout: str, bells: Float64, angles: Float64) -> Found:
        """Both functions polished together: the least weighted sum of the lengths of the misses."""
        form = mirrored_gaussians(layout)
        split = len(bells)
        x = np.concatenate([bells, angles])

        def moved(x: Float64) -> tuple[Float64, Float64, Float64, Float64]:
            value, by_bell = density(form(x[:split]).reshape(-1, GAUSSIAN), self.at)
            way, by_angle = self._way(x[split:], self.at)
            return value, by_bell @ form.matrix, way, by_angle

        def miss(x: Float64) -> Float64:
            value, _, way, _ = moved(x)
            return np.asarray(value[:, None] * way - self.moves)

        best, cost = x, float(self.weight @ np.linalg.norm(miss(x), axis=1))
        for _ in range(ROUNDS[1]):
            by = lengths(miss(x), self.weight)

            def residual(x: Float64, by: Float64 = by) -> tuple[Float64, Float64]:
                value, by_bell, way, by_angle = moved(x)
                slopes = np.concatenate(
                    [way[:, :, None] * by_bell[:, None, :], value[:, None, None] * by_angle], axis=2
                )
                return (
                    (by[:, None] * (value[:, None] * way - self.moves)).ravel(),
                    (by[:, None, None] * slopes).reshape(-1, len(x)),
                )

            x = least(residual, x, 25)
            now = float(self.weight @ np.linalg.norm(miss(x), axis=1))
            if now > cost * 0.999:
                best, cost = (x, now) if now < cost else (best, cost)
                break
            best, cost = x, now
        return Found(
            form(best[:split]).reshape(-1, GAUSSIAN),
            self.alpha(best[split : split + 7]),
            self.beta(best[split + 7 :]),
            cost,
        )

    def best(self, most: int, say: Callable[[str], None] = lambda _: None) -> Found:
        """The best of the layouts with up to `most` Gaussians (2: her published form)."""
        ways = self.directions()
        ways = [ways[0], *(one for one in ways[1:] if one[1] > ways[0][1] * 1.02)][:2]
        found = []
        for layout in LAYOUTS[most]:
            bells, _ = self.densities(layout)
            for angles, _ in ways if len(layout) < 3 else ways[:1]:
                found.append(self.joint(layout, bells, angles))
                say(f"{layout} {found[-1].cost:.3f}")
        return min(found, key=lambda one: one.cost)

    def _way(self, x: Float64, at: Float64) -> tuple[Float64, Float64]:
        """Directions (n, 3) and their derivatives (n, 3, 20) by the free parameters."""
        alpha, by_alpha = angle(self.alpha(x[:7]), at)
        beta, by_beta = angle(self.beta(x[7:]), at)
        way, turned, raised = direction(alpha, beta)
        return way, np.concatenate(
            [
                turned[:, :, None] * (by_alpha @ self.alpha.matrix)[:, None, :],
                raised[:, :, None] * (by_beta @ self.beta.matrix)[:, None, :],
            ],
            axis=2,
        )

    def _bells(self, layout: str) -> Iterator[float]:
        """Where the Gaussians start: over the moves' centre of gravity, each next one narrower."""
        share = self.weight * self.length**2
        share = share / share.sum()
        middle = share @ self.at
        spread = np.sqrt(share @ (self.at - middle) ** 2) + 0.15
        for k, kind in enumerate(layout):
            wide = 1 / (spread * (1.3, 0.7, 2.0)[k % 3])
            high = (1.0, 0.3, 0.15)[k % 3]
            x, y, z = middle[0], middle[1] + 0.3 * k, middle[2]
            if kind == "p":
                yield from (high, x, y, z, wide[0], 0, wide[1], 0, 0, wide[2])
            else:
                yield from (high, y, z, 1 / (1 / wide[0] + x), wide[1], 0, wide[2])
