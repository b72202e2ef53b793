"""The rules of Wojdel's knowledge base (`knowledge.toml`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from difflib import get_close_matches
from functools import cache
from typing import Any, Literal

from realizer import tables
from realizer.core.errors import TableError
from realizer.tables.emotional_words import CATEGORIES
from realizer.tables.templates import templates

FILE = "knowledge.toml"
Role = Literal["speaker", "listener"]
By = Literal["before", "after", "around", "with"]
SENTENCES = ("question", "exclamation")


@dataclass(frozen=True, slots=True)
class PlacementRule:
    """The expressions shown for a kind of sentence, or for a word of a category.

    Attributes:
        when: "question", "exclamation", or a category of words.
        show: names of templates, lower case; shown together.
        says: the rule in words, with its source.
        unless: categories of words that keep a sentence from it.
        keep: whether to warn if it is missing.
    """

    when: str
    show: tuple[str, ...]
    says: str
    unless: tuple[str, ...] = ()
    keep: bool = False


@dataclass(frozen=True, slots=True)
class CompanionRule:
    """An expression that comes with another one.

    Attributes:
        of, other: names of templates, lower case.
        by: the place of `other`.
        says: the rule in words, with its source.
        lead: seconds; how far `other` reaches over `of` at either end, or begins before it.
        keep: whether to warn if it is missing.
        offered: whether it is only suggested, not placed.
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
    """A state of mind.

    Attributes:
        name: as requested.
        distance: seconds from the end of one expression to the start of the next, on average.
        length: of expressions, beside their usual one.
    """

    name: str
    distance: float
    length: float


@dataclass(frozen=True)
class Knowledge:
    """The whole table.

    Attributes:
        placings: role -> rules, the more important first.
        companies: in file order.
        apart: name of a template -> seconds for which nothing may have ended before it.
        usual_distance: seconds between two expressions of a speaker, on average.
        listener_distance: seconds between two expressions of a listener, at least.
        moods: word -> mood.
    """

    placings: Mapping[Role, tuple[PlacementRule, ...]]
    companies: tuple[CompanionRule, ...]
    apart: Mapping[str, float]
    usual_distance: float
    listener_distance: float
    moods: Mapping[str, Mood]

    def mood(self, word: str) -> Mood:
        """The mood of a word, either case.

        Raises:
            KeyError: an unknown word; its text names those that are near.
        """
        name = word.strip().lower()
        if name not in self.moods:
            near = get_close_matches(name, self.moods, 3, 0.6) or sorted(self.moods)
            raise KeyError(f"mood: wanted a word such as {', '.join(near)}; got {word!r}")
        return self.moods[name]


@cache
def knowledge() -> Knowledge:
    """The rules that ship.

    Raises:
        TableError: an unknown template, category, or key.
    """
    table = tables.read_toml(tables.text_of(FILE), FILE)
    return Knowledge(
        {
            "speaker": tuple(_placing(row, "speaker") for row in table["speaker"]),
            "listener": tuple(_placing(row, "listener") for row in table["listener"]),
        },
        tuple(_company(row) for row in table["company"]),
        {_template(name, "apart"): float(seconds) for name, seconds in table["apart"].items()},
        float(table["pace"]["speaker"]),
        float(table["pace"]["listener"]),
        _moods(table["mood"]),
    )


def _placing(row: Mapping[str, Any], role: str) -> PlacementRule:
    place = f"{FILE}, {role}"
    _check_keys(row, PlacementRule, place)
    for category in (row["when"], *row.get("unless", ())):
        if category not in (*SENTENCES, *CATEGORIES):
            known = ", ".join((*SENTENCES, *CATEGORIES))
            raise TableError(f"{place}: wanted one of {known}, got {category!r}")
    show = tuple(_template(name, place) for name in row["show"])
    return PlacementRule(row["when"], show, row["says"], tuple(row.get("unless", ())), row.get("keep", False))


def _company(row: Mapping[str, Any]) -> CompanionRule:
    values = dict(row)
    values["other"] = _template(values.pop("is"), f"{FILE}, company")
    values["of"] = _template(values["of"], f"{FILE}, company")
    _check_keys(values, CompanionRule, f"{FILE}, company of {values['of']}")
    if values["by"] not in ("before", "after", "around", "with"):
        raise TableError(
            f"{FILE}, company of {values['of']}, by: wanted before, after, around or with; got {values['by']}"
        )
    return CompanionRule(**values)


def _check_keys(row: Mapping[str, Any], kind: type, place: str) -> None:
    known = {f.name for f in fields(kind)}
    if strange := row.keys() - known:
        raise TableError(f"{place}: wanted keys {', '.join(sorted(known))}; got {', '.join(strange)}")


def _template(name: str, place: str) -> str:
    if name.upper() not in templates():
        raise TableError(f"{place}: wanted a template, got {name!r}")
    return name.lower()


def _moods(rows: Mapping[str, Any]) -> dict[str, Mood]:
    mean = float(rows["mean"])
    moods = {}
    for name, row in rows.items():
        if name == "mean":
            continue
        own = rows[row["like"]] if "like" in row else row
        moods[name] = Mood(name, float(own["distance"]), float(own["frames"]) / mean)
    return moods
