"""Numbers in words, by the rules of `spellout.toml`."""

import re
from collections.abc import Mapping
from functools import cache, lru_cache
from typing import Any, NamedTuple

from realizer.tables import toml_table

FILE = "spellout.toml"
LARGEST = 10**15
_SLOT = re.compile(r"\{([qr])(?::(\w+))?\}")


class Rule(NamedTuple):
    """Words of numbers from `base` on."""

    base: int
    divisor: int
    words: tuple[str, ...]  # without a rest, with one, with one below 100


def languages() -> tuple[str, ...]:
    """Return the languages whose numbers are known."""
    return tuple(toml_table(FILE))


@lru_cache(maxsize=10_000)
def spelled(number: int, language: str, kind: str = "cardinal") -> str:
    """Return a number in words, such as "twenty-first"; in digits if it is too large for the rules.

    Args:
        kind: cardinal, ordinal, year, or another table of the language. One that the language lacks, and an
            ordinal number beyond the rules, is a cardinal number.
    """
    table = toml_table(FILE)[language].get(kind)
    if table is None:
        return spelled(number, language) if kind != "cardinal" else str(number)
    if "endings" in table:
        of = "ordinal" if kind.startswith("ordinal") else "cardinal"
        return _with_ending(spelled(number, language, of), table["endings"])
    small = table.get("small", "").split()
    if number < len(small):
        return str(small[number])
    rule = next((rule for rule in reversed(_rules(language, kind)) if rule.base <= number), None)
    if rule is None or number >= LARGEST:
        return spelled(number, language) if kind != "cardinal" else str(number)
    quotient, rest = divmod(number, rule.divisor)
    words = rule.words[
        0 if not rest else 2 if rest < 100 and len(rule.words) > 2 else min(1, len(rule.words) - 1)
    ]

    def fill(slot: re.Match[str]) -> str:
        return spelled(quotient if slot[1] == "q" else rest, language, slot[2] or kind)

    return _SLOT.sub(fill, words)


def _with_ending(words: str, endings: Mapping[str, str]) -> str:
    for end, other in endings.items():
        if words.endswith(end):
            return words[: len(words) - len(end)] + other
    return words


@cache
def _rules(language: str, kind: str) -> tuple[Rule, ...]:
    rows: list[str] = toml_table(FILE)[language][kind].get("rules", [])
    rules = []
    for row in rows:
        value, _, words = row.partition(" ")
        base, _, divisor = value.partition("/")
        size = int(divisor or 10 ** (len(base) - 1))
        rules.append(Rule(int(base), size, tuple(words.split("|"))))
    return tuple(rules)


def facts(language: str) -> Mapping[str, Any]:
    """Return the words for a decimal point and a minus sign, and whether decimals are one number."""
    table: Mapping[str, Any] = toml_table(FILE)[language]
    return table
