"""A reader for a folder of user expressions (TOML) that reports all faults at once."""

import math
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from realizer.core.errors import TableError
from realizer.core.similar import did_you_mean, similar
from realizer.core.toml_text import parse_toml
from realizer.expressions.expression import Expression, key
from realizer.tables.lexemes import read_aus
from realizer.tables.timing import Gap, gaps

KEYS = ("name", "means", "features", "aus", "onset", "apex", "offset", "possible", "probable", "source")
NAME = re.compile(r"[^\W\d_][\w .:'-]{0,99}")
NEUTRAL = "NEUTRAL"  # a break in timelines
LONGEST = 3600.0  # s


def read_folder(folder: Path) -> tuple[Expression, ...]:
    """Return the expressions of a folder, in the order of their files.

        name = "polite smile"                # default: the name of the file
        means = ["greeting", "thank you"]    # search words
        features = "raised corners of the mouth, one brow up"
        aus = { 12 = 0.5, 6 = 0.2, 2L = 0.4 }
        onset = 0.3                          # seconds; default: those of the element face
        apex = 0.8
        offset = 0.5
        possible = [0.3, 4.0]                # seconds for which it is visible
        probable = [0.5, 2.0]
        source = "seen at the front desk"

    Raises:
        TableError: the text has a line for each fault, with file and key.
    """
    return _read(sorted(folder.glob("*.toml")))


def check_file(path: Path, content: bytes) -> None:
    """Raise TableError if the folder of a file could not be read any more if the file had that content."""
    others = set(path.parent.glob("*.toml")) - {path}
    _read([*sorted(others), path], {path: content})


def _read(paths: Iterable[Path], unsaved: Mapping[Path, bytes] = {}) -> tuple[Expression, ...]:
    """Return the expressions of files; the contents of some are not those on the disk."""
    found: dict[str, Expression] = {}
    faults: list[str] = []
    for path in paths:
        try:
            row = parse_toml((unsaved[path] if path in unsaved else path.read_bytes()).decode())
        except OSError as error:
            faults.append(f"{path}: {error.strerror}")
            continue
        except ValueError as error:
            faults.append(f"{path}: wanted TOML, got: {error}")
            continue
        reader = _FileReader(path, row)
        expression = reader.expression()
        faults += reader.faults
        if expression is None:
            continue
        if (other := found.get(key(expression.name))) is not None:
            faults.append(
                f"{path}: name: wanted one of its own, got {expression.name!r}, which {other.file} has"
            )
        found[key(expression.name)] = expression
    if faults:
        raise TableError("\n".join(faults))
    return tuple(found.values())


class _FileReader:
    """Reads a file and collects its faults."""

    def __init__(self, path: Path, row: dict[str, Any]) -> None:
        self.path, self.row = path, row
        self.faults: list[str] = []

    def expression(self) -> Expression | None:
        """Return the expression, or None if the file has faults."""
        for name in self.row.keys() - set(KEYS):
            hint = did_you_mean(similar(name, KEYS, 1))
            self._fault(name, f"one of {', '.join(KEYS)}", f"{name!r}{hint}")
        name, means, aus = self._name(), self._means(), self._aus()
        onset, apex, offset = self._gaps()
        possible, probable = self._range("possible"), self._range("probable")
        features, source = self._text("features"), self._text("source")
        if possible and probable and not possible[0] <= probable[0] < probable[1] <= possible[1]:
            self._fault(
                "probable", f"a range within the possible one, {_range_text(possible)}", _range_text(probable)
            )
        if self.faults:
            return None
        found = Expression(
            name, features, means, aus, (onset, apex, offset), possible, probable, source, self.path
        )
        if possible and not possible[0] - 1e-6 <= found.visible_duration <= possible[1] + 1e-6:
            wanted = f"a visible duration within the possible {_range_text(possible)}"
            self._fault(
                "apex", wanted, f"{found.visible_duration:.3g} s (half of onset and offset, and the apex)"
            )
            return None
        return found

    def _fault(self, key: str, wanted: str, got: object) -> None:
        self.faults.append(f"{self.path}: {key}: wanted {wanted}, got {got}")

    def _name(self) -> str:
        name = self.row.get("name", self.path.stem)
        if not isinstance(name, str) or not NAME.fullmatch(name.strip()):
            self._fault("name", "a name that begins with a letter, of up to 100 characters", repr(name))
        elif key(name) == NEUTRAL:
            self._fault("name", "another name, as neutral is the face without expression", repr(name))
        return str(name).strip()

    def _text(self, name: str) -> str:
        value = self.row.get(name, "")
        if not isinstance(value, str):
            self._fault(name, "text", repr(value))
        return str(value)

    def _means(self) -> tuple[str, ...]:
        value = self.row.get("means", [])
        if isinstance(value, str):
            value = [value]
        if not isinstance(value, list) or not all(isinstance(word, str) and word.strip() for word in value):
            self._fault("means", 'words, such as ["greeting", "thank you"]', repr(value))
            return ()
        return tuple(value)

    def _aus(self) -> dict[tuple[int, str], float]:
        cells = self.row.get("aus")
        if not isinstance(cells, dict) or not cells:
            self._fault(
                "aus",
                "action units by intensity, such as { 12 = 0.6, 2L = 0.3 }",
                "nothing" if cells is None else repr(cells),
            )
            return {}
        aus: dict[tuple[int, str], float] = {}
        for cell, amount in cells.items():
            if isinstance(amount, bool) or not isinstance(amount, int | float):
                self._fault(f"aus.{cell}", "an intensity above 0 and to 1", repr(amount))
                continue
            try:
                aus |= read_aus({cell: amount}, f"{self.path}: aus")
            except TableError as error:
                self.faults.append(str(error))
        return aus

    def _gaps(self) -> tuple[Gap, Gap, Gap]:
        found = []
        for name, usual in zip(("onset", "apex", "offset"), gaps("face").gaps, strict=True):
            seconds = self.row.get(name, usual.preferred)
            if not _number(seconds) or not usual.least <= seconds <= LONGEST:
                self._fault(name, f"seconds, {usual.least:g} to {LONGEST:g}", repr(seconds))
                seconds = usual.preferred
            source = str(self.path) if name in self.row else usual.source
            found.append(Gap(usual.name, float(seconds), usual.least, usual.stiffness, source))
        onset, apex, offset = found
        return onset, apex, offset

    def _range(self, name: str) -> tuple[float, float] | None:
        cell = self.row.get(name)
        if cell is None:
            return None
        if isinstance(cell, list) and len(cell) == 2 and _number(cell[0]):
            low, high = cell
            if (high == math.inf or _number(high)) and 0 <= low < high:
                return float(low), float(high)
        self._fault(name, "[least, most] in seconds (inf: no end)", repr(cell))
        return None


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _range_text(ends: tuple[float, float]) -> str:
    return f"{ends[0]:g} to {ends[1]:g} s" if ends[1] < math.inf else f"{ends[0]:g} s or more"
