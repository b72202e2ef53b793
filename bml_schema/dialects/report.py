"""The report about a translation: the dialect of a document, and what was read how."""

from collections.abc import Collection
from dataclasses import dataclass

from bml_schema.dialects.table import Row

__all__ = ["Report"]

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
        """The text of the warning that lists the translations."""
        ignored = dict.fromkeys(row.name for row in self.rows if _is_ignored(row))
        read = dict.fromkeys(f"{row.name} as {_shown(row)}" for row in self.rows if not _is_ignored(row))
        parts = [_listed([*read, *self.made])] if read or self.made else []
        parts += [f"without {_listed(list(ignored))}"] if ignored else []
        return f"read as {self.dialect}: {', '.join(parts)}"


def _is_ignored(row: Row) -> bool:
    return row.becomes in ("-", "!")


def _shown(row: Row) -> str:
    tag, _, becomes = row.becomes.rpartition(": ")
    shown = becomes.replace("{value}", "...").replace("{id}:", "").replace(";", " ").replace("|", " or ")
    return f"{tag} {row.says or row.attribute if becomes[:1] in ('@', '') else shown}".strip()


def _listed(words: list[str]) -> str:
    rest = len(words) - _MAX_LISTED
    return ", ".join(words[:_MAX_LISTED]) + (f" and {rest} more" if rest > 0 else "")
