"""The solver that fits displacement functions to moved points (Wojdel 2005, 4.2.3)."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from realizer.core.array_types import Float64
from realizer.face.au.functions import ANGLE, GAUSSIAN, angle, density, direction
from realizer_studio.faces.au.fit_limits import overshoot

UNMOVED_WEIGHT = 0.35  # weight of points that do not move, relative to points that do
SOFT = 0.004  # of the largest move; smaller residuals are squared, so that the cost is smooth at 0
# Regularisation towards the start keeps parameters bounded that landmarks leave undetermined. It is
# stronger for few landmarks.
CALM, FEW = 1e-3, 5.0
TINY = 1e-6  # least gain of a step, as a share of the cost
# Number of reweighting rounds for sums of lengths, in the direction's cost and in the joint one.
ROUNDS = (4, 8)


@dataclass(frozen=True)
class Free:
    """An affine map from free parameters to all parameters, which makes functions symmetric."""

    matrix: Float64
    offset: Float64

    def __call__(self, free: Any) -> Float64:
        return np.asarray(self.matrix @ free + self.offset)


def mirrored_angles() -> tuple[Free, Free]:
    """Return the maps of symmetric angles: alpha is a right angle plus an odd function of x, beta is even."""
    start = np.zeros(ANGLE)
    start[6], start[18] = 1, np.pi / 2
    alpha = np.eye(ANGLE)[:, [0, 1, 2, 5, 12, 13, 15]]  # xx, yy, zz, yz times x; xy, xz; x
    beta = np.eye(ANGLE)[:, [0, 1, 2, 5, 7, 8, 9, 10, 11, 14, 16, 17, 18]]
    return Free(alpha, start), Free(beta, np.zeros(ANGLE))


def mirrored_gaussians(layout: str) -> Free:
    """Return the map of Gaussians in a layout such as "pc": `p` is a symmetric pair, `c` a central one."""
    pair = np.concatenate([np.eye(GAUSSIAN), np.diag([1.0, -1, 1, 1, 1, -1, 1, -1, 1, 1])])
    middle = np.eye(GAUSSIAN)[:, [0, 2, 3, 4, 6, 8, 9]]
    matrix = block_diag(*(pair if kind == "p" else middle for kind in layout))
    return Free(matrix, np.zeros(len(matrix)))


PUBLISHED, EXTENDED = ("c", "cc", "p"), ("pp", "pcc")  # initial layouts; others grow from them
MOST = 4  # Gaussians of the extended form
WIDE = (0.6, 1.4)  # cm; initial widths of an added Gaussian


@dataclass(frozen=True)
class FitResult:
    """The result of a fit: layout, free parameters of its Gaussians and angles, and its cost."""

    layout: str
    bells: Float64
    angles: Float64
    cost: float

    @property
    def gaussians(self) -> Float64:
        """(k, 10)."""
        return mirrored_gaussians(self.layout)(self.bells).reshape(-1, GAUSSIAN)

    @property
    def alpha(self) -> Float64:
        """(19,)."""
        return mirrored_angles()[0](self.angles[:7])

    @property
    def beta(self) -> Float64:
        """(19,)."""
        return mirrored_angles()[1](self.angles[7:])


def least(residual: Callable[[Any], tuple[Float64, Float64]], start: Float64, evaluations: int) -> Float64:
    """Return the parameters of least squares; `residual` returns residuals and their derivatives.

    The Levenberg-Marquardt method on the normal equations, with the damping of Nielsen (1999): for some fifty
    parameters and thousands of residuals it is many times faster than scipy's, which factors the Jacobian.
    """
    calm = max(CALM, FEW / len(residual(start)[0])) ** 2

    def evaluate(x: Float64) -> tuple[float, Float64, Float64]:
        value, by = residual(x)
        deviation = x - start
        square = by.T @ by
        square[np.diag_indices_from(square)] += calm
        return float(value @ value + calm * deviation @ deviation), by.T @ value + calm * deviation, square

    x = start
    cost, slope, square = evaluate(x)
    scale = np.diag(square).copy()
    damping, growth = 1e-3, 2.0
    for _ in range(evaluations):
        step = np.linalg.solve(square + np.diag(damping * scale), -slope)
        # The predicted gain is half the decrease of the quadratic model.
        predicted = float(step @ (damping * scale * step - slope))
        if predicted <= TINY * cost:
            break
        new_cost, new_slope, new_square = evaluate(x + step)
        if new_cost < cost:
            gain = (cost - new_cost) / predicted
            small = cost - new_cost <= TINY * cost
            x, cost, slope, square = x + step, new_cost, new_slope, new_square
            scale = np.maximum(scale, np.diag(square))
            damping, growth = damping * max(1 / 3, 1 - (2 * gain - 1) ** 3), 2.0
            if small:
                break
        else:
            damping, growth = damping * growth, growth * 2
    return np.asarray(x, np.float64)


def lengths(miss: Float64, weight: Float64) -> Float64:
    """Return weights (n,) for which the sum of squares has the slope of the weighted sum of lengths."""
    return np.asarray(np.sqrt(weight / np.sqrt((miss**2).sum(axis=1) + SOFT**2)))


class Fit:
    """The fit of one motion.

    Args:
        at: (n, 3) centimetres from the motion's origin; the half x >= 0 is enough.
        moves: (n, 3), the largest about 1.
        weight: (n,) of the points.
        around: (k, 3) centimetres, points that may not move much further than 1 (`fit_limits.overshoot`).
    """

    def __init__(self, at: Float64, moves: Float64, weight: Float64, around: Float64) -> None:
        self.at, self.moves, self.weight, self.around = at, moves, weight, around
        self.length = np.linalg.norm(moves, axis=1)
        self.alpha, self.beta = mirrored_angles()

    def directions(self) -> list[tuple[Float64, float]]:
        """Return free parameters of the direction function with their costs (4.8), the best first."""
        share = self.weight * self.length
        moving = self.length > 0.01
        at, moves, weight, length = (
            self.at[moving],
            self.moves[moving],
            self.weight[moving],
            self.length[moving],
        )
        mean = (share[:, None] * self.moves).sum(axis=0)
        lean = np.arctan2(mean[1], mean[2])
        found = []
        for tilt in (lean, lean + 1.2, lean - 1.2):
            for slope in (-0.4, 0.4):
                x = np.zeros(20)
                # The linear and the quadratic form of beta's cubic part must not both start at 0.
                x[6], x[11], x[12], x[19] = slope, 0.01, 0.01, tilt
                for _ in range(ROUNDS[0]):
                    unit = self._directions_at(x, at)[0]
                    by = lengths(moves - length[:, None] * unit, weight)

                    def residual(x: Float64, by: Float64 = by) -> tuple[Float64, Float64]:
                        unit, slopes = self._directions_at(x, at)
                        scale = (by * length)[:, None]
                        return (
                            (scale * unit - by[:, None] * moves).ravel(),
                            (scale[:, None] * slopes).reshape(-1, 20),
                        )

                    x = least(residual, x, 12)
                miss = moves - length[:, None] * self._directions_at(x, at)[0]
                found.append((x, float(weight @ np.linalg.norm(miss, axis=1))))
        return sorted(found, key=lambda one: one[1])

    def densities(self, layout: str) -> tuple[Float64, float]:
        """Return free parameters of the density function of a layout with their cost (4.9)."""
        form = mirrored_gaussians(layout)
        x = np.array(list(self._bells(layout)))

        def residual(x: Float64) -> tuple[Float64, Float64]:
            gaussians = form(x).reshape(-1, GAUSSIAN)
            value, slopes = density(gaussians, self.at)
            by = np.sqrt(self.weight)
            over, steep = overshoot(gaussians, self.around)
            return (
                np.concatenate([by * (value - self.length), over]),
                np.concatenate([by[:, None] * slopes, steep]) @ form.matrix,
            )

        x = least(residual, x, 150)
        return x, float((residual(x)[0] ** 2).sum())

    def joint(self, layout: str, bells: Float64, angles: Float64) -> FitResult:
        """Refine both functions together: minimise the weighted sum of the lengths of the errors."""
        form = mirrored_gaussians(layout)
        split = len(bells)
        x = np.concatenate([bells, angles])

        def moved(x: Float64) -> tuple[Float64, Float64, Float64, Float64]:
            value, by_bell = density(form(x[:split]).reshape(-1, GAUSSIAN), self.at)
            unit, by_angle = self._directions_at(x[split:], self.at)
            return value, by_bell @ form.matrix, unit, by_angle

        def far(x: Float64) -> tuple[Float64, Float64]:
            over, steep = overshoot(form(x[:split]).reshape(-1, GAUSSIAN), self.around)
            return over, np.pad(steep @ form.matrix, ((0, 0), (0, len(x) - split)))

        def miss(x: Float64) -> Float64:
            value, _, unit, _ = moved(x)
            return np.asarray(value[:, None] * unit - self.moves)

        def total_cost(x: Float64) -> float:
            return float(self.weight @ np.linalg.norm(miss(x), axis=1) + (far(x)[0] ** 2).sum())

        best, cost = x, total_cost(x)
        for _ in range(ROUNDS[1]):
            by = lengths(miss(x), self.weight)

            def residual(x: Float64, by: Float64 = by) -> tuple[Float64, Float64]:
                value, by_bell, unit, by_angle = moved(x)
                slopes = np.concatenate(
                    [unit[:, :, None] * by_bell[:, None, :], value[:, None, None] * by_angle], axis=2
                )
                over, steep = far(x)
                return (
                    np.concatenate([(by[:, None] * (value[:, None] * unit - self.moves)).ravel(), over]),
                    np.concatenate([(by[:, None, None] * slopes).reshape(-1, len(x)), steep]),
                )

            x = least(residual, x, 25)
            now = total_cost(x)
            if now > cost * 0.999:
                best, cost = (x, now) if now < cost else (best, cost)
                break
            best, cost = x, now
        return FitResult(layout, best[:split], best[split:], cost)

    def published(self) -> FitResult:
        """Return the best fit of one or two Gaussians."""
        starts = self.directions()
        starts = [starts[0], *(one for one in starts[1:] if one[1] > starts[0][1] * 1.02)][:2]
        found = [
            self.joint(layout, self.densities(layout)[0], angles)
            for layout in PUBLISHED
            for angles, _ in starts
        ]
        found += [self.joint(*start) for one in found[: len(starts)] for start in self._grown(one, 2)]
        return min(found, key=lambda one: one.cost)

    def extended(self, published: FitResult) -> FitResult:
        """Return the best fit of up to four Gaussians, grown from the published fit or fitted at once."""
        found = [self.joint(layout, self.densities(layout)[0], published.angles) for layout in EXTENDED]
        grown = published
        while len(grown.gaussians) < MOST:
            more = min((self.joint(*start) for start in self._grown(grown, MOST)), key=lambda one: one.cost)
            if more.cost >= grown.cost:
                break
            grown = more
        return min([*found, grown], key=lambda one: one.cost)

    def _grown(self, found: FitResult, most: int) -> Iterator[tuple[str, Float64, Float64]]:
        """Yield starts with one more Gaussian, or a symmetric pair, at the point of the largest error."""
        unit = self._directions_at(found.angles, self.at)[0]
        lack = np.einsum("ij,ij->i", self.moves, unit) - density(found.gaussians, self.at)[0]
        worst = int(np.argmax(self.weight * np.abs(lack)))
        high, (x, y, z) = lack[worst] / 2, self.at[worst]
        pair = len(found.gaussians) + 2 <= most
        for wide in WIDE:
            root = (1 / wide, 0, 1 / wide, 0, 0, 1 / wide)
            more = (high, x, y, z, *root) if pair else (high, y, z, 1 / wide, 1 / wide, 0, 1 / wide)
            yield found.layout + ("p" if pair else "c"), np.append(found.bells, more), found.angles

    def _directions_at(self, x: Float64, at: Float64) -> tuple[Float64, Float64]:
        """Return directions (n, 3) and their derivatives (n, 3, 20) by the free parameters."""
        alpha, by_alpha = angle(self.alpha(x[:7]), at)
        beta, by_beta = angle(self.beta(x[7:]), at)
        unit, turned, raised = direction(alpha, beta)
        return unit, np.concatenate(
            [
                turned[:, :, None] * (by_alpha @ self.alpha.matrix)[:, None, :],
                raised[:, :, None] * (by_beta @ self.beta.matrix)[:, None, :],
            ],
            axis=2,
        )

    def _bells(self, layout: str) -> Iterator[float]:
        """Yield the parameters of the initial Gaussians, which are centred on the displacements."""
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
