"""Tests of numbers in words."""

from hypothesis import given
from hypothesis import strategies as st

from realizer.text.spellout import LARGEST, languages, spelled
from tests.rows import each_row


@each_row(
    "language, kind, number, words",
    [
        ("en", "cardinal", 1_234_005, "one million two hundred and thirty-four thousand and five"),
        ("en", "cardinal", 1005, "one thousand and five"),
        ("en", "ordinal", 105, "one hundred and fifth"),
        ("en", "year", 1905, "nineteen oh-five"),
        ("en", "year", 2009, "two thousand and nine"),
        ("de", "cardinal", 101, "einhunderteins"),
        ("de", "m", 1, "ein"),
        ("de", "year", 1984, "neunzehnhundertvierundachtzig"),
        ("fr", "cardinal", 91, "quatre-vingt-onze"),
        ("fr", "cardinal", 200, "deux cents"),
        ("fr", "f", 21, "vingt et une"),
        ("es", "cardinal", 101, "ciento uno"),
        ("es", "m", 21, "veintiún"),
        ("es", "ordinal", 13, "trece"),
        ("nl", "cardinal", 22, "tweeëntwintig"),
        ("nl", "ordinal", 21, "eenentwintigste"),
    ],
)  # fmt: skip
def test_spelled_is_what_people_write(language: str, kind: str, number: int, words: str) -> None:
    assert spelled(number, language, kind) == words


@given(st.sampled_from(languages()), st.integers(0, LARGEST - 1), st.integers(0, LARGEST - 1))
def test_different_numbers_have_different_words(language: str, one: int, other: int) -> None:
    assert (spelled(one, language) == spelled(other, language)) == (one == other)


@given(
    st.sampled_from(languages()),
    st.integers(0, LARGEST - 1),
    st.sampled_from(["cardinal", "ordinal", "year"]),
)
def test_no_digit_is_left(language: str, number: int, kind: str) -> None:
    assert not any(map(str.isdigit, spelled(number, language, kind)))


def test_numbers_beyond_the_rules_stay_digits() -> None:
    assert spelled(LARGEST, "en") == str(LARGEST)
