"""Search of expressions by words or action units, best match first."""

import re
from collections.abc import Iterable, Mapping

import numpy as np

from realizer.core.similar import similar
from realizer.expressions.expression import Expression
from realizer.tables import by_number

# Weights of a word in the name, meanings or features of an expression, and of a similar word.
NAME, MEANING, FEATURE, SIMILAR = 3.0, 2.0, 1.0, 0.5
STOP_WORDS = {
    "a", "about", "am", "an", "and", "are", "at", "be", "do", "don", "i", "in", "is", "it", "me", "my",
    "not", "of", "on", "or", "s", "so", "t", "that", "the", "this", "to", "very", "was", "with", "you",
}  # fmt: skip
# Endings that do not change the meaning of a word, the longest first.
ENDINGS = (
    "liness", "fully", "ingly", "iness", "ness", "ment", "ings", "tion", "sion", "ance", "able", "ful",
    "ing", "ied", "ies", "ily", "est", "ial", "ed", "er", "es", "al", "ly", "y", "e", "s",
)  # fmt: skip
MIN_STEM = 3  # letters


def by_meaning(text: str, expressions: Iterable[Expression]) -> list[tuple[Expression, float]]:
    """Return expressions that share words with a text in their name, meanings or features.

    Returns:
        (expression, score above 0), best first; the score is 1 if the name contains all words of the text.
    """
    query = [word for word in _words(text) if word not in STOP_WORDS] or _words(text)
    matches = []
    for expression in expressions:
        name, means, features = (
            {stem(word) for word in _words(part)} - STOP_WORDS
            for part in (expression.name, " ".join(expression.means), expression.features)
        )
        score = 0.0
        for word in query:
            root = stem(word)
            weights = [
                w for w, stems in ((NAME, name), (MEANING, means), (FEATURE, features)) if root in stems
            ]
            if weights:
                # A word in several places counts slightly more.
                score += max(weights) + 0.1 * (len(weights) - 1)
            elif similar(root, name | means, cutoff=0.85):
                score += SIMILAR
        if score:
            matches.append((expression, min(score / (NAME * len(query)), 1.0)))
    return sorted(matches, key=lambda match: -match[1])


def by_action_units(
    aus: Mapping[tuple[int, str], float], expressions: Iterable[Expression]
) -> list[tuple[Expression, float]]:
    """Return expressions that share action units with a query.

    Args:
        aus: (AU, side LEFT | RIGHT | BOTH) -> intensity.

    Returns:
        (expression, cosine above 0), best first; the two sides of an AU are separate dimensions.
    """
    query = _vector(aus)
    matches = []
    for expression in expressions:
        vector = _vector(expression.aus)
        product = sum(value * vector.get(unit, 0.0) for unit, value in query.items())
        if product:
            norms = np.linalg.norm(list(query.values())) * np.linalg.norm(list(vector.values()))
            matches.append((expression, float(product / norms)))
    return sorted(matches, key=lambda match: -match[1])


def stem(word: str) -> str:
    """Return the stem of a word: "surprised", "surprising" and "surprise" have the same."""
    for ending in ENDINGS:
        if word.endswith(ending) and len(word) - len(ending) >= MIN_STEM:
            word = word.removesuffix(ending)
            break
    return word[:-1] if len(word) > MIN_STEM and word[-1] == word[-2] else word.replace("i", "y")


def _words(text: str) -> list[str]:
    return re.findall(r"[^\W\d_]+", text.lower().replace("_", " "))


def _vector(aus: Mapping[tuple[int, str], float]) -> dict[tuple[int, str], float]:
    """Return (AU, L | R | "") -> intensity."""
    sided = by_number()
    vector: dict[tuple[int, str], float] = {}
    for (au, side), value in aus.items():
        letters = ("L", "R") if side == "BOTH" else (side[0],)
        for letter in letters if sided[au].sides else ("",):
            vector[au, letter] = max(value, vector.get((au, letter), 0.0))
    return vector
