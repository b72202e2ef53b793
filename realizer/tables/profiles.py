"""The FAP ranges of emotions (`profiles_*.csv`, `vocabularies.toml`, `fap_statistics.csv`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from realizer import tables
from realizer.core.errors import TableError

VOCABULARIES = "vocabularies.toml"


@dataclass(frozen=True, slots=True)
class PublishedRange:
    """One FAP of one published profile, as printed and as corrected (Raouzaiou et al. 2002, table 5)."""

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
    """One FAP of one of our own profiles."""

    emotion: str
    profile: int
    fap: int
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Statistic:
    """Mean and deviation of a FAP over faces that show an emotion; None if not verified."""

    emotion: str
    fap: int
    raw_mean: float | None
    mean: float | None
    deviation: float | None


@cache
def published_ranges() -> tuple[PublishedRange, ...]:
    """Return all rows, in the order of print."""
    return tables.read_csv(tables.text_of("profiles_published.csv"), PublishedRange, "profiles_published.csv")


@cache
def own_ranges() -> tuple[OwnRange, ...]:
    """Return all rows, in file order."""
    return tables.read_csv(tables.text_of("profiles_own.csv"), OwnRange, "profiles_own.csv")


@cache
def statistics() -> tuple[Statistic, ...]:
    """Emotion by emotion, rising FAPs."""
    return tables.read_csv(tables.text_of("fap_statistics.csv"), Statistic, "fap_statistics.csv")


@cache
def vocabularies(raw: bool = False) -> Mapping[str, frozenset[int]]:
    """Emotion -> the FAPs that its expressions may move (Raouzaiou et al. 2002, table 2).

    Args:
        raw: as printed; else with the misprint put right.

    Raises:
        TableError: not FAP numbers.
    """
    table = tables.read_toml(tables.text_of(VOCABULARIES), VOCABULARIES)
    found = {}
    for emotion, faps in (table["raw"] if raw else table["raw"] | table["corrected"]).items():
        if not all(isinstance(fap, int) and 3 <= fap <= 68 for fap in faps):
            raise TableError(f"{VOCABULARIES}, {emotion}: wanted FAP numbers 3..68, got {faps}")
        found[emotion] = frozenset(faps)
    return found
