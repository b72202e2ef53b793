"""The profiles of the archetypal emotions: our own, the published ones, and those as printed."""

from collections.abc import Mapping
from functools import cache
from typing import Literal

from realizer.emotions.profile import Profile
from realizer.tables.profiles import own_ranges, published_ranges

ProfileSet = Literal["own", "published", "raw"]
SETS: tuple[ProfileSet, ...] = ("own", "published", "raw")


@cache
def archetypes(profiles: str = "own") -> Mapping[str, Mapping[int, Profile]]:
    """Return emotion -> number -> profile.

    Args:
        profiles: "own"; "published", those of Raouzaiou et al. 2002, table 5, corrected; or "raw", as
            printed.

    Raises:
        ValueError: an unknown set.
    """
    if profiles not in SETS:
        raise ValueError(f"profiles: wanted {', '.join(SETS)}, got {profiles!r}")
    ranges: dict[tuple[str, int], dict[int, tuple[float, float]]] = {}
    if profiles == "own":
        for own in own_ranges():
            ranges.setdefault((own.emotion, own.profile), {})[own.fap] = own.low, own.high
    else:
        for row in published_ranges():
            low, high = (row.raw_low, row.raw_high) if profiles == "raw" else (row.low, row.high)
            # Some ranges are printed backwards.
            ranges.setdefault((row.emotion, row.profile), {})[row.fap] = min(low, high), max(low, high)
    found: dict[str, dict[int, Profile]] = {}
    for (emotion, number), faps in ranges.items():
        found.setdefault(emotion, {})[number] = Profile(f"{emotion} {number}", profiles, faps)
    return found
