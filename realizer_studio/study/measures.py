"""Statistics of judgements: intervals, hit rates, errors on a circle, chi-square."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import stats

from realizer.core.array_types import Float64

DRAWS = 2000
LEVEL = 0.95


def interval(
    units: Float64, statistic: Callable[[Float64], Any], limits: tuple[float, float] = (0.0, 1.0)
) -> tuple[float, float]:
    """Return the 95 % interval of a statistic of sums over independent units, by bootstrap.

    The standard error is that of resampled units, and the interval is Student's on the scale of log odds
    between the limits. Near a limit, the coverage of percentiles is too low (`benchmarks/study.py`).

    Args:
        units: (n, ...) values of each judge, or of each item.
        statistic: a function of sums over units (draws, ...) to (draws,); NaN where undefined.
        limits: its least and greatest possible value.

    Returns:
        The ends; NaN for fewer than two units, or if all are equal.
    """
    n, (low, high) = len(units), limits
    counts = np.random.default_rng(0).multinomial(n, np.full(n, 1 / n), DRAWS)
    values = np.asarray(statistic(np.tensordot(counts, units, 1)), np.float64)
    middle = float(statistic(units.sum(axis=0)[None])[0])
    error = float(np.nanstd(values)) if np.isfinite(values).any() else 0.0
    if n < 2 or error < 1e-9 or not low < middle < high:
        return float("nan"), float("nan")
    odds = math.log((middle - low) / (high - middle))
    half = math.sqrt(n / (n - 1)) * float(stats.t.ppf((1 + LEVEL) / 2, n - 1)) * error
    half *= (high - low) / (middle - low) / (high - middle)
    lower, upper = (low + (high - low) / (1 + math.exp(-logit)) for logit in (odds - half, odds + half))
    return lower, upper


def ratio(sums: Float64) -> Float64:
    """Return the quotients of (..., 2) numerators and denominators; NaN if a denominator is 0."""
    above, below = sums[..., 0], sums[..., 1]
    quotients: Float64 = np.divide(above, below, out=np.full(above.shape, np.nan), where=below != 0)
    return quotients


def hit_rates(confusion: Float64) -> Float64:
    """Return Wagner's unbiased hit rates (1993) of (..., names, answers), where answer k is name k.

    The rate is the share of right answers to a name, times the share of right ones among the uses of that
    answer, which does not reward repeating one answer. It is NaN for a name that was not presented, 0 for an
    answer that was not given.
    """
    count = confusion.shape[-2]
    right = np.diagonal(confusion[..., :count], axis1=-2, axis2=-1).astype(np.float64)
    presented, given = confusion.sum(axis=-1), confusion.sum(axis=-2)[..., :count]
    return ratio(np.stack([right**2, presented * np.maximum(given, 1)], axis=-1))


def angle_difference(angle: float, target: float) -> float:
    """Return the difference of an angle from a target in degrees, -180..180."""
    return (angle - target + 180.0) % 360.0 - 180.0


def circular_mean(angles: Float64) -> tuple[float, float]:
    """Return the mean direction of angles in degrees, and the length of their resultant, 0..1."""
    mean = np.exp(1j * np.radians(angles)).mean()
    return float(np.degrees(np.angle(mean))), float(abs(mean))


def against_chance(counts: Float64) -> tuple[float, float]:
    """Return chi-square of counts against equal shares, and p; NaN if all counts are 0."""
    if not counts.sum():
        return float("nan"), float("nan")
    found = stats.chisquare(counts)
    return float(found.statistic), float(found.pvalue)
