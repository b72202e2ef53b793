"""The rules of the knowledge base of expressions (Wojdel 2005; `knowledge.toml`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from math import inf
from pathlib import Path
from typing import Any, Literal

from realizer import tables

Role = Literal["speaker", "listener"]
By = Literal["before", "after", "around", "with"]
FILE = "knowledge.toml"


@dataclass(frozen=True, slots=True)
class PlacementRule:
    """Expressions for a kind of sentence, or for words of a category.

    Attributes:
        when: "question", "exclamation", or a category of words.
        show: templates, in lower case, that are shown together.
        says: the rule as a sentence, with its source.
        unless: categories of words that exclude a sentence.
        beside: categories of words of which a sentence must have one; (): any sentence.
        most_words: most words of a sentence.
        outlasts: seconds for which the expression outlasts the speech, whose last sentence it must be; 0: no.
        keep: whether to warn if an expression is missing.
    """

    when: str
    show: tuple[str, ...]
    says: str
    unless: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()
    most_words: float = inf
    outlasts: float = 0.0
    keep: bool = False


@dataclass(frozen=True, slots=True)
class CompanionRule:
    """An expression that accompanies another one.

    Attributes:
        of, other: templates, in lower case.
        by: when `other` is shown.
        says: the rule as a sentence, with its source.
        lead: seconds by which `other` begins before `of` and, if around it, ends after it.
        keep: whether to warn if `other` is missing.
        offered: whether `other` is only suggested, not placed.
    """

    of: str
    other: str
    by: By
    says: str
    lead: float = 0.0
    keep: bool = False
    offered: bool = False


@dataclass(frozen=True, slots=True)
class Mood:
    """A mood.

    Attributes:
        distance: average seconds from the end of one expression to the start of the next.
        length: average duration of expressions, relative to the usual one.
    """

    name: str
    distance: float
    length: float


@dataclass(frozen=True)
class Knowledge:
    """The rules.

    Attributes:
        placings: role -> rules, most important first.
        apart: template -> seconds that must pass after the end of another expression.
        usual_distance: average seconds between two expressions of a speaker.
        listener_distance: least seconds between two expressions of a listener.
    """

    placings: Mapping[Role, tuple[PlacementRule, ...]]
    companies: tuple[CompanionRule, ...]
    apart: Mapping[str, float]
    usual_distance: float
    listener_distance: float
    moods: Mapping[str, Mood]

    def mood(self, word: str) -> Mood:
        """Return the mood for a word in any case.

        Raises:
            KeyError: an unknown word; the text lists similar ones.
        """
        name = word.strip().lower()
        if name not in self.moods:
            near = get_close_matches(name, self.moods, 3, 0.6) or sorted(self.moods)
            wanted = f"a word such as {', '.join(near)}" if near else "none, as this knowledge has no moods"
            raise KeyError(f"mood: wanted {wanted}; got {word!r}")
        return self.moods[name]


@cache
def knowledge() -> Knowledge:
    """Return the built-in rules."""
    return _knowledge(tables.toml_table(FILE))


def read_knowledge(path: Path) -> Knowledge:
    """Return the rules of a user's file; raises TableError."""
    return tables.user_table(path, _knowledge)


def _knowledge(table: Mapping[str, Any]) -> Knowledge:
    return Knowledge(
        {
            "speaker": tuple(_placing(row) for row in table.get("speaker", ())),
            "listener": tuple(_placing(row) for row in table.get("listener", ())),
        },
        tuple(_company(row) for row in table.get("company", ())),
        table.get("apart", {}),
        float(table["pace"]["speaker"]),
        float(table["pace"]["listener"]),
        _moods(table["mood"]),
    )


def _placing(row: Mapping[str, Any]) -> PlacementRule:
    lists = {name: tuple(row[name]) for name in ("show", "unless", "beside") if name in row}
    return PlacementRule(**{**row, **lists})


def _company(row: Mapping[str, Any]) -> CompanionRule:
    return CompanionRule(**{"other" if name == "is" else name: value for name, value in row.items()})


def _moods(rows: Mapping[str, Any]) -> dict[str, Mood]:
    mean = float(rows["mean"])
    known = {name: row for name, row in rows.items() if name != "mean"}
    values = {name: rows[row["like"]] if "like" in row else row for name, row in known.items()}
    return {
        name: Mood(name, float(row["distance"]), float(row["frames"]) / mean) for name, row in values.items()
    }
