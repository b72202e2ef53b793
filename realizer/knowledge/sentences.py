"""Sentences of a text: words, boundaries and estimated times (Wojdel 2005, 6.4.1)."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from realizer.speech.letter_to_sound import subtag, syllable_facts, vowel_units
from realizer.speech.words import words_in

QUESTION, EXCLAMATION = "?？؟՞\u037e", "!！՜"  # U+037E is the Greek one, which looks like a semicolon
EMOJI = "\U0001f000-\U0001faff\u2600-\u27bf"  # not spoken
ENDS = re.compile(
    rf"[.?!…。？！؟।՞՜\u037e]+[\"'”’»)\]\u200e\u200f\u202c\u2069]*(?=\s|$|[{EMOJI}])|[。？！؟।]+|\n\s*\n"
)
SPOKEN = re.compile(f"[^{EMOJI}]")


@dataclass(frozen=True, slots=True)
class SpokenWord:
    """A word of a text.

    Attributes:
        place: number of characters before it.
        start, end: seconds from the start of the text, estimated from vowel units (eq. 6.6 to 6.10).
    """

    text: str
    place: int
    start: float
    end: float


@dataclass(frozen=True, slots=True)
class Sentence:
    """Words up to a full stop, a question or exclamation mark, or an empty line."""

    words: tuple[SpokenWord, ...]
    question: bool = False
    exclamation: bool = False


def sentences(text: str, language: str = "en") -> tuple[Sentence, ...]:
    """Return the sentences of a text that have words; the language, a BCP-47 tag, defines the vowels."""
    unit = float(syllable_facts()["unit"])  # s of a vowel unit
    if subtag(language) == "el":
        text = text.replace(";", "\u037e")  # the Greek question mark; keyboards write a semicolon
    found: list[Sentence] = []
    now = 0.0
    for piece, place, signs in _pieces(text):
        words = []
        at = place
        for word, start in words_in(piece):
            if not SPOKEN.search(word):
                continue
            now += _pauses(text[at : place + start]) * unit
            length = vowel_units(word, language) * unit
            words.append(SpokenWord(word, place + start, now, now + length))
            now += length
            at = place + start + len(word)
        now += _pauses(text[at : place + len(piece)] + signs) * unit
        if words:
            question = any(sign in signs for sign in QUESTION)
            found.append(Sentence(tuple(words), question, any(sign in signs for sign in EXCLAMATION)))
    return tuple(found)


def _pieces(text: str) -> Iterator[tuple[str, int, str]]:
    """Yield (text of a sentence, its place, the signs that end it)."""
    at = 0
    for end in ENDS.finditer(text):
        yield text[at : end.start()], at, end[0]
        at = end.end()
    yield text[at:], at, ""


def _pauses(between: str) -> int:
    """Return the vowel units of a pause: one for each run of punctuation (eq. 6.6)."""
    phrase = syllable_facts()["phrase"]
    inside = [sign in phrase for sign in between]
    return sum(now and not before for before, now in zip([False, *inside], inside, strict=False))
