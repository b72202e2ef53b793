"""The twelve expression templates of Wojdel 2005 (`templates.toml`)."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from realizer import tables
from realizer.tables.lexemes import read_aus
from realizer.tables.timing import gaps

FILE = "templates.toml"
PREFIX = "template:"  # of their names in documents
FRAME = 1 / 25  # s; the measured films have 25 frames per second


@dataclass(frozen=True, slots=True)
class Template:
    """An expression that was observed on people."""

    name: str
    features: str  # visible features, in Wojdel's words
    aus: Mapping[tuple[int, str], float]  # (AU, side LEFT | RIGHT | BOTH) -> intensity 0..1 at intensity 1
    evident: float  # average seconds for which it is visible on still pictures
    # Standard deviation of these seconds; None if there were too few observations.
    deviation: float | None = None
    possible: tuple[float, float] | None = None  # least and most seconds; None if not published
    probable: tuple[float, float] | None = None  # least and most seconds; None if not published


def apex(visible: float) -> float:
    """Return the seconds from attackPeak to relax of an expression that is visible for `visible` seconds.

    It is visible from the middle of its onset to the middle of its offset.
    """
    onset, _, offset = gaps("face").gaps
    return max(visible - onset.preferred / 2 - offset.preferred / 2, 0.0)


@cache
def templates() -> Mapping[str, Template]:
    """Return upper-case name -> template."""
    return _templates(tables.toml_table(FILE))


def read_templates(path: Path) -> Mapping[str, Template]:
    """Return the templates of a user's file; raises TableError."""
    return tables.user_table(path, _templates)


def _templates(table: Mapping[str, Any]) -> dict[str, Template]:
    return {name: _template(name, row) for name, row in table.items()}


def _template(name: str, row: Mapping[str, Any]) -> Template:
    return Template(
        name,
        row["features"],
        read_aus(row["aus"], f"{FILE}, {name}, aus"),
        row["frames"] * FRAME,
        row["deviation"] * FRAME if "deviation" in row else None,
        tuple(row["possible"]) if "possible" in row else None,
        tuple(row["probable"]) if "probable" in row else None,
    )
