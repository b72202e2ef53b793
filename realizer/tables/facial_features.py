"""Distances between feature points, and the FAPs that follow from them (`facial_features.csv`)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from realizer import tables
from realizer.core.errors import TableError

FILE = "facial_features.csv"


@dataclass(frozen=True, slots=True)
class FacialFeature:
    """A change of the distance between two feature points (Raouzaiou et al. 2002, table 3).

    Attributes:
        first, second: names of MPEG-4 feature points.
        growth: 1 counts moving apart, -1 coming together.
        unit: FAPU in which it is counted.
        signs: {FAP: 1 or -1}; the feature is their sum.
        also: FAPs of the inner lips that are read like `signs`, the same way round.
    """

    number: int
    first: str
    second: str
    growth: int
    unit: str
    signs: dict[int, int]
    also: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Row:
    feature: int
    first: str
    second: str
    growth: int
    unit: str
    faps: str
    also: str


@cache
def facial_features() -> tuple[FacialFeature, ...]:
    """The 15 features, f1 first.

    Raises:
        TableError: not FAP numbers.
    """
    found = []
    for row in tables.read_csv(tables.text_of(FILE), Row, FILE):
        try:
            signed = [int(fap) for fap in row.faps.split()]
            also = tuple(int(fap) for fap in row.also.split())
        except ValueError:
            raise TableError(f"{FILE}, f{row.feature}: wanted FAP numbers, got {row.faps!r}") from None
        signs = {abs(fap): 1 if fap > 0 else -1 for fap in signed}
        found.append(FacialFeature(row.feature, row.first, row.second, row.growth, row.unit, signs, also))
    return tuple(found)
