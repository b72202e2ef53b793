"""Stage directions, emoji and emoticons, and the behaviours that they become."""

import re
import unicodedata
from collections.abc import Mapping
from functools import cache
from typing import NamedTuple

from realizer.tables import toml_table
from realizer.tables.lexemes import face_lexemes, head_lexemes
from realizer.text.parts import Tag

FILE = "text_marks.toml"
LANGUAGES = ("en", "de", "fr", "es", "nl")
LONGEST = 8  # words of a direction
# Pictures with what joins and colours them; digits and signs are pictures only before U+FE0F or U+20E3.
PICTURES = re.compile(
    "(?:[0-9#*]\ufe0f?\u20e3|[©®™‼⁉]\ufe0f|"
    "[\U0001f000-\U0001faff\u2600-\u27bf\u2b00-\u2bff\u2300-\u23ff\ufe0f\u200d\U000e0020-\U000e007f])+"
)
_WORD = re.compile(r"[^\W\d_]+(?:['’][^\W\d_]+)*")
_SENTENCE_END = re.compile(r"[.!?…。！？؟।][\"'”’»)\]]*\s*$")
SPEECH = re.compile(
    r"([^:\"“„«]+)(?::|(?=[\"“„«]))(.*\w.*)", re.DOTALL
)  # a direction, and what is said in it
_VOWELS = "aeiou"


class Direction(NamedTuple):
    """What a stage direction shows.

    Attributes:
        shows: its behaviours.
        unknown: its acts that are not known.
        is_plain: whether each act is a verb with an adverb or a short known tail at most.
        is_bare: whether an act is in the form of a command or of the past: "smile", "smiled".
    """

    shows: tuple[Tag, ...]
    unknown: str
    is_plain: bool
    is_bare: bool


def behaviour(name: str) -> Tag:
    """Return the behaviour for a name of the table."""
    if name == "pause":
        return Tag('<break time="500ms"/>')
    if name in head_lexemes():
        return Tag(f'<head lexeme="{name}"/>', shows=True)
    if name in face_lexemes():
        return Tag(f'<faceLexeme lexeme="{name}"/>', shows=True)
    return Tag(f'<realizer:emotion name="{name}"/>', shows=True)


def direction(text: str) -> Direction | None:
    """Return what a known stage direction shows: "smiles", "slowly nods", "shakes her head and sighs"."""
    shows, unknown = [], []
    is_plain, is_bare = True, False
    for act in re.split(r",| and | und | et | y | en ", text.strip(" .!…").lower()):
        words = _WORD.findall(act)
        found = _shown(words) if len(words) <= LONGEST else None
        if found is not None:
            name, verb, tail = found
            shows.append(behaviour(name))
            is_plain = is_plain and all(
                word.endswith("ly") or word in _words("context", "tail") for word in tail
            )
            is_bare = is_bare or verb in _bare()
        elif words:
            unknown.append(act.strip())
    return Direction(tuple(shows), ", ".join(unknown), is_plain, is_bare) if shows else None


def is_direction(found: Direction, before: str, after: str) -> bool:
    """Return whether emphasised words are a direction: a bare verb is one between sentences only.

    Args:
        before: the words before it.
        after: the words after it.
    """
    return not found.is_bare or (
        found.is_plain
        and (not before.strip() or _SENTENCE_END.search(before) is not None)
        and not after.lstrip()[:1].islower()
        and after.lstrip()[:1] not in (*",;:)'’–—-",)
    )


def in_brackets(text: str) -> Tag | None:
    """Return what a word in square brackets shows: a lexeme, an emotion or a stage direction."""
    name = text.strip().replace(" ", "_")
    if name.upper() in _lexemes():
        return behaviour(name.upper())
    if (feeling := _feelings().get(name.lower())) is not None:
        return behaviour(feeling)
    return in_parentheses(text)


def in_parentheses(text: str) -> Tag | None:
    """Return what words in parentheses show, if they are one stage direction."""
    found = direction(text)
    is_one = found is not None and len(found.shows) == 1 and not found.unknown and found.is_plain
    return found.shows[0] if found is not None and is_one else None


def is_third_person(text: str) -> bool:
    """Return whether emphasised words look like a stage direction that is not known: "whistles a tune"."""
    first = next(iter(_WORD.findall(text)), "")
    return (
        text[:1].islower()
        and first.endswith(("s", "ing"))
        and not first.endswith("ss")
        and first not in _never()
    )


