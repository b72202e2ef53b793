"""The mapping of AUs to FAPs as a value: the built-in table with a user's rows on top."""

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
        rows: what each (au, side) of the axis asks of each FAP.
        sources: the files the rows came from, the strongest last.
    """

    rows: tuple[AuToFap, ...]
    sources: tuple[str, ...]

    @cached_property
    def matrix(self) -> PiecewiseMatrix:
        """The rows, ready for whole arrays."""
        return PiecewiseMatrix.of(self.rows)

    def replaced(self, units: Units, source: str) -> FapMapping:
        """This mapping, but of the action units that `units` names what it says and nothing else."""
        kept = (row for row in self.rows if (row.au, row.side) not in units)
        rows = (*kept, *(row for unit in units.values() for row in unit))
        return FapMapping(
            tuple(sorted(rows, key=lambda row: (*row.key, row.au_from))), (*self.sources, source)
        )


@cache
def standard() -> FapMapping:
    """The mapping that ships: `tables/au_to_fap.csv`."""
    return FapMapping(tables.au_to_fap(), ("au_to_fap.csv",))
