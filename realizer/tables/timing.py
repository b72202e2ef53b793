"""The preferred gaps of behaviours, by element and variant (`timing.toml`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from realizer import tables
from realizer.core.errors import TableError

FILE = "timing.toml"
GAP_KEYS = {"name", "preferred", "least", "stiffness", "source"}


@dataclass(frozen=True, slots=True)
class Gap:
    """The time between two sync points: preferred and least in seconds, stiffness in 1/s^2."""

    name: str
    preferred: float
    least: float
    stiffness: float
    source: str


@dataclass(frozen=True, slots=True)
class Gaps:
    """The preferred timing of an element: k sync points, k-1 gaps, and the gap between repeated strokes."""

    points: tuple[str, ...]
    gaps: tuple[Gap, ...]
    strokes: Gap | None = None


def gaps(element: str, variant: str = "") -> Gaps:
    """Return the timing of an element such as "faceLexeme".

    Args:
        variant: lexeme or influence, in any case; without an entry, it has the timing of the element.

    Raises:
        KeyError: no such element.
    """
    known = all_gaps()
    return known.get(f"{element}.{variant.upper()}", known[element])


@cache
def all_gaps() -> Mapping[str, Gaps]:
    """Return "element" or "element.VARIANT" -> gaps."""
    table = tables.toml_table(FILE)
    rows: dict[str, Mapping[str, Any]] = {}
    for element, row in table.items():
        rows[element] = row
        rows |= {f"{element}.{name}": inner for name, inner in row.items() if name.isupper()}
    return {name: _gaps(name, rows) for name in rows}


def _gaps(name: str, rows: Mapping[str, Mapping[str, Any]]) -> Gaps:
    row = rows[name]
    if "same_as" in row:
        if row["same_as"] not in rows:
            raise TableError(f"{FILE}, {name}, same_as: wanted another entry, got {row['same_as']!r}")
        return _gaps(row["same_as"], rows)
    points, cells = tuple(row["points"]), row["gaps"]
    if len(cells) != len(points) - 1:
        raise TableError(f"{FILE}, {name}: wanted {len(points) - 1} gaps, got {len(cells)}")
    strokes = _gap(name, row["strokes"]) if "strokes" in row else None
    return Gaps(points, tuple(_gap(name, cell) for cell in cells), strokes)


def _gap(name: str, cell: Mapping[str, Any]) -> Gap:
    if set(cell) != GAP_KEYS:
        raise TableError(f"{FILE}, {name}: wanted {', '.join(sorted(GAP_KEYS))}, got {', '.join(cell)}")
    gap = Gap(**cell)
    if not (gap.preferred >= gap.least >= 0 and gap.stiffness > 0 and gap.source):
        raise TableError(
            f"{FILE}, {name}, {gap.name}: wanted preferred >= least >= 0, stiffness > 0, a source; got {cell}"
        )
    return gap
