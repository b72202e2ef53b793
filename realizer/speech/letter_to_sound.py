"""Vowel units and approximate phonemes of written words, by tables for each language."""

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from itertools import product
from typing import Any, Literal

from realizer import tables

GENERIC = "any"
LONGEST_GROUP = 6  # letters
# The table of vowel units: durations, and the vowels of each language.
syllable_facts = partial(tables.toml_table, "syllables.toml")


@dataclass(frozen=True, slots=True)
class LetterRule:
    """The sound of a group of letters; `ipa` is phonemes joined by "-"."""

    language: str
    letters: str
    place: Literal["any", "start", "end", "word"]
    ipa: str


@lru_cache(maxsize=4096)  # texts repeat words
def vowel_units(word: str, language: str) -> int:
    """Return the length of a word in vowel units, at least 1. Digits count by their names.

    Source: Wojdel 2005, equation 6.6 (there: the vowel letters of Polish).
    """
    facts = _facts(language)
    return sum(_units(part, facts) for part in _parts(word, facts)) or 1


def letters_to_phonemes(word: str, language: str) -> tuple[str, ...]:
    """Return the approximate IPA of a word by the longest groups of letters in the table, left to right."""
    facts = _facts(language)
    return tuple(ipa for part in _parts(word, facts) for ipa in _sounded(part, subtag(language)))


def subtag(language: str) -> str:
    """Return the first part of a BCP-47 tag, in lower case."""
    return re.split("[-_]", language)[0].lower()


def _facts(language: str) -> Mapping[str, Any]:
    languages: Mapping[str, Mapping[str, Any]] = syllable_facts()["languages"]
    return languages.get(subtag(language), languages[GENERIC])


def _parts(word: str, facts: Mapping[str, Any]) -> list[str]:
    """Return the parts of a word in lower case, without joining characters; digits by their names."""
    word = unicodedata.normalize("NFC", word.lower()).replace("’", "'")
    parts: list[str] = []
    for run in re.findall(r"\d|[^\W\d_]+(?:'[^\W\d_]+)*|\S", word):
        if run.isdecimal():
            parts.append(facts["digits"][unicodedata.decimal(run)])
        else:
            parts.append(run.replace("'", ""))
    return parts


def _units(word: str, facts: Mapping[str, Any]) -> int:
    if word in facts["exceptions"]:
        return int(facts["exceptions"][word])
    for pattern in facts["silent"]:
        word = re.sub(pattern, "", word)
    vowels: str = facts["vowels"]
    groups = _longest_first(tuple(facts["groups"]), tuple(facts["consonants"]))
    count = at = 0
    while at < len(word):
        group = next((g for g in groups if word.startswith(g, at)), None)
        if group is not None:
            count += group not in facts["consonants"]
        elif word[at] in vowels or _plain(word[at]) in vowels:
            count += 1
        elif unicodedata.category(word[at]) == "Lo":
            count += 1  # a script without letters for vowels, or with letters for syllables
        at += len(group) if group else 1
    return max(count, 1)


@lru_cache(maxsize=16)
def _longest_first(*groups: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(sorted((g for some in groups for g in some), key=len, reverse=True))


def _plain(letter: str) -> str:
    return unicodedata.normalize("NFD", letter)[0]


@cache
def _rules() -> Mapping[tuple[str, str, str], tuple[str, ...]]:
    rows = tables.csv_rows("phonemes_letters.csv", LetterRule)
    return {
        (row.language, row.letters, row.place): tuple(row.ipa.split("-")) if row.ipa else () for row in rows
    }


@lru_cache(maxsize=4096)
def _sounded(word: str, language: str) -> tuple[str, ...]:
    whole = _rules().get((language, word, "word"))
    if whole is not None:
        return whole
    heard: list[str] = []
    at = 0
    while at < len(word):
        letters, ipa = _longest(word, at, language)
        # A doubled letter is one sound.
        if not (len(ipa) == 1 and heard[-1:] == [ipa[0]] and word[at] == word[at - 1]):
            heard += ipa
        at += letters
    return tuple(heard)


def _longest(word: str, at: int, language: str) -> tuple[int, tuple[str, ...]]:
    for size in range(min(LONGEST_GROUP, len(word) - at), 0, -1):
        letters = word[at : at + size]
        place = "start" if at == 0 else "end" if at + size == len(word) else "any"
        for where, owner in product((place, "any"), (language, GENERIC)):
            if (owner, letters, where) in _rules():
                return size, _rules()[owner, letters, where]
    plain = _plain(word[at])
    if plain != word[at]:
        return 1, _rules().get((language, plain, "any"), _rules().get((GENERIC, plain, "any"), ()))
    # A letter of an unknown script is an open vowel, so that the mouth moves.
    return 1, ("a",) if unicodedata.category(word[at]).startswith("L") else ()
