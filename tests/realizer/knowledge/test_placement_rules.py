"""Tests of `realizer.knowledge.placement_rules`."""

import pytest

from realizer.knowledge.placement_rules import place_expressions
from realizer.knowledge.sentences import sentences
from realizer.tables.emotional_words import word_list
from realizer.tables.knowledge import Role, knowledge


def placed(text: str, role: Role = "speaker", mood: str = "") -> list[tuple[str, tuple[str, ...]]]:
    known = knowledge()
    found = place_expressions(
        sentences(text), known, role, known.mood(mood) if mood else None, word_list("en")
    )
    return [(one.word.text, one.rule.show) for one in found]


@pytest.mark.parametrize(
    ("text", "shows"),
    [
        ("Do you come home today?", [("today", ("surprise",))]),
        ("Go away!", [("away", ("anger",))]),
        ("What a beautiful day!", [("beautiful", ("happiness",))]),
        ("I am happy for you.", [("happy", ("happiness",))]),
        ("That is not good.", []),
        ("This makes me furious.", [("furious", ("anger",))]),
        ("That is nonsense.", [("nonsense", ("anger",))]),
        ("They saw a horrible accident.", [("horrible", ("surprise", "grief"))]),
        ("Yes.", [("Yes", ("surprise",))]),
        ("I understand that.", [("I", ("surprise",))]),
        ("They are fascinating.", []),
        ("I am so sorry.", []),
        ("Nonsense!", [("Nonsense", ("anger",))]),
        ("Really?!", [("Really", ("surprise",))]),
    ],
)
def test_place_expressions_of_a_speaker(text: str, shows: list[tuple[str, tuple[str, ...]]]) -> None:
    assert placed(text) == shows


@pytest.mark.parametrize("text", ["Do not be afraid.", "I am not so very angry.", "That isn’t nonsense."])
def test_place_expressions_considers_negations(text: str) -> None:
    assert placed(text) == []


@pytest.mark.parametrize(
    ("text", "shows"),
    [
        ("Do you know it?", "sadness"),
        ("My dog is sick.", "regret"),
        ("That is nonsense.", "disbelief"),
        ("It was horrible.", "astonishment"),
        ("I won the race!", "astonishment"),
    ],
)
def test_place_expressions_of_a_listener(text: str, shows: str) -> None:
    assert [show for _, (show,) in placed(text, "listener")] == [shows]


def test_place_expressions_of_a_listener_are_fewer() -> None:
    text = "Are you here? It was horrible. " * 10
    assert 0 < len(placed(text, "listener")) < len(placed(text)) / 3


def test_place_expressions_in_a_mood_keeps_a_distance() -> None:
    text = "He lives on this island. Really? " * 4
    assert len(placed(text)) == 4
    assert len(placed(text, mood="confused")) > len(placed(text, mood="depressed")) > 0


def test_place_expressions_keeps_rules_with_keep_in_any_mood() -> None:
    text = "Nonsense, nonsense I say. Are you mad?"
    assert [word for word, _ in placed(text, mood="disorientation")] == ["Nonsense"]
    assert [word for word, _ in placed("Rubbish. Nonsense.", mood="disorientation")] == [
        "Rubbish",
        "Nonsense",
    ]


def test_place_expressions_without_words_uses_punctuation() -> None:
    found = place_expressions(sentences("Nonsense. Czy to ty?"), knowledge(), words=None)
    assert [(one.word.text, one.rule.when) for one in found] == [("ty", "question")]