def belongs_to_sentence(before: str) -> bool:
    """Return whether emphasised words after this text are part of its sentence."""
    last = _WORD.findall(before[-40:])[-1:]
    return bool(last) and before.rstrip()[-1:].isalpha() and last[0].lower() in _words("context", "before")


def is_named(before: str) -> bool:
    """Return whether a word in brackets after this text is named by it: "the word [sob]"."""
    last = _WORD.findall(before[-40:])[-1:]
    return bool(last) and last[0].lower() in _words("context", "names")


def element_names(kind: str) -> frozenset[str]:
    """Return the names of elements of a kind: html, those of it that begin a line ("lines"), or ssml."""
    return _words("elements", kind)


def of_picture(picture: str) -> Tag | None:
    """Return what a run of emoji shows, by the first one that is known."""
    return next((behaviour(_emoji()[c]) for c in picture if c in _emoji()), None)


def of_emoticon(sign: str) -> Tag:
    """Return what an emoticon that `emoticons` matches shows."""
    return behaviour(_emoticons()[sign])


@cache
def emoticons() -> re.Pattern[str]:
    """Return the pattern of emoticons between blanks or before punctuation."""
    signs = "|".join(map(re.escape, sorted(_emoticons(), key=len, reverse=True)))
    return re.compile(rf"(?<!\S)(?:{signs})(?=[\s.,!?]|$)")


def inflections(verb: str) -> tuple[str, ...]:
    """Return the forms of a regular English verb: nod, nods, nodding, nodded."""
    if verb.endswith("y") and verb[-2] not in _VOWELS:
        return verb, f"{verb[:-1]}ies", f"{verb}ing", f"{verb[:-1]}ied"
    stem = verb.removesuffix("e")
    if verb == stem and verb[-1] not in f"{_VOWELS}wxy" and verb[-2] in _VOWELS and verb[-3] not in _VOWELS:
        stem += verb[-1]
    return verb, verb + ("es" if verb.endswith(("s", "sh", "ch", "x")) else "s"), f"{stem}ing", f"{stem}ed"


def _shown(words: list[str]) -> tuple[str, str, list[str]] | None:
    """Return what an act shows, its verb, and the words after it beside the one that must follow."""
    while len(words) > 1 and (words[0] in _words("context", "subjects") or words[0].endswith("ly")):
        words = words[1:]
    for follows, name in _verbs().get(words[0], ()) if words else ():
        if not follows or follows in words[1:]:
            return name, words[0], [word for word in words[1:] if word != follows]
    return None


@cache
def _bare() -> frozenset[str]:
    """Return the forms of English verbs that are no third person and no participle."""
    forms = [
        inflections(phrase.partition("+")[0])
        for row in toml_table(FILE)["en"].values()
        for phrase in row.split()
    ]
    return frozenset(form for bare, _, _, past in forms for form in (bare, past))


@cache
def _verbs() -> Mapping[str, tuple[tuple[str, str], ...]]:
    """Return form of a verb -> (word that must follow or "", name)."""
    found: dict[str, tuple[tuple[str, str], ...]] = {}
    for language in LANGUAGES:
        for name, phrases in toml_table(FILE)[language].items():
            for phrase in phrases.split():
                verb, _, follows = phrase.partition("+")
                for form in inflections(verb) if language == "en" else (verb,):
                    found[form] = (*found.get(form, ()), (follows, name))
    return found


@cache
def _words(*keys: str) -> frozenset[str]:
    row = toml_table(FILE)
    for key in keys:
        row = row[key]
    return frozenset(str(row).split())


def _never() -> frozenset[str]:
    return _words("context", "never")


@cache
def _lexemes() -> frozenset[str]:
    return frozenset({*face_lexemes(), *head_lexemes()})


@cache
def _feelings() -> Mapping[str, str]:
    rows = toml_table(FILE)["emotions"]
    alike = {word: name for name, words in rows["alike"].items() for word in words.split()}
    return {"pause": "pause", **alike, **{name: name for name in rows["names"].split()}}


@cache
def _emoji() -> Mapping[str, str]:
    names = {name: shows for shows, names in toml_table(FILE)["emoji"].items() for name in names}
    found = {}
    for name, shows in names.items():
        try:
            found[unicodedata.lookup(name)] = shows
        except KeyError:  # newer than this Python
            continue
    return found


@cache
def _emoticons() -> Mapping[str, str]:
    return {sign: name for name, signs in toml_table(FILE)["emoticons"].items() for sign in signs.split()}
