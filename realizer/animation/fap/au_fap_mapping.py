"""Mappings of AUs to FAPs: the built-in table, and changes by users."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

from realizer import tables
from realizer.animation.fap.piecewise_matrix import PiecewiseMatrix
from realizer.tables import AuToFap
from realizer.tables.mappings import Units


@dataclass(frozen=True, eq=False)
class FapMapping:
    """A mapping of AUs to FAPs (Paul 2010, chapter 5).

    Attributes:
        rows: pieces of the function from each (au, side) of the axis to each FAP.
        sources: the files that the rows come from; later ones override earlier ones.
    """

    rows: tuple[AuToFap, ...]
    sources: tuple[str, ...]

    @cached_property
    def matrix(self) -> PiecewiseMatrix:
        """The rows, prepared for whole arrays."""
        return PiecewiseMatrix.of(self.rows)

    def replaced(self, units: Units, source: str) -> FapMapping:
        """Return this mapping with the rows of the action units in `units` replaced."""
        kept = (row for row in self.rows if (row.au, row.side) not in units)
        rows = (*kept, *(row for unit in units.values() for row in unit))
        return FapMapping(
            tuple(sorted(rows, key=lambda row: (*row.key, row.au_from))), (*self.sources, source)
        )


@cache
def standard() -> FapMapping:
    """Return the built-in mapping, `tables/au_to_fap.csv`."""
    return FapMapping(tables.au_to_fap(), ("au_to_fap.csv",))
