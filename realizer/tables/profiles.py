"""The FAP ranges of emotions (`profiles_*.csv`, `fap_statistics.csv`)."""

from dataclasses import dataclass
from functools import cache

from realizer import tables


@dataclass(frozen=True, slots=True)
class PublishedRange:
    """The range of a FAP in a published profile, printed and corrected (Raouzaiou et al. 2002, table 5)."""

    emotion: str
    profile: int
    fap: int
    raw_low: float
    raw_high: float
    low: float
    high: float
    fault: str


@dataclass(frozen=True, slots=True)
class OwnRange:
    """The range of a FAP in one of our own profiles."""

    emotion: str
    profile: int
    fap: int
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Statistic:
    """Mean and deviation of a FAP in faces that show an emotion; None if not verified."""

    emotion: str
    fap: int
    raw_mean: float | None
    mean: float | None
    deviation: float | None


@cache
def published_ranges() -> tuple[PublishedRange, ...]:
    """Return the ranges of table 5 in printed order."""
    return tables.csv_rows("profiles_published.csv", PublishedRange)


@cache
def own_ranges() -> tuple[OwnRange, ...]:
    """Return the ranges of our own profiles."""
    return tables.csv_rows("profiles_own.csv", OwnRange)


@cache
def statistics() -> tuple[Statistic, ...]:
    """Return the statistics, by emotion and FAP."""
    return tables.csv_rows("fap_statistics.csv", Statistic)
