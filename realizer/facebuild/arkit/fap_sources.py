"""What moves each FAP of an imported head, and how sure that is."""

from collections.abc import Collection
from dataclasses import dataclass
from functools import cache
from itertools import groupby

from realizer.tables import csv_rows, faps

EYES, LOOKS, PUPILS = range(23, 29), range(23, 27), range(29, 31)
TONGUE, HEAD = range(43, 48), range(48, 51)
SURE, FAIR, GUESS = "sure", "fair", "guess"


@dataclass(frozen=True)
class FapSource:
    """What moves a FAP.

    Attributes:
        made_by: the names of shapes, or in words what else.
        sure: SURE: by the head itself; FAIR: one of shape and feature point is not its own; GUESS: both.
    """

    fap: int
    made_by: str
    sure: str


@dataclass(frozen=True)
class _Row:
    fap: int
    shapes: str


@cache
def _shapes() -> dict[int, str]:
    return {row.fap: row.shapes for row in csv_rows("fap_sources.csv", _Row, __package__)}


def fap_sources(
    made: Collection[int], guesses: Collection[str], parts: Collection[str], painted: bool
) -> tuple[FapSource, ...]:
    """Return what moves each FAP from 3 to 68.

    Args:
        made: FAPs that the head's shapes move; guesses: feature points that its shapes do not show.
        parts: parts of the head; painted: whether the eyes are no balls of their own.
    """
    out = []
    for row in faps()[2:]:
        guessed = row.feature_point in guesses
        if row.fap in made:
            words, sure = _shapes()[row.fap], FAIR if guessed else SURE
        elif row.fap in LOOKS and painted:
            words, sure = "eyeLook shapes", SURE
        elif row.fap in EYES and not painted:
            words, sure = "a turn or push of the eyeball", SURE
        elif row.fap in HEAD:
            words, sure = "a turn of the head about the neck, by height", FAIR
        elif row.fap in TONGUE and "tongue" not in parts:
            words, sure = "nothing: there is no tongue", SURE
        else:
            lacks = f" (its shapes {_shapes()[row.fap]} lack or do not fit)" if row.fap in _shapes() else ""
            words, sure = f"a zone around its point{lacks}", GUESS if guessed else FAIR
        out.append(FapSource(row.fap, words, sure))
    return tuple(out)


def source_table(sources: Collection[FapSource]) -> tuple[str, ...]:
    """Return the sources as lines of a table, FAPs of the same source together."""
    order = sorted(sources, key=lambda one: ((SURE, FAIR, GUESS).index(one.sure), one.made_by, one.fap))
    cells = [("FAPs", "move by", "how sure")] + [
        (_ranges([one.fap for one in group]), made_by, sure)
        for (sure, made_by), group in groupby(order, lambda one: (one.sure, one.made_by))
    ]
    wide = [max(len(row[k]) for row in cells) for k in range(2)]
    return tuple(f"{a:<{wide[0]}}  {b:<{wide[1]}}  {c}" for a, b, c in cells)


def _ranges(numbers: list[int]) -> str:
    """Return ascending numbers in words such as 3, 5-7."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else str(run[0]) for run in runs)
