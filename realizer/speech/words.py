"""The words of a script with their places."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass

from realizer.speech.ssml import Break, Mark, Script
from realizer.speech.ssml_prosody import PLAIN, Prosody

# Ideographs and kana are words of their own (there are no blanks between words to go by).
SINGLE = r"[\u3040-\u30ff\u3400-\u9fff\uf900-\ufaff\U00020000-\U0003ffff]"
# Letters with their marks, joined by apostrophes, hyphens or dots between letters; numbers with their signs.
WORD = re.compile(
    rf"{SINGLE}|\d[\d.,:/]*\d|(?:(?!{SINGLE})[^\W_]|[\u0300-\u036f\u0900-\u0dff])+"
    rf"(?:['’.\u00ad-](?!{SINGLE})[^\W_]+)*|[&%@+=°§#*]|[^\s\w!-/:-@\[-`{{-~]",
)


@dataclass(frozen=True, slots=True)
class WordToken:
    """A word as it is written; `place` counts characters in the text that the engine is given."""

    text: str
    place: int
    rate: float = 1.0
    volume: float = 1.0


@dataclass(frozen=True, slots=True)
class Pause:
    """A silence that the text asks for: `signs` is punctuation, `seconds` a <break>."""

    signs: str
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class PlacedMark:
    """A mark: `word` is the index of the next word; `paused` whether a <break> lies between."""

    name: str
    word: int
    paused: bool


Token = WordToken | Pause | Mark


def words_in(text: str) -> Iterator[tuple[str, int]]:
    """(word, place) in order; symbols that are spoken ("&", "€") count as words, punctuation does not."""
    for found in WORD.finditer(text):
        first = found[0][0]
        if unicodedata.category(first)[0] in "LNSM" or first in "&%@#*§":
            yield found[0], found.start()


def tokens(script: Script, phrase: str) -> tuple[Token, ...]:
    """Words, pauses and marks in the order of the text, for a voice that has no engine.

    Args:
        script: the parts; <prosody> scales the words inside it, <sub alias> replaces its text.
        phrase: the characters that make a pause; a run of them is one.
    """
    found: list[Token] = []
    manners = [PLAIN]  # of the open tags, outermost first
    hidden = 0  # depth inside <sub>
    place = 0
    for part in script.parts:
        if isinstance(part, str):
            if not hidden:
                found += _spelled(part, place, manners[-1], phrase)
            place += len(part)
        elif isinstance(part, Mark):
            found.append(part)
        elif isinstance(part, Break):
            found.append(Pause("", part.seconds))
        elif part.attributes is None:
            manners.pop()
            hidden -= part.name == "sub"
        else:
            values = dict(part.attributes)
            manners.append(manners[-1].within(values) if part.name == "prosody" else manners[-1])
            if part.name == "sub":
                found += _spelled(values.get("alias", ""), place, manners[-1], phrase)
                hidden += 1
    return tuple(found)


def _spelled(text: str, place: int, manner: Prosody, phrase: str) -> Iterator[Token]:
    at = 0
    for word, start in [*words_in(text), ("", len(text))]:
        signs = "".join(c for c in text[at:start] if c in phrase)
        if signs:
            yield Pause(signs)
        if word:
            yield WordToken(word, place + start, manner.rate, manner.volume)
        at = start + len(word)
