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
    """The time from one sync point to the next: seconds, seconds, 1/s^2."""

    name: str
    preferred: float
    least: float
    stiffness: float
    source: str


@dataclass(frozen=True, slots=True)
class Gaps:
    """The preferred timing of one element: k sync points, k-1 gaps; `strokes`: gap of repeated strokes."""

    points: tuple[str, ...]
    gaps: tuple[Gap, ...]
    strokes: Gap | None = None


def gaps(element: str, variant: str = "") -> Gaps:
    """Return the timing of `element` ("faceLexeme"); `variant` is a lexeme or influence, either case.

    A variant without an entry of its own wants what its element wants.

    Raises:
        KeyError: no such element.
    """
    known = all_gaps()
    return known.get(f"{element}.{variant.upper()}", known[element])


@cache
def all_gaps() -> Mapping[str, Gaps]:
    """ "element" or "element.VARIANT" -> Gaps.

    Raises:
        TableError: a gap without source, or not sensible; a `same_as` that leads nowhere.
    """
    table = tables.read_toml(tables.text_of(FILE), FILE)
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
