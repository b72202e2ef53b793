"""Tests of `realizer.knowledge.advice`."""

import pytest

import realizer
from bml_schema import Block, Speech, write
from bml_schema.behaviours import SpeechText
from realizer.knowledge.advice import VisibleExpression, advise
from realizer.knowledge.enrich import Enricher, template_of
from realizer.tables.knowledge import Role, knowledge

EMPTY = Block(id="b")


def said(*seen: VisibleExpression, role: Role = "speaker", mood: str = "", block: Block = EMPTY) -> list[str]:
    words = {"s": [(0, 1.0)]}
    return [one.text for one in advise(block, seen, words, role, knowledge().mood(mood) if mood else None)]


def series(count: int, every: float, template: str = "surprise") -> list[VisibleExpression]:
    return [VisibleExpression(f"e{i}", template, i * every, i * every + 0.5) for i in range(count)]


@pytest.mark.parametrize(
    ("lasts", "says"),
    [
        (0.2, ["anger is visible for 0.2 s; it was never observed so short"]),
        (0.4, ["anger is visible for 0.4 s, which is unusually short"]),
        (1.0, []),
        (3.0, ["anger is visible for 3 s, which is unusually long"]),
        (5.0, ["anger is visible for 5 s; it was never observed so long"]),
    ],
)
def test_advise_on_the_duration_of_an_expression(lasts: float, says: list[str]) -> None:
    assert said(VisibleExpression("a", "anger", 1.0, 1.0 + lasts)) == says


def test_advise_considers_the_mood_for_durations() -> None:
    assert said(VisibleExpression("a", "anger", 1.0, 3.5), mood="sad") == []
    assert said(VisibleExpression("a", "anger", 1.0, 3.5), mood="confused") != []
    assert said(VisibleExpression("a", "anger", 1.0, 6.0), mood="sad") != []


@pytest.mark.parametrize("mood", ["sad", "happy", "confused", "irritated", ""])
def test_advise_accepts_what_enrich_places_for_a_mood(mood: str) -> None:
    asked = knowledge().mood(mood) if mood else None
    block = Enricher(mood=asked).text("Nonsense, he said. What a horror! Are you sure? Yes.")
    times = realizer.schedule(write(block)).times
    seen = [
        VisibleExpression(node.id, template, (start + peak) / 2, (relax + end) / 2)
        for node in block.behaviours
        if (template := template_of(node))
        for start, peak, relax, end in [times[node.id].tolist()]
    ]
    assert seen
    assert not [one for one in said(*seen, mood=mood) if "is visible for" in one]


def test_advise_on_sadness_soon_after_another_expression() -> None:
    surprise = VisibleExpression("a", "surprise", 0.0, 0.5)
    assert said(surprise, VisibleExpression("b", "sadness", 1.0, 2.0)) == [
        "sadness begins 0.5 s after surprise (a)"
    ]
    assert said(surprise, VisibleExpression("b", "sadness", 1.6, 2.6)) == []


def test_advise_on_disgust_without_anger() -> None:
    disgust = VisibleExpression("a", "disgust", 1.0, 1.8)
    assert said(disgust) == ["disgust stands alone"]
    assert said(disgust, VisibleExpression("b", "surprise", 1.0, 1.8)) == ["disgust stands alone"]
    assert said(disgust, VisibleExpression("b", "anger", 0.9, 1.9)) == []


def test_advise_on_grief_alone() -> None:
    grief = VisibleExpression("a", "grief", 1.0, 1.5)
    assert said(grief) == ["grief stands alone"]
    assert said(grief, VisibleExpression("b", "anger", 0.9, 1.9)) == []


def test_advise_on_disapproval_without_anger() -> None:
    block = Block(id="b", children=(Speech(id="s", text=SpeechText(parts=("Nonsense.",))),))
    assert said(block=block) == ['"Nonsense" is said without anger']
    assert said(VisibleExpression("a", "anger", 1.0, 1.8), block=block) == []
    assert said(block=block, role="listener") == []


def test_advise_on_unusual_expressions_of_a_listener() -> None:
    assert said(*series(3, 2.0), role="listener") == [
        "a listener with 3 expressions, 1.5 s between two of them on average"
    ]
    assert said(VisibleExpression("a", "anger", 0.0, 1.0), role="listener") == []
    assert said(VisibleExpression("a", "happiness", 0.0, 1.0), role="listener") == [
        "a listener shows happiness"
    ]


def test_advise_on_a_pace_that_is_not_that_of_the_mood() -> None:
    often = "3 expressions, 0.5 s between two of them on average: often for the mood 'depressed'"
    assert said(*series(3, 1.0), mood="depressed") == [often]
    assert said(*series(3, 3.4), mood="depressed") == []
    assert said(*series(3, 20.0), mood="confused") == [
        "3 expressions, 20 s between two of them on average: rarely for the mood 'confused'"
    ]
