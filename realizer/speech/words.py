"""A tokenizer of scripts: words with their places, pauses and marks."""

import unicodedata
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import regex

from realizer.speech.ssml import Break, Mark, Script
from realizer.speech.ssml_prosody import PLAIN, Prosody
from realizer.tables.phonemes import vowels

# Ideographs and kana are words of their own, as there are no blanks between words.
SINGLE = r"[\u3040-\u30ff\u3400-\u9fff\uf900-\ufaff\U00020000-\U0003ffff]"
# A letter, a digit, or what is added to one: a vowel sign, an accent, a joiner.
LETTER = r"[\p{L}\p{N}\p{M}\u200c\u200d]"
# Letters with diacritics, joined by apostrophes, hyphens or dots between letters; numbers with their signs.
WORD = regex.compile(
    rf"{SINGLE}\p{{M}}*|\d[\d.,:/]*\d|(?:(?!{SINGLE}){LETTER})+"
    rf"(?:['’.\u00ad-](?:(?!{SINGLE}){LETTER})+)*|[&%@+=°§#*]|[^\s\w!-/:-@\[-`{{-~]"
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

    <prosody> scales the words inside it, <sub alias> replaces its text. `phrase` has the characters of
    pauses; several together are one pause.
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


MAX_CELLS = 60_000  # of an alignment; longer texts are divided by numbers of phonemes
SKIP, UNLIKE, ALIKE, HINT = 0.7, 1.2, 0.4, -0.5  # costs of the alignment; our choice


def boundaries(
    expected: Sequence[Sequence[str]], heard: Sequence[str], hints: Collection[int] = ()
) -> list[int]:
    """Return the index of each word's first phoneme, by aligning the phonemes of words spoken separately.

    `hints` are indices at which the engine reports a word.
    """
    if len(expected) == 1:
        return [0]
    flat = [(strip_marks(sound), n == 0) for word in expected for n, sound in enumerate(word)]
    if not flat or len(flat) * len(heard) > MAX_CELLS:
        counts = np.array([max(len(word), 1) for word in expected], float)
        shares = np.concatenate(([0.0], np.cumsum(counts)[:-1])) / counts.sum()
        return [round(share * len(heard)) for share in shares]
    plain = [strip_marks(sound) for sound in heard]
    # Lists are faster than arrays, because the groups are small and indexed one number at a time.
    cost = [SKIP * j for j in range(len(plain) + 1)]
    steps = [[2] * (len(plain) + 1)]  # 0 both, 1 expected alone, 2 heard alone
    for sound, opens in flat:
        above, cost, step = cost, [cost[0] + SKIP], [1]
        for j, other in enumerate(plain):
            hint = HINT if opens and j in hints else 0.0
            ways = (above[j] + _difference(sound, other) + hint, above[j + 1] + SKIP, cost[j] + SKIP)
            cost.append(min(ways))
            step.append(ways.index(cost[-1]))
        steps.append(step)
    at = [0] * len(flat)  # for each expected phoneme, the index of the first heard one from there on
    i, j = len(flat), len(plain)
    while i:
        if steps[i][j] == 2:
            j -= 1
            continue
        j -= steps[i][j] == 0
        i -= 1
        at[i] = j
    found, passed = [], 0
    for word in expected:
        found.append(at[passed] if passed < len(at) else len(plain))
        passed += len(word)
    found[0] = 0
    return found


def divided(
    own: Sequence[int], expected: Sequence[Sequence[str]], heard: Sequence[str], hints: Collection[int] = ()
) -> list[Sequence[int]]:
    """Return the part of each word of `own`, items of the heard phonemes; the rest is as for `boundaries`."""
    return [own[first:last] for first, last in pairwise([*boundaries(expected, heard, hints), len(own)])]


def strip_marks(ipa: str) -> str:
    return ipa.strip("ˈˌː_").replace("ː", "")


def is_vowel(ipa: str) -> bool:
    """Return whether a phoneme without marks begins with a vowel."""
    return ipa[:1] in vowels()


def _difference(a: str, b: str) -> float:
    if a == b:
        return 0.0
    if not a or not b:
        return UNLIKE
    return ALIKE if is_vowel(a) == is_vowel(b) else UNLIKE
