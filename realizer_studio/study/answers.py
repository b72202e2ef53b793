"""Answers of judges, joined with the key of the study."""

import csv
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from realizer.core.errors import TableError
from realizer_studio.study.items import ANSWERS

COLUMNS = (
    *("study", "judge", "by", "item", "kind", "answer", "text", "angle", "strength", "seconds", "position"),
)
PASSED = 0.75  # share of attention items that must be right


@dataclass(frozen=True)
class Answer:
    """An answer to one item."""

    judge: str  # the judge's number
    group: str  # "people", "machine" or "simulated": groups that are never mixed
    item: str
    truth: Mapping[str, Any]  # of the item, from the key
    role: str  # the choice: a role in `truth["options"]` such as "right", or a word
    text: str  # free words
    angle: float | None  # degrees on the wheel, or None
    seconds: float  # time needed

    @property
    def kind(self) -> str:
        return str(self.truth["kind"])

    @property
    def right(self) -> bool:
        """Whether the answer is that of the key, which has none for scores and preferences."""
        return self.role == str(self.truth.get("emotion", "right"))


def read_key(path: Path) -> dict[str, Any]:
    """Read the key of a study; raises TableError if the file is no key."""
    try:
        key = json.loads(path.read_text("utf-8"))
        if not isinstance(key, dict) or not isinstance(key["items"], dict) or not key["study"]:
            raise KeyError("items")
    except (OSError, ValueError, KeyError) as error:
        raise TableError(f"{path}: wanted the key of a study, DIR.key.json, got: {error}") from None
    return key


def read_answers(paths: Iterable[Path], key: Mapping[str, Any]) -> list[Answer]:
    """Read the answers of judges, a file or several each.

    Raises:
        TableError: no answers, answers to another study, an unknown item or answer, or two answers of one
            judge to one item; with file and line.
    """
    found: dict[tuple[str, str, str], tuple[str, Answer]] = {}
    paths = list(paths)
    for path in paths:
        for location, line in _lines(path):
            if line["study"] != key["study"]:
                raise TableError(
                    f"{location}: wanted answers of the study {key['study']}, got {line['study']}"
                )
            answer = _answer(line, key, location)
            same = answer.group, answer.judge, answer.item
            if same in found:
                raise TableError(
                    f"{location}: judge {answer.judge} has answered this at {found[same][0]} already"
                )
            found[same] = location, answer
    if not found:
        raise TableError(f"{', '.join(map(str, paths))}: wanted at least one answer, got none")
    return [answer for _, answer in found.values()]


def _lines(path: Path) -> Iterable[tuple[str, dict[str, str]]]:
    try:
        rows = csv.DictReader(path.read_text("utf-8-sig").splitlines(), restval="")
        if list(rows.fieldnames or ()) != list(COLUMNS):
            header = f"the columns {','.join(rows.fieldnames)[:80]}" if rows.fieldnames else "an empty file"
            raise TableError(f"{path}: wanted answers with the columns {','.join(COLUMNS)}, got {header}")
        return [(f"{path}, line {number}", line) for number, line in enumerate(rows, 2)]
    except (OSError, UnicodeError, csv.Error) as error:
        raise TableError(f"{path}: wanted answers as CSV, got: {error}") from None


def _answer(line: Mapping[str, str], key: Mapping[str, Any], location: str) -> Answer:
    truth = key["items"].get(line["item"])
    if truth is None:
        raise TableError(f"{location}, item: wanted one of the study, got {line['item']!r}")
    role = truth["options"].get(line["answer"], line["answer"])
    if role not in (*truth["options"].values(), *ANSWERS[truth["kind"]]):
        raise TableError(f"{location}, answer: wanted a choice of this item, got {role!r}")
    try:
        angle, seconds = (float(line[name]) if line[name] else None for name in ("angle", "seconds"))
    except ValueError as error:
        raise TableError(f"{location}: wanted numbers as angle and seconds: {error}") from None
    group = {"person": "people"}.get(line["by"], line["by"])
    return Answer(line["judge"], group, line["item"], truth, role, line["text"], angle, seconds or 0.0)


def attention(answers: Sequence[Answer]) -> dict[tuple[str, str], tuple[int, int]]:
    """Return (group, judge) -> numbers of right and of answered attention items."""
    found: dict[tuple[str, str], tuple[int, int]] = {}
    for answer in answers:
        right, every = found.get((answer.group, answer.judge), (0, 0))
        if "check" in answer.truth:
            right, every = right + (answer.role == answer.truth["check"]), every + 1
        found[answer.group, answer.judge] = right, every
    return found


def inattentive(answers: Sequence[Answer]) -> list[tuple[str, str]]:
    """Return (group, judge) of the judges who failed more than a quarter of their attention items."""
    return [judge for judge, (right, every) in attention(answers).items() if right < PASSED * every]
