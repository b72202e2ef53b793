"""Tables of the standards as CSV and TOML files: one frozen row class a table, validated when read.

Every file names its `source:`, `units:` and `licence:` in its leading `#` lines; a file without them, or a
row with a bad cell, is refused with its place.
"""

from __future__ import annotations

import csv
import tomllib
import types
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from importlib.resources import files
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from realizer.core.errors import TableError

__all__ = [
    "ActionUnit",
    "AuCombination",
    "AuToFap",
    "Fap",
    "action_units",
    "au_combinations",
    "au_to_fap",
    "by_number",
    "faps",
    "nearest",
    "read_csv",
    "read_toml",
]

Row = TypeVar("Row")
HEAD = ("source", "units", "licence")


def read_csv(text: str, row_class: type[Row], name: str) -> tuple[Row, ...]:
    """The rows of a CSV table as `row_class` (a dataclass), in file order.

    Args:
        text: the file's text; leading `#` lines carry source, units and licence.
        row_class: a frozen dataclass; a column a field, converted to the field's type.
        name: what to call the file in messages.

    Raises:
        TableError: a missing head line or column, or a cell of the wrong kind; with file, line and column.
    """
    _check_head(text, name)
    lines = text.splitlines()
    first = next((i for i, line in enumerate(lines) if line and not line.startswith("#")), len(lines))
    body = [(i, line) for i, line in enumerate(lines[first:], first + 1) if line and not line.startswith("#")]
    if not body:
        raise TableError(f"{name}: wanted a header row, got an empty table")
    columns = next(csv.reader([body[0][1]]))
    kinds = get_type_hints(row_class)
    wanted = [f.name for f in fields(row_class)]  # type: ignore[arg-type]
    if columns != wanted:
        raise TableError(
            f"{name}, line {body[0][0]}: wanted columns {','.join(wanted)}, got {','.join(columns)}"
        )
    rows = []
    for number, line in body[1:]:
        cells = next(csv.reader([line]))
        if len(cells) != len(columns):
            raise TableError(f"{name}, line {number}: wanted {len(columns)} cells, got {len(cells)}")
        values = {
            column: _cell(cell, kinds[column], f"{name}, line {number}, {column}")
            for column, cell in zip(columns, cells, strict=True)
        }
        rows.append(row_class(**values))
    return tuple(rows)


def read_toml(text: str, name: str) -> dict[str, Any]:
    """A TOML table as a dictionary.

    Raises:
        TableError: a missing head line, or text that is not TOML.
    """
    _check_head(text, name)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise TableError(f"{name}: {error}") from None


def text_of(name: str) -> str:
    """The text of a file in this folder."""
    return files(__name__).joinpath(name).read_text("utf-8")


def _check_head(text: str, name: str) -> None:
    head = [line[1:].strip() for line in text.splitlines() if line.startswith("#")]
    for key in HEAD:
        if not any(line.startswith(f"{key}:") for line in head):
            raise TableError(f"{name}: wanted a leading line '# {key}: ...', got none")


def _cell(cell: str, kind: Any, place: str) -> Any:
    cell = cell.strip()
    if get_origin(kind) is Literal:
        if cell not in get_args(kind):
            raise TableError(f"{place}: wanted one of {', '.join(get_args(kind))}, got {cell!r}")
        return cell
    if get_origin(kind) is types.UnionType:  # X | None: an empty cell is None
        if not cell:
            return None
        kind = get_args(kind)[0]
    if kind is bool:
        if cell not in ("0", "1"):
            raise TableError(f"{place}: wanted 0 or 1, got {cell!r}")
        return cell == "1"
    try:
        return kind(cell)
    except ValueError:
        raise TableError(f"{place}: wanted {kind.__name__}, got {cell!r}") from None


@dataclass(frozen=True, slots=True)
class Fap:
    """One MPEG-4 facial animation parameter (ISO/IEC 14496-2 annex C)."""

    fap: int
    name: str
    group: int
    unit: Literal["none", "MNS", "MW", "ENS", "ES", "IRISD", "angle_unit"]
    direction: str
    feature_point: str
    least: float
    most: float
    mirror: int
    sign: int
    speech_owns: float


@dataclass(frozen=True, slots=True)
class ActionUnit:
    """One FACS action unit; `no_fap` says why no FAP shows it, "" where FAPs do.

    `strength` is how far full intensity goes beside the shape that the unit was measured in.
    """

    au: int
    name: str
    sides: bool
    combine: Literal["max", "sum"]
    degrees: float
    strength: float
    no_fap: str


@dataclass(frozen=True, slots=True)
class AuToFap:
    """One straight piece of what an action unit asks of a FAP (Paul 2010, 5.2).

    The pieces of one (au, side, fap) join into a polyline through (0, 0); beyond its end it stays level.
    """

    au: int
    side: Literal["L", "R", ""]
    fap: int
    au_from: float
    au_to: float
    fap_from: float
    fap_to: float

    @property
    def key(self) -> tuple[int, str, int]:
        return self.au, self.side, self.fap


@dataclass(frozen=True, slots=True)
class AuCombination:
    """What two action units show together beside what each shows: a value of a FAP, in its own unit."""

    au: int
    other: int
    side: Literal["L", "R", ""]
    fap: int
    value: float


@cache
def au_combinations() -> tuple[AuCombination, ...]:
    """The combinations that FACS calls different, in file order."""
    return read_csv(text_of("au_combinations.csv"), AuCombination, "au_combinations.csv")


@cache
def faps() -> tuple[Fap, ...]:
    """The 68 FAPs, in order: row i is FAP i + 1."""
    return read_csv(text_of("faps.csv"), Fap, "faps.csv")


@cache
def action_units() -> tuple[ActionUnit, ...]:
    """The action units, ascending."""
    return read_csv(text_of("action_units.csv"), ActionUnit, "action_units.csv")


@cache
def au_to_fap() -> tuple[AuToFap, ...]:
    """What each action unit asks of each FAP, in file order."""
    return read_csv(text_of("au_to_fap.csv"), AuToFap, "au_to_fap.csv")


@cache
def by_number() -> Mapping[int, ActionUnit]:
    """AU number -> its row of `action_units`."""
    return {row.au: row for row in action_units()}


def nearest(number: int) -> str:
    """The three action units nearest to a number, for messages: "2 (Outer brow raiser), 4 (...), ..."."""
    known = by_number()
    near = sorted(sorted(known, key=lambda au: (abs(au - number), au))[:3])
    return ", ".join(f"{au} ({known[au].name})" for au in near)
