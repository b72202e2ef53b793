"""The table of dialects: the elements, attributes and values that BML 1.0 has instead (`rows.csv`).

Columns:

    dialect    the dialect that has it: SmartBody, Greta, draft, or any
    element    local name of the element; prefix sbm: if only in SmartBody's namespace; * for every behaviour
    attribute  name of the attribute, the prefix sbm: is optional; "" in the row of the element itself
    value      a pattern, in any case; "" for any value, (none) if the attribute is missing
    becomes    of an element: another name, with attributes behind ": ", or - to remove it, or "" if it stays
               of an attribute: another name, - to remove it, ! to remove the element, name=value;name=value,
               @function of `values`, or a|b: the first sync point that the element has; with another name of
               the element in front of ": " if it changes too
    says       a remark for the documentation and for warnings
"""

import csv
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import NamedTuple

from bml_schema.errors import listed

FILE = Path(__file__).with_name("rows.csv")
MISSING = "(none)"


class Row(NamedTuple):
    """One row of the table."""

    dialect: str
    element: str
    attribute: str
    value: str
    becomes: str
    says: str

    @property
    def name(self) -> str:
        """The element, attribute or value, as a message names it."""
        inside = " ".join(filter(None, (self.element, self.attribute)))
        return f'<{inside}="{self.value}">' if self.value not in ("", MISSING) else f"<{inside}>"

    def fits(self, value: str) -> bool:
        """Return whether the row is for this value of its attribute."""
        pattern, value = self.value.casefold(), value.casefold()
        # Most patterns are words; others are compiled when they are first needed.
        return pattern in ("", value) or (any(c in pattern for c in "*?[") and fnmatchcase(value, pattern))


class Table(NamedTuple):
    """The rows of the table."""

    rows: Sequence[Row]  # all rows, in order
    elements: Mapping[str, Row]  # name of an element -> its row
    # Element -> attribute without prefix -> its rows, in order.
    attributes: Mapping[str, Mapping[str, Sequence[Row]]]
    missing: Mapping[str, Sequence[Row]]  # element -> the rows for missing attributes
    points: Mapping[str, Row]  # name of a sync point, as written or `squeezed` -> its row


def point_row(name: str) -> Row | None:
    """Return the row of a sync point, or None."""
    points = table().points
    return points.get(name) or points.get(squeezed(name))


def squeezed(point: str) -> str:
    """Return the name of a sync point in lower case without - and _."""
    return point.replace("_", "").replace("-", "").lower()


@cache
def table() -> Table:
    """Return the table."""
    lines = [line for line in FILE.read_text("utf-8").splitlines() if not line.startswith("#")]
    rows = [Row(*cells) for cells in csv.reader(lines[1:])]
    elements: dict[str, Row] = {}
    attributes: dict[str, dict[str, list[Row]]] = {}
    missing: dict[str, list[Row]] = {}
    points: dict[str, Row] = {}
    for row in rows:
        if "|" in row.becomes:
            points[row.attribute] = row
            points.setdefault(squeezed(row.attribute), row)
        elif not row.attribute:
            elements.setdefault(row.element, row)
        elif row.value == MISSING:
            missing.setdefault(row.element, []).append(row)
        else:
            of_element = attributes.setdefault(row.element, {})
            of_element.setdefault(row.attribute.rpartition(":")[2], []).append(row)
    return Table(rows, elements, attributes, missing, points)


_NAMES = {"SmartBody": "SmartBody's BML", "Greta": "Greta's BML", "draft": "a draft of BML"}
_WRAPPERS = {"act": "SmartBody", "fml-apml": "Greta"}
_MAX_LISTED = 12  # words in the text


@dataclass(frozen=True)
class Report:
    """A report; it is false if nothing was translated."""

    rows: Collection[Row] = ()  # the rows of the table that were used, in order
    made: Collection[str] = ()  # what was given an id, in words
    wrapper: str = ""  # local name of the element around the document, or ""

    def __bool__(self) -> bool:
        return bool(self.rows or self.made)

    @property
    def dialect(self) -> str:
        """The name of the dialect."""
        counts = {name: sum(row.dialect == name for row in self.rows) for name in _NAMES}
        return _NAMES[_WRAPPERS.get(self.wrapper) or max(counts, key=lambda name: counts[name])]

    @property
    def text(self) -> str:
        """The text of the warning that lists the translations, "" if there are none."""
        if not self:
            return ""
        ignored = dict.fromkeys(row.name for row in self.rows if _is_ignored(row))
        read = dict.fromkeys(f"{row.name} as {_shown(row)}" for row in self.rows if not _is_ignored(row))
        parts = [listed([*read, *self.made], _MAX_LISTED)] if read or self.made else []
        parts += [f"without {listed(list(ignored), _MAX_LISTED)}"] if ignored else []
        return f"read as {self.dialect}: {', '.join(parts)}"


def _is_ignored(row: Row) -> bool:
    return row.becomes in ("-", "!")


def _shown(row: Row) -> str:
    tag, _, becomes = row.becomes.rpartition(": ")
    shown = becomes.replace("{value}", "...").replace("{id}:", "").replace(";", " ").replace("|", " or ")
    return f"{tag} {row.says or row.attribute if becomes[:1] in ('@', '') else shown}".strip()
