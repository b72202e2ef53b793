"""Files that map AUs to FAPs: text in the format of Paul (2010, 5.2), or CSV like `au_to_fap.csv`.

The text has two kinds of lines. `AU`, `AU<tab>L` or `AU<tab>R` names an action unit; each line of five
numbers after it, `FAP AU-start AU-end FAP-start FAP-end`, gives its effect on a FAP. Paul leaves some cases
open:

- Blanks are accepted instead of tabs, empty lines are ignored, and comments begin with #.
- A line has no effect below its AU range, and the effect of its end above it. Several lines of one FAP form a
  polyline. An action unit without lines has no effect.
- If an action unit that has sides is given without one, each FAP follows the side of the face where it is,
  and FAPs of the middle follow both. If an action unit without sides is given with sides (23), it has the
  lines of both.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from importlib.resources import files
from itertools import groupby
from pathlib import Path
from typing import Literal, TypeAlias, cast

from realizer.core.errors import TableError
from realizer.tables import AuToFap, action_units, au_to_fap, by_number, faps, nearest, read_csv

Side: TypeAlias = Literal["L", "R", ""]
Units: TypeAlias = Mapping[tuple[int, Side], tuple[AuToFap, ...]]
Line: TypeAlias = tuple[int, AuToFap]
FORMS = (".txt", ".csv")
PUBLISHED = ("zhang", "raouzaiou")
OWN = "au_to_fap"  # the file of a face folder, .txt or .csv
COLUMNS = ("au", "side", "fap", "au_from", "au_to", "fap_from", "fap_to")
NUMBERS = ("AU-start", "AU-end", "FAP-start", "FAP-end")


def read_mapping(path: Path) -> Units:
    """Read a mapping: (AU, side) -> rows of each action unit that it names; raises TableError.

    A .csv file is like `au_to_fap.csv`; any other file has Paul's text.
    """
    try:
        text = path.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise TableError(f"{path}: wanted a mapping of action units to FAPs, got {error}") from None
    named, lines = _read_csv(text, path) if path.suffix.lower() == ".csv" else _read_text(text, path)
    units: dict[tuple[int, Side], list[Line]] = {(au, side): [] for key in named for au, side in _sides(*key)}
    for number, row in lines:
        _check(row, f"{path}, line {number}")
        for side in _sides_of(row):
            units[row.au, side].append((number, replace(row, side=side)))
    return {key: _joined(found, path) for key, found in sorted(units.items())}


def published_file(name: str) -> Path | None:
    """Return the file of a published mapping, "zhang" (Paul 2010, figure 2.3) or "raouzaiou" (table 1)."""
    if name not in PUBLISHED:
        return None
    return Path(str(files("realizer.tables").joinpath(f"{OWN}_{name}.txt")))


def own_file(folder: Path) -> Path | None:
    """Return the mapping file of a face folder, or None; raises TableError: there are two."""
    own = [path for path in (folder / f"{OWN}{form}" for form in FORMS) if path.is_file()]
    if len(own) > 1:
        raise TableError(f"{folder}: wanted one of {' and '.join(path.name for path in own)}, got both")
    return own[0] if own else None


def write_mapping(path: Path, rows: Iterable[AuToFap], source: str) -> None:
    """Write rows as .csv or, for other suffixes, as Paul's text; `read_mapping` returns the same rows.

    `source` is for the head of the file. Raises OSError if it cannot be written.
    """
    path.write_text((_as_csv if path.suffix.lower() == ".csv" else as_text)(rows, source), "utf-8")


def as_text(rows: Iterable[AuToFap], source: str) -> str:
    """Return rows as Paul's text."""
    lines = [
        f"# AU to FAP: {source}",
        "# AU and side, then FAP, AU-start, AU-end, FAP-start, FAP-end of each FAP it moves",
    ]
    units = _by_unit(rows)
    for unit in action_units():
        for _, side in _sides(unit.au, ""):
            lines += ["", f"# {unit.name}{'; ' + unit.no_fap if unit.no_fap else ''}"]
            lines.append(f"{unit.au}\t{side}" if side else str(unit.au))
            lines += [
                f"{r.fap}\t{r.au_from!r}\t{r.au_to!r}\t{r.fap_from:.10g}\t{r.fap_to:.10g}"
                for r in units.get((unit.au, side), ())
            ]
    return "\n".join(lines) + "\n"


def _as_csv(rows: Iterable[AuToFap], source: str) -> str:
    units = _by_unit(rows)
    lines = [
        f"# source: {source}",
        "# units: au_from, au_to = intensity 0..1; fap_from, fap_to in the FAP's own unit",
        "# licence: that of its source",
        ",".join(COLUMNS),
    ]
    # An action unit without effect must be named, or the built-in mapping would apply.
    unused = {(r.au, r.side): replace(r, fap_from=0.0, fap_to=0.0) for r in au_to_fap()}
    for key in sorted(unused.keys() | units.keys()):
        for r in units.get(key) or (unused[key],):
            lines.append(
                f"{r.au},{r.side},{r.fap},{r.au_from:.10g},{r.au_to:.10g},{r.fap_from:.10g},{r.fap_to:.10g}"
            )
    return "\n".join(lines) + "\n"


