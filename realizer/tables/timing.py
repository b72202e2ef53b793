"""The preferred gaps of behaviours, by element and variant (`timing.toml`)."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from realizer import tables
from realizer.core.errors import TableError


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
        TableError: no such element.
    """
    known = all_gaps()
    row = known.get(f"{element}.{variant.upper()}") or known.get(element)
    if row is None:
        raise TableError(f"timing.toml has no row [{element}]: add one, or use the timing of another element")
    return row


@cache
def all_gaps() -> Mapping[str, Gaps]:
    """Return "element" or "element.VARIANT" -> gaps."""
    table = tables.toml_table("timing.toml")
    rows: dict[str, Mapping[str, Any]] = {}
    for element, row in table.items():
        rows[element] = row
        rows |= {f"{element}.{name}": inner for name, inner in row.items() if name.isupper()}
    return {name: _gaps(name, rows) for name in rows}


def _gaps(name: str, rows: Mapping[str, Mapping[str, Any]]) -> Gaps:
    row = rows[name]
    if "same_as" in row:
        return _gaps(row["same_as"], rows)
    strokes = Gap(**row["strokes"]) if "strokes" in row else None
    return Gaps(tuple(row["points"]), tuple(Gap(**cell) for cell in row["gaps"]), strokes)
