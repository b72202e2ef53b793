"""The rules of the knowledge base of expressions (Wojdel 2005; `knowledge.toml`)."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from math import inf
from pathlib import Path
from typing import Any, Literal

from realizer import tables
from realizer.core.similar import similar

Role = Literal["speaker", "listener"]
By = Literal["before", "after", "around", "with"]
FILE = "knowledge.toml"


@dataclass(frozen=True, slots=True)
class PlacementRule:
    """Expressions for a kind of sentence, or for words of a category."""

    when: str  # "question", "exclamation", or a category of words
    show: tuple[str, ...]  # templates, in lower case, that are shown together
    says: str  # the rule as a sentence, with its source
    unless: tuple[str, ...] = ()  # categories of words that exclude a sentence
    beside: tuple[str, ...] = ()  # categories of words of which a sentence must have one; (): any sentence
    most_words: float = inf  # most words of a sentence
    # Seconds for which the expression outlasts the speech, whose last sentence it must be; 0: no.
    outlasts: float = 0.0
    keep: bool = False  # whether to warn if an expression is missing


@dataclass(frozen=True, slots=True)
class CompanionRule:
    """An expression that accompanies another one."""

    of: str  # template, in lower case
    other: str  # template, in lower case
    by: By  # when `other` is shown
    says: str  # the rule as a sentence, with its source
    lead: float = 0.0  # seconds by which `other` begins before `of` and, if around it, ends after it
    keep: bool = False  # whether to warn if `other` is missing
    offered: bool = False  # whether `other` is only suggested, not placed


@dataclass(frozen=True, slots=True)
class Mood:
    """A mood."""

    name: str
    distance: float  # average seconds from the end of one expression to the start of the next
    length: float  # average duration of expressions, relative to the usual one
    like: str  # name of the observed mood that it equals, its own if it was observed


@dataclass(frozen=True)
class Knowledge:
    """The rules."""

    placings: Mapping[Role, tuple[PlacementRule, ...]]  # role -> rules, most important first
    companies: tuple[CompanionRule, ...]
    apart: Mapping[str, float]  # template -> seconds that must pass after the end of another expression
    usual_distance: float  # average seconds between two expressions of a speaker
    listener_distance: float  # least seconds between two expressions of a listener
    moods: Mapping[str, Mood]

    def mood(self, word: str) -> Mood:
        """Return the mood for a word in any case; raises KeyError, whose text lists similar words."""
        name = word.strip().lower()
        if name not in self.moods:
            near = similar(name, self.moods) or sorted(self.moods)
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
    own = {name: row.get("like", name) for name, row in known.items()}
    return {
        name: Mood(name, float(rows[like]["distance"]), float(rows[like]["frames"]) / mean, like)
        for name, like in own.items()
    }
