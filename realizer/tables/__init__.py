"""Tables of the standards as CSV and TOML files, validated when they are read.

Every file begins with comments that name its `source:`, `units:` and `licence:`; each CSV table has a frozen
class for its rows.
"""

import csv
import types
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cache, partial
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from realizer.core.errors import TableError
from realizer.core.toml_text import parse_toml

Row = TypeVar("Row")
T = TypeVar("T")
HEAD = ("source", "units", "licence")


def read_csv(text: str, row_class: type[Row], name: str) -> tuple[Row, ...]:
    """Return the rows of a CSV table in file order.

    Args:
        row_class: a dataclass with a field for each column; cells are converted to the types of the fields.
        name: of the file, in messages.

    Raises:
        TableError: a missing head line or column, or an invalid cell; with file, line and column.
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
    """Parse a TOML table; raises TableError, with the file's name, without head or if it is no TOML."""
    _check_head(text, name)
    try:
        return parse_toml(text)
    except ValueError as error:
        raise TableError(f"{name}: wanted TOML, got: {error}") from None


def user_table(path: Path, parse: Callable[[dict[str, Any]], T]) -> T:
    """Return what a user's TOML file means; raises TableError if it cannot be read or used by `parse`."""
    try:
        return parse(read_toml(path.read_text("utf-8"), str(path)))
    except (OSError, UnicodeError, TypeError, ValueError, KeyError, AttributeError) as error:
        wanted = f"a table in the form of realizer/tables/{path.name}"
        raise TableError(f"{path}: wanted {wanted}, got: {error!r}") from None


def csv_rows(name: str, row_class: type[Row], package: str = __name__) -> tuple[Row, ...]:
    """Return the rows of a built-in CSV table in a package; arguments and errors as for `read_csv`."""
    return read_csv(files(package).joinpath(name).read_text("utf-8"), row_class, name)


def csv_index(name: str, row_class: type[Row], key: str) -> Mapping[Any, Row]:
    """Return the cell of the column `key` -> row of a built-in CSV table; errors as for `read_csv`."""
    return {getattr(row, key): row for row in csv_rows(name, row_class)}


@cache
def toml_table(name: str) -> dict[str, Any]:
    """Return a built-in TOML table; errors as for `read_toml`."""
    return read_toml(text_of(name), name)


def text_of(name: str) -> str:
    """Return the content of a built-in table."""
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
    """An MPEG-4 facial animation parameter (ISO/IEC 14496-2 annex C)."""

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
    """A FACS action unit."""

    au: int
    name: str
    sides: bool  # whether it can show on one side alone
    # How channels of one layer combine: the stronger ("max"), or added ("sum").
    combine: Literal["max", "sum"]
    degrees: float  # rotation at intensity 1; 0 if it is not a rotation
    strength: float  # size of full intensity, relative to the shape in which it was measured
    no_fap: str  # why no FAP shows it; "" if FAPs do


@dataclass(frozen=True, slots=True)
class AuToFap:
    """A linear segment of the mapping from an action unit to a FAP (Paul 2010, 5.2).

    The segments of one `key` form a polyline through (0, 0), which is constant beyond its end.
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
    """What two action units add to a FAP, in its unit, when they are shown together."""

    au: int
    other: int
    side: Literal["L", "R", ""]
    fap: int
    value: float


# Functions without arguments that return the rows of a table.
faps = cache(partial(csv_rows, "faps.csv", Fap))  # row i is FAP i + 1
HEAD_COLUMNS = slice(47, 50)  # of arrays of the 68 FAPs: those that turn the head
action_units = cache(partial(csv_rows, "action_units.csv", ActionUnit))  # in ascending order
au_to_fap = cache(partial(csv_rows, "au_to_fap.csv", AuToFap))
# What FACS lists as other than the sum of its action units.
au_combinations = cache(partial(csv_rows, "au_combinations.csv", AuCombination))


@cache
def by_number() -> Mapping[int, ActionUnit]:
    """Return AU number -> action unit."""
    return {row.au: row for row in action_units()}


@dataclass(frozen=True, slots=True)
class Region:
    """A heading of user interfaces, and the numbers of its FAPs or AUs."""

    name: str
    members: tuple[int, ...]


@cache
def regions(kind: Literal["fap", "au"]) -> tuple[Region, ...]:
    """Return the groups of the low-level FAPs, 3..68, or the classes of the AUs, from the brows down."""
    return tuple(Region(row["name"], tuple(row["members"])) for row in toml_table("regions.toml")[kind])


def nearest(number: int) -> str:
    """Return the three action units nearest to a number, for messages: "2 (Outer brow raiser), ..."."""
    known = by_number()
    near = sorted(sorted(known, key=lambda au: (abs(au - number), au))[:3])
    return ", ".join(f"{au} ({known[au].name})" for au in near)
