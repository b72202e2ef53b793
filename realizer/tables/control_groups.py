"""Groups of FAPs and AUs for user interfaces (`regions.toml`)."""

from dataclasses import dataclass
from functools import cache

from realizer import tables


@dataclass(frozen=True, slots=True)
class Region:
    """A heading and the numbers of its FAPs or AUs."""

    name: str
    members: tuple[int, ...]


@cache
def fap_regions() -> tuple[Region, ...]:
    """Return the groups of the low-level FAPs, 3..68."""
    return _regions("fap")


@cache
def au_regions() -> tuple[Region, ...]:
    """Return the classes of the AUs, from the brows down."""
    return _regions("au")


def _regions(kind: str) -> tuple[Region, ...]:
    rows = tables.toml_table("regions.toml")[kind]
    return tuple(Region(row["name"], tuple(row["members"])) for row in rows)
