"""The twelve expression templates of Wojdel (`templates.toml`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from realizer import tables
from realizer.core.errors import TableError
from realizer.tables.lexemes import read_aus
from realizer.tables.timing import gaps

FILE = "templates.toml"
FRAME = 1 / 25  # s; she labelled films of 25 frames a second


@dataclass(frozen=True, slots=True)
class Template:
    """A shape that a face takes.

    Attributes:
        features: in her words.
        aus: (AU, side LEFT | RIGHT | BOTH) -> intensity 0..1 at intensity 1.
        evident: seconds for which it can be seen on a still picture, on average.
        deviation: seconds, None where she saw too few.
        possible, probable: seconds, (least, most), None where she gives none.
    """

    name: str
    features: str
    aus: Mapping[tuple[int, str], float]
    evident: float
    deviation: float | None = None
    possible: tuple[float, float] | None = None
    probable: tuple[float, float] | None = None


def apex(visible: float) -> float:
    """Seconds from attackPeak to relax of what can be seen for `visible`: half of rising and going counts."""
    onset, _, offset = gaps("face").gaps
    return max(visible - onset.preferred / 2 - offset.preferred / 2, 0.0)


@cache
def templates() -> Mapping[str, Template]:
    """Upper-case name -> template, in her order.

    Raises:
        TableError: an unknown action unit, or lengths that are none.
    """
    table = tables.read_toml(tables.text_of(FILE), FILE)
    return {name: _template(name, row) for name, row in table.items()}


def _template(name: str, row: Mapping[str, object]) -> Template:
    place = f"{FILE}, {name}"
    ranges: dict[str, tuple[float, float] | None] = {}
    for key in ("possible", "probable"):
        cell = row.get(key)
        if cell is None:
            ranges[key] = None
        elif isinstance(cell, list) and len(cell) == 2 and 0 <= cell[0] < cell[1]:
            ranges[key] = (float(cell[0]), float(cell[1]))
        else:
            raise TableError(f"{place}, {key}: wanted [least, most] in seconds, got {cell}")
    frames, deviation, features, aus = (row.get(k) for k in ("frames", "deviation", "features", "aus"))
    if not (isinstance(frames, int) and frames > 0 and isinstance(deviation, int | None)):
        raise TableError(f"{place}: wanted whole frames, got {frames} and deviation {deviation}")
    if not (isinstance(features, str) and isinstance(aus, dict)):
        raise TableError(f"{place}: wanted features and aus")
    return Template(
        name,
        features,
        read_aus(aus, f"{place}, aus"),
        frames * FRAME,
        None if deviation is None else deviation * FRAME,
        ranges["possible"],
        ranges["probable"],
    )
