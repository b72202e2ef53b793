"""The rules that place expressions in sentences (Wojdel 2005, 6.5)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from realizer.knowledge.sentences import Sentence, SpokenWord
from realizer.tables.emotional_words import WordList
from realizer.tables.knowledge import Knowledge, Mood, PlacementRule, Role

# A negation applies to a word at most so many words after it: "not so very bad".
REACH = 3
# Categories that a negation inverts: "do not be afraid" shows no fear.
TURNED = ("sorrow", "fright", "irritation", "disapproval", "approval", "assent")


@dataclass(frozen=True, slots=True)
class Placement:
    """A placement by one rule.

    Attributes:
        rule: the rule.
        word: the index of its first word.
    """

    rule: PlacementRule
    word: SpokenWord


def place_expressions(
    text: Sequence[Sentence],
    knowledge: Knowledge,
    role: Role = "speaker",
    mood: Mood | None = None,
    words: WordList | None = None,
) -> tuple[Placement, ...]:
    """Return the placements of expressions, in the order of the text.

    At one place the most important rule wins. A mood or a listener keeps expressions apart: of two
    that are too near, the less important one is dropped, except if its rule says that it stays.

    Args:
        words: the categories of words; None: only punctuation counts.
    """
    rules = knowledge.placings[role]
    asked = [placement for sentence in text for placement in _asked(sentence, rules, words)]
    apart = mood.distance if mood is not None else 0.0
    if role == "listener":
        usual = knowledge.listener_distance
        apart = usual if mood is None else usual * mood.distance / knowledge.usual_distance
    kept: list[Placement] = []
    for placement in sorted(asked, key=lambda one: (rules.index(one.rule), one.word.start)):
        near = apart > 0 and any(abs(placement.word.start - other.word.start) < apart for other in kept)
        if placement.rule.keep or not near:
            kept.append(placement)
    return tuple(sorted(kept, key=lambda one: one.word.place))


def _asked(sentence: Sentence, rules: Sequence[PlacementRule], words: WordList | None) -> Iterator[Placement]:
    """Yield the placements of one sentence; the first rule for a place wins."""
    categories = _categories(sentence, words)
    taken: set[int] = set()
    for rule in rules:
        if set(rule.unless) & set(categories):
            continue
        for index in _places(rule, sentence, categories):
            if index not in taken:
                taken.add(index)
                yield Placement(rule, sentence.words[index])


def _places(rule: PlacementRule, sentence: Sentence, categories: Sequence[str]) -> list[int]:
    """Indices of the words at which a rule asks for something."""
    if rule.when in ("question", "exclamation"):
        return [len(sentence.words) - 1] if getattr(sentence, rule.when) else []
    before = ["", *categories]
    return [i for i, category in enumerate(categories) if category == rule.when and before[i] != category]


def _categories(sentence: Sentence, words: WordList | None) -> list[str]:
    """The category of each word; "" where a negation before it turns it around."""
    if words is None:
        return [""] * len(sentence.words)
    found = words.categories([word.text for word in sentence.words])
    turned = list(found)
    for i, category in enumerate(found):
        if category in TURNED and "negation" in found[max(0, i - REACH) : i]:
            turned[i] = ""
    return turned
