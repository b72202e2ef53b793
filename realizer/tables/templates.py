"""The twelve expression templates of Wojdel 2005 (`templates.toml`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from realizer import tables
from realizer.core.errors import TableError
from realizer.tables.lexemes import read_aus
from realizer.tables.timing import gaps

FILE = "templates.toml"
FRAME = 1 / 25  # s; the measured films have 25 frames per second


@dataclass(frozen=True, slots=True)
class Template:
    """An expression that was observed on people.

    Attributes:
        features: visible features, in Wojdel's words.
        aus: (AU, side LEFT | RIGHT | BOTH) -> intensity 0..1 at intensity 1.
        evident: average seconds for which it is visible on still pictures.
        deviation: standard deviation of these seconds; None if there were too few observations.
        possible, probable: least and most seconds; None if not published.
    """

    name: str
    features: str
    aus: Mapping[tuple[int, str], float]
    evident: float
    deviation: float | None = None
    possible: tuple[float, float] | None = None
    probable: tuple[float, float] | None = None


def apex(visible: float) -> float:
    """Return the seconds from attackPeak to relax of an expression that is visible for `visible` seconds.

    It is visible from the middle of its onset to the middle of its offset.
    """
    onset, _, offset = gaps("face").gaps
    return max(visible - onset.preferred / 2 - offset.preferred / 2, 0.0)


@cache
def templates() -> Mapping[str, Template]:
    """Return upper-case name -> template."""
    return {name: _template(name, row) for name, row in tables.toml_table(FILE).items()}


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
