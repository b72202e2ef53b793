"""The rules that place expressions in sentences (Wojdel 2005, 6.5)."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from realizer.knowledge.sentences import Sentence, SpokenWord
from realizer.tables.emotional_words import WordList
from realizer.tables.knowledge import Knowledge, Mood, PlacementRule, Role

REACH = 3  # words after a negation to which it applies: "not so very bad"
# Categories that a negation inverts: "do not be afraid" shows no fear.
TURNED = ("sorrow", "fright", "irritation", "disapproval", "approval", "assent")


@dataclass(frozen=True, slots=True)
class Placement:
    """A rule, and the first word of the place where it applies."""

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

    Only the most important rule applies at a place. Expressions of a listener or in a mood have a least
    distance; less important ones are dropped unless their rule has `keep`. Without emotional words, only
    punctuation counts.
    """
    rules = knowledge.placings[role]
    placements = [
        placement
        for sentence in text
        for placement in _applied(sentence, rules, words)
        if not placement.rule.outlasts or sentence is text[-1]
    ]
    apart = mood.distance if mood is not None else 0.0
    if role == "listener":
        usual = knowledge.listener_distance
        apart = usual if mood is None else usual * mood.distance / knowledge.usual_distance
    kept: list[Placement] = []
    for placement in sorted(placements, key=lambda one: (rules.index(one.rule), one.word.start)):
        near = apart > 0 and any(abs(placement.word.start - other.word.start) < apart for other in kept)
        if placement.rule.keep or not near:
            kept.append(placement)
    return tuple(sorted(kept, key=lambda one: one.word.place))


def _applied(
    sentence: Sentence, rules: Sequence[PlacementRule], words: WordList | None
) -> Iterator[Placement]:
    """Yield the placements in one sentence, by the first rule for each place."""
    categories = _categories(sentence, words)
    taken: set[int] = set()
    for rule in rules:
        if set(rule.unless) & set(categories) or len(sentence.words) > rule.most_words:
            continue
        if rule.beside and not set(rule.beside) & set(categories):
            continue
        for index in _places(rule, sentence, categories):
            if index not in taken:
                taken.add(index)
                yield Placement(rule, sentence.words[index])


def _places(rule: PlacementRule, sentence: Sentence, categories: Sequence[str]) -> list[int]:
    """Return the indices of the words where a rule applies."""
    if rule.when in ("question", "exclamation"):
        return [len(sentence.words) - 1] if getattr(sentence, rule.when) else []
    before = ["", *categories]
    return [i for i, category in enumerate(categories) if category == rule.when and before[i] != category]


def _categories(sentence: Sentence, words: WordList | None) -> list[str]:
    """Return the category of each word; "" after a negation that inverts it."""
    if words is None:
        return [""] * len(sentence.words)
    found = words.categories([word.text for word in sentence.words])
    turned = list(found)
    for i, category in enumerate(found):
        if category in TURNED and "negation" in found[max(0, i - REACH) : i]:
            turned[i] = ""
    return turned
