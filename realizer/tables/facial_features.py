"""Distances between feature points, and the FAPs that follow from them (`facial_features.csv`)."""

from dataclasses import dataclass
from functools import cache

from realizer import tables


@dataclass(frozen=True, slots=True)
class FacialFeature:
    """The change of a distance between two feature points (Raouzaiou et al. 2002, table 3)."""

    number: int
    first: str  # name of an MPEG-4 feature point
    second: str  # name of an MPEG-4 feature point
    growth: int  # 1 if moving apart is positive, -1 if approaching is
    unit: str  # FAPU
    signs: dict[int, int]  # {FAP: 1 or -1}; the feature is the sum of these FAPs
    also: tuple[int, ...]  # FAPs of the inner lips that follow from the feature with sign 1


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
    """Return the 15 features, f1 first."""
    features = []
    for row in tables.csv_rows("facial_features.csv", Row):
        signs = {abs(fap): 1 if fap > 0 else -1 for fap in map(int, row.faps.split())}
        also = tuple(map(int, row.also.split()))
        features.append(FacialFeature(row.feature, row.first, row.second, row.growth, row.unit, signs, also))
    return tuple(features)
