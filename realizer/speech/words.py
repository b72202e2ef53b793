"""A tokenizer of scripts: words with their places, pauses and marks."""

import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass

from realizer.speech.ssml import Break, Mark, Script
from realizer.speech.ssml_prosody import PLAIN, Prosody

# Ideographs and kana are words of their own, as there are no blanks between words.
SINGLE = r"[\u3040-\u30ff\u3400-\u9fff\uf900-\ufaff\U00020000-\U0003ffff]"
# Letters with diacritics, joined by apostrophes, hyphens or dots between letters; numbers with their signs.
WORD = re.compile(
    rf"{SINGLE}|\d[\d.,:/]*\d|(?:(?!{SINGLE})[^\W_]|[\u0300-\u036f\u0900-\u0dff])+"
    rf"(?:['’.\u00ad-](?!{SINGLE})[^\W_]+)*|[&%@+=°§#*]|[^\s\w!-/:-@\[-`{{-~]"
)


@dataclass(frozen=True, slots=True)
class WordToken:
    """A written word; `place` is its index in the text that the engine gets."""

    text: str
    place: int
    rate: float = 1.0
    volume: float = 1.0


@dataclass(frozen=True, slots=True)
class Pause:
    """A pause of punctuation, `signs`, or of a <break> of `seconds`."""

    signs: str
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class PlacedMark:
    """A mark: `word` is the index of the next word; `paused` whether a <break> is between them."""

    name: str
    word: int
    paused: bool


Token = WordToken | Pause | Mark


def words_in(text: str) -> Iterator[tuple[str, int]]:
    """Yield (word, place) in order; symbols that are spoken ("&", "€") are words, punctuation is not."""
    for found in WORD.finditer(text):
        first = found[0][0]
        if unicodedata.category(first)[0] in "LNSM" or first in "&%@#*§":
            yield found[0], found.start()


def tokens(script: Script, phrase: str) -> tuple[Token, ...]:
    """Return words, pauses and marks in the order of the text, for voices without an engine.

    Args:
        script: the parts; <prosody> scales the words inside it, <sub alias> replaces its text.
        phrase: the characters of pauses; several together are one pause.
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
