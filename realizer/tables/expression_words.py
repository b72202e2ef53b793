"""Search words and descriptions of the built-in expressions (`expression_words.csv`)."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from realizer import tables

FILE = "expression_words.csv"


@dataclass(frozen=True, slots=True)
class ExpressionWords:
    """Words of an expression; templates have their `features` in their own table."""

    name: str
    features: str
    means: str

    @property
    def words(self) -> tuple[str, ...]:
        """Return the words and phrases of `means`."""
        return tuple(word.strip() for word in self.means.split(";") if word.strip())


@cache
def expression_words() -> Mapping[str, ExpressionWords]:
    """Return name in the expression library -> words."""
    return {row.name: row for row in tables.csv_rows(FILE, ExpressionWords)}