def _by_unit(rows: Iterable[AuToFap]) -> dict[tuple[int, Side], list[AuToFap]]:
    ordered = sorted(rows, key=lambda row: (*row.key, row.au_from))
    return {key: list(group) for key, group in groupby(ordered, key=lambda row: (row.au, row.side))}


def _read_csv(text: str, path: Path) -> tuple[set[tuple[int, str]], list[Line]]:
    rows = read_csv(text, AuToFap, str(path))
    numbers = [n for n, line in enumerate(text.splitlines(), 1) if line and not line.startswith("#")]
    lines = list(zip(numbers[1:], rows, strict=True))
    for number, row in lines:
        _known(row.au, f"{path}, line {number}")
    return {(row.au, row.side) for row in rows}, lines


def _read_text(text: str, path: Path) -> tuple[set[tuple[int, str]], list[Line]]:
    named: set[tuple[int, str]] = set()
    lines: list[Line] = []
    au, side = 0, ""
    for number, line in enumerate(text.splitlines(), 1):
        fields, where = line.partition("#")[0].split(), f"{path}, line {number}"
        if not fields:
            continue
        if len(fields) <= 2:
            au, side = _whole(fields[0], "an action unit's number", where), (fields[1:] or [""])[0]
            if side not in ("", "L", "R"):
                raise TableError(f"{where}: wanted L or R beside AU{au}, got {side!r}")
            _known(au, where)
            named.add((au, side))
        elif len(fields) != 5:
            raise TableError(
                f"{where}: wanted an action unit (AU, or AU and L or R) or FAP, {', '.join(NUMBERS)}; "
                f"got {len(fields)} fields"
            )
        elif not au:
            raise TableError(f"{where}: wanted an action unit before its FAPs, got {line.strip()!r}")
        else:
            fap = _whole(fields[0], "a FAP's number", where)
            spans = [_number(field, name, where) for field, name in zip(fields[1:], NUMBERS, strict=True)]
            lines.append((number, AuToFap(au, cast(Side, side), fap, *spans)))
    if not named:
        raise TableError(f"{path}: wanted action units and their FAPs, got none")
    return named, lines


def _whole(field: str, what: str, where: str) -> int:
    if not (field.isascii() and field.isdecimal() and len(field) < 6):
        raise TableError(f"{where}: wanted {what}, got {field[:40]!r}")
    return int(field)


def _number(field: str, name: str, where: str) -> float:
    try:
        return float(field)
    except ValueError:
        raise TableError(f"{where}: {name}: wanted a number, got {field!r}") from None


def _known(au: int, where: str) -> None:
    if au not in by_number():
        raise TableError(f"{where}: wanted a FACS action unit, got {au}; near: {nearest(au)}")


def _check(row: AuToFap, where: str) -> None:
    if not 3 <= row.fap <= 68:
        raise TableError(f"{where}: wanted a FAP of 3..68, got {row.fap}")
    if not 0 <= row.au_from < row.au_to <= 1:
        raise TableError(
            f"{where}: wanted an AU range that rises within 0..1, got {row.au_from:g} to {row.au_to:g}"
        )
    fap = faps()[row.fap - 1]
    for value in (row.fap_from, row.fap_to):
        if not (math.isfinite(value) and fap.least <= value <= fap.most):
            raise TableError(
                f"{where}: FAP {row.fap} ({fap.name}): wanted {fap.least:g}..{fap.most:g}, got {value:g}"
            )


def _sides(au: int, side: str) -> list[tuple[int, Side]]:
    """Return the (AU, side) pairs for an action unit of a file."""
    if not by_number()[au].sides:
        return [(au, "")]
    return [(au, cast(Side, side))] if side else [(au, "L"), (au, "R")]


def _sides_of(row: AuToFap) -> list[Side]:
    """Return the sides for a row of a file."""
    sides = [side for _, side in _sides(row.au, row.side)]
    parts = faps()[row.fap - 1].name.split("_")  # stretch_l_cornerlip, lower_t_lip_rm_o
    own: list[Side] = ["L"] if {"l", "lm"} & {*parts} else ["R"] if {"r", "rm"} & {*parts} else []
    return own if len(sides) == 2 and own else sides


def _joined(lines: list[Line], path: Path) -> tuple[AuToFap, ...]:
    """Return the rows as polylines in order, without duplicates."""
    out: list[AuToFap] = []
    ordered = sorted(lines, key=lambda line: (*line[1].key, line[1].au_from, line[0]))
    for number, row in ordered:
        if row in out:
            continue
        before = out[-1] if out and out[-1].key == row.key else None
        end, value = (before.au_to, before.fap_to) if before else (0.0, 0.0)
        name = f"{path}, line {number}: AU{row.au}{row.side}, FAP {row.fap}"
        if row.au_from < end:
            raise TableError(
                f"{name}: wanted it to begin at {end:g}, where another line ends, got {row.au_from:g}"
            )
        if row.fap_from != value:
            raise TableError(
                f"{name}: wanted FAP-start {value:g}, or the face would jump there, got {row.fap_from:g}"
            )
        out.append(row)
    return tuple(out)
