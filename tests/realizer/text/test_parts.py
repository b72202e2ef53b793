"""Tests of parts of a text."""

from realizer.text.parts import TAG, Tag, markup, tidy
from tests.rows import each_row

NOD = Tag('<head lexeme="NOD"/>', shows=True)


@each_row(
    "text, is_tag",
    [("<b>", True), ("<a x='1' y=2/>", True), ("<x:y/>", True), ("<b and c>", False), ("<3>", False)],
)
def test_tags_have_attributes_with_values(text: str, is_tag: bool) -> None:
    assert bool(TAG.fullmatch(text)) is is_tag


def test_tidy_has_single_blanks_and_none_before_punctuation() -> None:
    assert tidy(["  a ", NOD, "  b ", NOD, " . c\n\n\nd  "]) == ["a ", NOD, "b", NOD, ". c\n\nd"]


def test_markup_escapes_words_only() -> None:
    assert markup(["a < b & c ", NOD]) == 'a &lt; b &amp; c <head lexeme="NOD"/>'
