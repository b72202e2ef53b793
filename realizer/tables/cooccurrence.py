"""The co-occurrence rules of action units (`cooccurrence.toml`, or a user's file)."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, get_args

from realizer import tables
from realizer.core.errors import TableError

FILE = "cooccurrence.toml"
Kind = Literal["domination", "exclusion", "inclusion", "opposition"]
SIGNS: Mapping[str, str] = {"domination": "<", "exclusion": "@", "inclusion": "@", "opposition": "@"}
SMALL = "X"  # the fuzzy set that exclusion and inclusion use
MAX_DOMINANT = 2  # units that dominate another one together
UNIT = re.compile(r"([0-9]{1,3})([A-Za-z]?)")


@dataclass(frozen=True, slots=True)
class Unit:
    """An action unit in a rule, at any intensity or in a fuzzy set of intensities ("X", "Y", "Z")."""

    au: int
    set: str = ""


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule by which action units weaken another one."""

    kind: Kind  # class of the rule
    weaker: int  # the weakened AU; the first AU of an opposition
    stronger: tuple[Unit, ...]  # the AUs that weaken it together; only a domination has several
    text: str  # as written


@dataclass(frozen=True, eq=False)
class Rules:
    """A file of rules; `sets` maps a fuzzy set to the memberships of intensities 0, 0.5 and 1."""

    sets: Mapping[str, tuple[float, float, float]]
    rules: tuple[Rule, ...]


def load_rules(setting: str) -> Rules | None:
    """Return the rules of "on" (the built-in ones), "off" (None) or a file; errors as for `rules`."""
    return None if setting == "off" else rules(None if setting == "on" else Path(setting))


@cache
def rules(path: Path | None = None) -> Rules:
    """Return the rules of a file, or the built-in ones; raises TableError as `read_rules`."""
    if path is None:
        return read_rules(tables.text_of(FILE), FILE)
    try:
        return read_rules(path.read_text("utf-8"), str(path))
    except (OSError, UnicodeError) as error:
        raise TableError(f"{path}: wanted a file of co-occurrence rules, {error}") from None


def read_rules(text: str, name: str) -> Rules:
    """Read a file of rules that messages call `name`; raises TableError, with one line for each fault."""
    table = tables.read_toml(text, name)
    unknown = [key for key in table if key != "sets" and key not in SIGNS]
    faults = [f"{name}: wanted sections sets, {', '.join(SIGNS)}; got [{key}]" for key in unknown]
    sets = {
        key: _set(values, f"{name}, [sets] {key}", faults)
        for key, values in _section(table, "sets", name, faults).items()
    }
    found: list[Rule] = []
    for kind in get_args(Kind):
        for line in _lines(_section(table, kind, name, faults), f"{name}, [{kind}]", faults):
            try:
                found.append(parse_rule(line, kind, sets))
            except TableError as error:
                faults.append(f"{name}{_at(text, line)}, [{kind}] {line!r}: {error}")
    if SMALL not in sets and any(rule.kind in ("exclusion", "inclusion") for rule in found):
        faults.append(f"{name}, [sets]: wanted {SMALL} = [1, 0, 0], or how else a unit is small, got none")
    faults += [
        f"{name}{_at(text, rule.text)}, [{rule.kind}] {rule.text!r}: {says}"
        for rule, says in _contradictions(found)
    ]
    if faults:
        raise TableError("\n".join(faults))
    return Rules(sets, tuple(found))


def parse_rule(text: str, kind: Kind, sets: Mapping[str, Any]) -> Rule:
    """Parse a rule in the notation of the table: "5<63", "18<20+23", "12<15Z", "27@25"; raises TableError."""
    sign = SIGNS[kind]
    left, found, right = str(text).replace(" ", "").partition(sign)
    if not found:
        example = "16<12+18" if sign == "<" else "27@25"
        raise TableError(f"wanted two sides with {sign!r} between them, as {example}")
    names = right.split("+") if kind == "domination" else [right]
    if len(names) > MAX_DOMINANT:
        raise TableError(f"wanted one unit or {MAX_DOMINANT} together on the right, got {len(names)}")
    first = _unit(left, {})
    others = tuple(_unit(other, sets if kind == "domination" else {}) for other in names)
    if first.au in [other.au for other in others]:
        raise TableError(f"AU{first.au} stands on both sides")
    if kind in ("exclusion", "inclusion"):  # the stronger unit comes first
        return Rule(kind, others[0].au, (first,), text)
    return Rule(kind, first.au, others, text)


