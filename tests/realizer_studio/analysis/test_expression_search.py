"""Tests of `realizer_studio.analysis.expression_search`."""

import pytest

from realizer.expressions.library import builtin
from realizer_studio.analysis.expression_search import by_action_units, by_meaning, stem
from tests.rows import each_row


def names(found) -> list[str]:
    return [one.name for one, _ in found]


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("surprise", "SURPRISE"),
        ("surprised!", "template:surprise"),
        ("sorry about that", "template:regret"),
        ("I don't know", "template:sadness"),
        ("furious", "ANGER"),
        ("angry", "ANGER"),
        ("happy", "HAPPINESS"),
        ("I am so happy", "template:happiness"),
        ("scared", "FEAR"),
        ("sarcasm", "template:ironic smile"),
        ("a friendly greeting", "SMILE"),
        ("nose", "template:disgust"),
        ("smiel", "SMILE"),
    ],
)
def test_by_meaning_finds_an_expression_by_its_meanings(text: str, meant: str) -> None:
    found = by_meaning(text, builtin().values())
    best = [one.name for one, score in found if score == found[0][1]]
    assert meant in best


def test_by_meaning_prefers_more_words_and_better_places() -> None:
    found = by_meaning("raised left brow", builtin().values())
    assert names(found)[0] == "RAISE_LEFT_BROW"
    scores = [score for _, score in found]
    assert scores == sorted(scores, reverse=True)
    assert all(0 < score <= 1 for score in scores)


def test_by_meaning_of_unknown_words_is_empty() -> None:
    assert by_meaning("qqqq", builtin().values()) == []
    assert by_meaning("...", builtin().values()) == []


@each_row("one", builtin().values())
def test_by_action_units_finds_an_expression_by_its_own_units(one) -> None:
    (_, best), *_ = found = by_action_units(one.aus, builtin().values())
    assert best == pytest.approx(1)
    assert one.name in {other.name for other, score in found if score == pytest.approx(1)}


def test_by_action_units_considers_sides_and_intensities() -> None:
    left = {(1, "LEFT"): 1.0, (2, "LEFT"): 1.0}
    found = names(by_action_units(left, builtin().values()))
    assert found[0] == "RAISE_LEFT_BROW"
    assert "RAISE_RIGHT_BROW" not in found
    assert names(by_action_units({(9, "BOTH"): 1.0}, builtin().values())) == ["template:disgust", "DISGUST"]
    assert by_action_units({(28, "BOTH"): 1.0}, builtin().values()) == []


def test_stem_ignores_endings() -> None:
    assert len({stem(word) for word in ("surprise", "surprised", "surprising", "surprises")}) == 1
    assert stem("worried") == stem("worry") == stem("worries")
    assert stem("happiness") == stem("happy") == stem("happily")
    assert stem("friendliness") == stem("friendly")
    assert stem("nod") == "nod"
