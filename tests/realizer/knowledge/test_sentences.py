"""Tests of `realizer.knowledge.sentences`."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.knowledge.sentences import sentences


def test_sentences_end_with_their_marks() -> None:
    found = sentences("Is it 3.5 metres? Yes, it is! Mind the step\n\nbelow")
    assert [[word.text for word in one.words] for one in found] == [
        ["Is", "it", "3.5", "metres"],
        ["Yes", "it", "is"],
        ["Mind", "the", "step"],
        ["below"],
    ]
    assert [(one.question, one.exclamation) for one in found] == [(True, False), (False, True)] + [
        (False,) * 2
    ] * 2


@pytest.mark.parametrize("text", ["真的吗？", "هل أنت بخير؟", "“Really?” she said", "Really?!"])
def test_sentences_know_questions_of_other_scripts_and_in_quotes(text: str) -> None:
    assert sentences(text)[0].question


def test_sentences_have_words_of_one_unit_per_vowel() -> None:
    (one,) = sentences("banana, cat")
    assert [[word.start, word.end] for word in one.words] == [
        pytest.approx([0.0, 0.6]),
        pytest.approx([0.8, 1.0]),
    ]


@pytest.mark.parametrize("text", ["", "   ", "?!", "… — …"])
def test_sentences_of_a_text_without_words_are_none(text: str) -> None:
    assert sentences(text) == ()


@given(st.text(max_size=80))
def test_sentences_have_words_in_order_at_rising_times(text: str) -> None:
    words = [word for one in sentences(text) for word in one.words]
    assert all(text[word.place :].startswith(word.text) for word in words)
    assert all(a.end <= b.start + 1e-9 and a.place < b.place for a, b in pairwise(words))


def test_sentences_end_at_emoji() -> None:
    one, other = sentences("Really?😱 No 😀!")
    assert [word.text for word in one.words] == ["Really"]
    assert one.question
    assert [word.text for word in other.words] == ["No"]
    assert other.exclamation
    assert sentences("😱!") == ()


def test_sentences_in_greek_ask_with_a_semicolon() -> None:
    text = "Είσαι σίγουρος; Ναι."
    assert [one.question for one in sentences(text, "el-GR")] == [True, False]
    assert not sentences(text)[0].question
