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

    Resampled units give its standard error, and Student's t the interval on the scale of log odds between the
    limits. Near a limit, plain percentiles hold the truth less often than they say
    (`benchmarks/study.py`).

    Args:
        units: (n, ...) the part of each judge, or of each item.
        statistic: takes sums over units (draws, ...), returns (draws,); NaN where it does not exist.
        limits: least and greatest value that it can have.

    Returns:
        The ends; NaN for fewer than two units, or if all are alike.
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
    lower, upper = (low + (high - low) / (1 + math.exp(-place)) for place in (odds - half, odds + half))
    return lower, upper


def ratio(sums: Float64) -> Float64:
    """Return the quotients of (..., 2) numerators and denominators; NaN without a denominator."""
    above, below = sums[..., 0], sums[..., 1]
    quotients: Float64 = np.divide(above, below, out=np.full(above.shape, np.nan), where=below != 0)
    return quotients


def hit_rates(confusion: Float64) -> Float64:
    """Return Wagner's unbiased hit rates (1993) of (..., names, answers), where answer k is name k.

    The share of right answers to a name, times the share of right ones among the answers of that name: who
    always gives one name is not rewarded. NaN of a name that was not shown; 0 of one that was not answered.
    """
    count = confusion.shape[-2]
    right = np.diagonal(confusion[..., :count], axis1=-2, axis2=-1).astype(np.float64)
    shown, given = confusion.sum(axis=-1), confusion.sum(axis=-2)[..., :count]
    return ratio(np.stack([right**2, shown * np.maximum(given, 1)], axis=-1))


def turn(angle: float, wanted: float) -> float:
    """Return by how many degrees an angle is off, -180..180."""
    return (angle - wanted + 180.0) % 360.0 - 180.0


def circular_mean(angles: Float64) -> tuple[float, float]:
    """Return the mean direction of angles in degrees, and the length of their resultant: 1 is agreement."""
    mean = np.exp(1j * np.radians(angles)).mean()
    return float(np.degrees(np.angle(mean))), float(abs(mean))


def against_chance(counts: Float64) -> tuple[float, float]:
    """Return chi-square of counts against equal shares, and p; NaN without counts."""
    if not counts.sum():
        return float("nan"), float("nan")
    found = stats.chisquare(counts)
    return float(found.statistic), float(found.pvalue)