def _unit(text: str, sets: Mapping[str, Any]) -> Unit:
    match = UNIT.fullmatch(text)
    if match is None:
        raise TableError(f"wanted the number of an action unit, got {text!r}")
    number, name = int(match[1]), match[2].upper()
    if number not in tables.by_number():
        raise TableError(f"wanted an action unit that a face shows, got AU{number}")
    if name and name not in sets:
        known = " or ".join(sets) if sets else "no letter here"
        raise TableError(f"wanted {known} after the number, got {text!r}")
    return Unit(number, name)


def _section(table: Mapping[str, Any], key: str, name: str, faults: list[str]) -> Mapping[str, Any]:
    section = table.get(key, {})
    if isinstance(section, Mapping):
        return section
    faults.append(f"{name}: wanted a section [{key}], got {key} = {section!r}")
    return {}


def _lines(section: Mapping[str, Any], where: str, faults: list[str]) -> list[Any]:
    """Return the rules of a section and report other keys."""
    faults += [f"{where}: wanted rules = [...] alone, got {key}" for key in section if key != "rules"]
    lines = section.get("rules", [])
    if isinstance(lines, list):
        return lines
    faults.append(f'{where}: wanted rules = ["..."], got {lines!r}')
    return []


def _set(values: object, where: str, faults: list[str]) -> tuple[float, float, float]:
    match values:
        case [int() | float() as none, int() | float() as half, int() | float() as whole]:
            if all(0 <= value <= 1 for value in (none, half, whole)):
                return float(none), float(half), float(whole)
    faults.append(f"{where}: wanted three memberships 0..1, of intensity 0, 0.5 and 1; got {values!r}")
    return 0.0, 0.0, 0.0


def _at(text: str, rule: object) -> str:
    """Return ":7", the last line with the rule, or "" if it is not found."""
    lines = [row.partition("#")[0] for row in text.splitlines()]
    at = [n for n, row in enumerate(lines, 1) if f'"{rule}"' in row or f"'{rule}'" in row]
    return f":{at[-1]}" if at else ""


def _contradictions(found: list[Rule]) -> list[tuple[Rule, str]]:
    """Return rules that repeat or contradict other rules, with a description."""
    faults = []
    seen: dict[tuple[int, tuple[Unit, ...]], Rule] = {}
    for rule in found:
        key = (rule.weaker, rule.stronger)
        turned = (rule.stronger[0].au, (Unit(rule.weaker),)) if len(rule.stronger) == 1 else None
        if key in seen:
            faults.append((rule, f"says the same as {seen[key].text!r}"))
        elif turned in seen:
            faults.append((rule, f"says the opposite of {seen[turned].text!r}"))
        seen[key] = rule
    if not faults:
        faults += _cycles(found)
    return faults


def _cycles(found: list[Rule]) -> list[tuple[Rule, str]]:
    """Return a rule that closes a cycle of dominations such as 1<2, 2<4 and 4<1."""
    whole = {
        (rule.weaker, rule.stronger[0].au): rule
        for rule in found
        if rule.kind == "domination" and len(rule.stronger) == 1 and not rule.stronger[0].set
    }
    graph: dict[int, set[int]] = {}
    for weaker, stronger in whole:
        graph.setdefault(weaker, set()).add(stronger)
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        cycle = list(reversed(error.args[1]))  # each unit is dominated by the next one
        texts = [whole[pair].text for pair in pairwise(cycle)]
        return [(whole[cycle[-2], cycle[-1]], f"closes a cycle with {', '.join(texts[:-1])}")]
    return []
