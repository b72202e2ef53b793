"""Tests of numbers in words: at least 80 rows for English, 20 for each other language."""

from pathlib import Path

from realizer.core.toml_text import parse_toml
from realizer.text import numbers
from realizer.text.numbers import complete, language_of, numbers_in_words, roman
from tests.rows import each_row

# Read by the tests of the JavaScript client too.
ROWS = [
    (language, *row)
    for language, rows in parse_toml(Path(__file__).with_name("numbers.toml").read_text("utf-8")).items()
    for row in rows["rows"]
]


@each_row("language, text, words", ROWS)
def test_numbers_are_what_people_say(language: str, text: str, words: str) -> None:
    assert numbers_in_words(text, language) == words


@each_row("language", ["en", "de", "fr", "es", "nl"])
def test_no_frame_is_passed_over_that_is_found(language: str) -> None:
    found = 0
    for _, text, _ in ROWS:
        possible = numbers._possible(language, numbers._signs(text, language))
        for is_possible, frame in zip(possible, numbers._frames(language), strict=True):
            if frame.pattern.search(text):
                found += 1
                assert is_possible, (frame, text)
                assert frame.is_in(text, numbers._beginnings(text)), (frame, text)
    assert found > 100


def test_each_language_has_enough_rows() -> None:
    counts = {
        language: sum(row[0] == language for row in ROWS) for language in ("en", "de", "fr", "es", "nl")
    }
    assert counts["en"] >= 80
    assert min(counts.values()) >= 20


@each_row("tag, language", [("en-GB", "en"), ("DE_at", "de"), ("pl", None), ("shared", None), ("", None)])
def test_language_of_a_tag_is_its_first_part(tag: str, language: str | None) -> None:
    assert language_of(tag) == language


def test_numbers_of_other_languages_are_left_to_the_voice() -> None:
    assert numbers_in_words("5 km za 12,50 zł", "pl") == "5 km za 12,50 zł"


def test_words_before_a_text_decide() -> None:
    assert numbers_in_words("II.", "en", "In World War ") == "two."
    assert numbers_in_words("I am", "en", "After all ") == "I am"


@each_row(
    "text, length",
    [
        ("So it ", 6),
        ("It costs 5 ", 9),
        ("5 million US dollars more ", 0),
        ("It was 5. ", 10),
        ("On May ", 3),
    ],
)
def test_complete_ends_before_a_number_that_may_go_on(text: str, length: int) -> None:
    assert complete(text, "en") == length


@each_row("text, value", [("IV", 4), ("XIV", 14), ("XLIX", 49), ("LVIII", 58)])
def test_roman_numbers_have_values(text: str, value: int) -> None:
    assert roman(text) == value
