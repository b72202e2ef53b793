"""Search words and descriptions of the built-in expressions (`expression_words.csv`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from realizer import tables

FILE = "expression_words.csv"


@dataclass(frozen=True, slots=True)
class ExpressionWords:
    """A row: `means` separated by "; "; `features` empty where the table of templates has them."""

    name: str
    features: str
    means: str

    @property
    def words(self) -> tuple[str, ...]:
        """The words and phrases of `means`."""
        return tuple(word.strip() for word in self.means.split(";") if word.strip())


@cache
def expression_words() -> Mapping[str, ExpressionWords]:
    """Name, as the expression library has it -> row.

    Raises:
        TableError: a bad row; with file, line and column.
    """
    rows = tables.read_csv(tables.text_of(FILE), ExpressionWords, FILE)
    return {row.name: row for row in rows}
