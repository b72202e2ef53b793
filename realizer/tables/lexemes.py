"""The lexemes of faceLexeme and head: action units and head poses (`lexemes.toml`)."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from realizer import tables
from realizer.core.errors import TableError

FILE = "lexemes.toml"
SIDES = {"": "BOTH", "L": "LEFT", "R": "RIGHT"}


@dataclass(frozen=True, slots=True)
class FaceLexeme:
    """A facial expression: (AU, side LEFT | RIGHT | BOTH) -> intensity at amount 1.

    An intensity above 1 is reached at a smaller amount, and all of them `repeats` times.
    """

    name: str
    aus: Mapping[tuple[int, str], float]
    repeats: int = 1


@dataclass(frozen=True, slots=True)
class HeadLexeme:
    """A head movement as three poses, AU -> degrees at amount 1."""

    name: str
    ready: Mapping[int, float]  # pose before the first stroke
    stroke: Mapping[int, float]  # pose at each stroke
    back: Mapping[int, float]  # pose between strokes, and from strokeEnd to relax
    decay: float  # size of each stroke relative to the one before, 0..1
    eyes: float  # share of a turn that the eyes compensate, 0..1


@cache
def face_lexemes() -> Mapping[str, FaceLexeme]:
    """Return upper-case name -> lexeme."""
    return {
        name: FaceLexeme(
            name, read_aus(row["aus"], f"{FILE}, face.{name}", most=2.0), int(row.get("repeats", 1))
        )
        for name, row in _rows("face").items()
    }


@cache
def head_lexemes() -> Mapping[str, HeadLexeme]:
    """Return upper-case name -> lexeme."""
    return {
        name: HeadLexeme(
            name,
            ready={int(au): float(degrees) for au, degrees in row["ready"].items()},
            stroke={int(au): float(degrees) for au, degrees in row["stroke"].items()},
            back={int(au): float(degrees) for au, degrees in row["back"].items()},
            decay=float(row["decay"]),
            eyes=float(row["eyes"]),
        )
        for name, row in _rows("head").items()
    }


def _rows(part: str) -> dict[str, Mapping[str, Any]]:
    """Return the rows of a part; `same_as` is replaced by the row it refers to."""
    rows: Mapping[str, Mapping[str, Any]] = tables.toml_table(FILE)[part]
    return {name: rows[row.get("same_as", name)] for name, row in rows.items()}


def read_aus(cells: Mapping[str, float], place: str, most: float = 1.0) -> dict[tuple[int, str], float]:
    """Parse action units such as { 1 = 0.5, 12L = 1.0 } to (AU, side LEFT | RIGHT | BOTH) -> intensity.

    Raises TableError, with the place, for an unknown unit or side, or an intensity outside 0..most.
    """
    known = tables.by_number()
    aus = {}
    for cell, amount in cells.items():
        match = re.fullmatch(r"(\d{1,3})([LR]?)", cell)
        au = known.get(int(match[1])) if match else None
        if match is None or au is None or (match[2] and not au.sides):
            raise TableError(f"{place}: wanted an action unit such as 12 or 12L, got {cell!r}")
        if not 0 < amount <= most:
            raise TableError(f"{place}, {cell}: wanted an intensity above 0 and to {most:g}, got {amount}")
        aus[au.au, SIDES[match[2]]] = float(amount)
    return aus
