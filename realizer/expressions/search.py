"""Search of expressions by words or action units, best match first."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping

import numpy as np

from realizer.expressions.expression import Expression
from realizer.tables import by_number

# Weight of a matching word, by where it is found.
NAMED, MEANT, SEEN, NEARLY = 3.0, 2.0, 1.0, 0.5
LITTLE = frozenset(
    [
        "a",
        "about",
        "am",
        "an",
        "and",
        "are",
        "at",
        "be",
        "do",
        "don",
        "i",
        "in",
        "is",
        "it",
        "me",
        "my",
        "not",
        "of",
        "on",
        "or",
        "s",
        "so",
        "t",
        "that",
        "the",
        "this",
        "to",
        "very",
        "was",
        "with",
        "you",
    ]
)
# Endings, the longest first, that a word may lose without meaning another thing.
ENDINGS = (
    "liness",
    "fully",
    "ingly",
    "iness",
    "ness",
    "ment",
    "ings",
    "tion",
    "sion",
    "ance",
    "able",
    "ful",
    "ing",
    "ied",
    "ies",
    "ily",
    "est",
    "ial",
    "ed",
    "er",
    "es",
    "al",
    "ly",
    "y",
    "e",
    "s",
)
LEAST = 3  # letters of a stem


def by_meaning(text: str, expressions: Iterable[Expression]) -> list[tuple[Expression, float]]:
    """Return expressions that share words with a text, in name, meaning or features, by number of words.

    Returns:
        (expression, score): 1 where every word of the text is in its name; sorted, none with 0.
    """
    asked = [word for word in _words(text) if word not in LITTLE] or _words(text)
    found = []
    for one in expressions:
        name, means, features = (
            {stem(word) for word in _words(part)} - LITTLE
            for part in (one.name, " ".join(one.means), one.features)
        )
        score = 0.0
        for word in asked:
            root = stem(word)
            places = [
                weight for weight, where in ((NAMED, name), (MEANT, means), (SEEN, features)) if root in where
            ]
            if places:
                # A word in several places says a little more than in the best of them alone.
                score += max(places) + 0.1 * (len(places) - 1)
            elif difflib.get_close_matches(root, name | means, n=1, cutoff=0.85):
                score += NEARLY
        if score:
            found.append((one, min(score / (NAMED * len(asked)), 1.0)))
    return sorted(found, key=lambda pair: -pair[1])


def by_action_units(
    asked: Mapping[tuple[int, str], float], expressions: Iterable[Expression]
) -> list[tuple[Expression, float]]:
    """Return expressions that share action units with the request, by cosine, with sides apart.

    Args:
        asked: (AU, side LEFT | RIGHT | BOTH) -> intensity.

    Returns:
        (expression, cosine 0..1), the best first, without those of cosine 0.
    """
    wanted = _vector(asked)
    found = []
    for one in expressions:
        shown = _vector(one.aus)
        common = sum(value * shown.get(unit, 0.0) for unit, value in wanted.items())
        if common:
            sizes = np.linalg.norm(list(wanted.values())) * np.linalg.norm(list(shown.values()))
            found.append((one, float(common / sizes)))
    return sorted(found, key=lambda pair: -pair[1])


def stem(word: str) -> str:
    """A word without its ending: "surprised", "surprising" and "surprise" have one stem."""
    for ending in ENDINGS:
        if word.endswith(ending) and len(word) - len(ending) >= LEAST:
            word = word.removesuffix(ending)
            break
    return word[:-1] if len(word) > LEAST and word[-1] == word[-2] else word.replace("i", "y")


def _words(text: str) -> list[str]:
    return re.findall(r"[^\W\d_]+", text.lower().replace("_", " "))


def _vector(aus: Mapping[tuple[int, str], float]) -> dict[tuple[int, str], float]:
    """(AU, L | R | "") -> intensity; a unit without sides has one place."""
    sided = by_number()
    vector: dict[tuple[int, str], float] = {}
    for (au, side), value in aus.items():
        letters = ("L", "R") if side == "BOTH" else (side[0],)
        for letter in letters if sided[au].sides else ("",):
            vector[au, letter] = max(value, vector.get((au, letter), 0.0))
    return vector
