"""Wojdel's 32 action units: their kinds of movement, and the shapes that measure them."""

from dataclasses import dataclass
from functools import cache
from typing import Literal

from realizer.tables import csv_rows


@dataclass(frozen=True, slots=True)
class Unit:
    """A row of units.csv."""

    au: int
    kind: Literal["displacement", "head", "eyes"]
    split: bool
    turn: str
    also: str
    shapes: str

    @property
    def mixture(self) -> dict[str, float]:
        """Face unit -> weight."""
        pairs = (pair.split(":") for pair in self.shapes.split())
        return {name: float(weight) for name, weight in pairs}

    @property
    def names(self) -> tuple[int, ...]:
        """Its number, then those of the units that move the face as it does."""
        return self.au, *map(int, self.also.split())


@cache
def units() -> dict[int, Unit]:
    """Return number -> unit, ascending."""
    return {row.au: row for row in csv_rows("units.csv", Unit, __package__)}
