"""Groups of FAPs and AUs for user interfaces (`regions.toml`)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from realizer import tables
from realizer.core.errors import TableError

FILE = "regions.toml"


@dataclass(frozen=True, slots=True)
class Region:
    """A heading and the numbers of its FAPs or AUs."""

    name: str
    members: tuple[int, ...]


@cache
def fap_regions() -> tuple[Region, ...]:
    """Return the groups of the low-level FAPs, 3..68."""
    return _regions("fap", [row.fap for row in tables.faps() if row.fap > 2])


@cache
def au_regions() -> tuple[Region, ...]:
    """Return the classes of the AUs, from the brows down."""
    return _regions("au", [row.au for row in tables.action_units()])


def _regions(kind: str, wanted: list[int]) -> tuple[Region, ...]:
    rows = tables.toml_table(FILE)[kind]
    regions = tuple(Region(row["name"], tuple(row["members"])) for row in rows)
    members = [number for region in regions for number in region.members]
    if sorted(members) != wanted:
        odd = sorted({n for n in [*members, *wanted] if members.count(n) != 1 or n not in wanted})
        raise TableError(f"{FILE}, {kind}: wanted every number of its table once, but not so: {odd}")
    return regions
