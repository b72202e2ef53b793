"""Tests of the search words of expressions."""

from __future__ import annotations

from realizer.tables.expression_words import ExpressionWords, expression_words


def test_the_words_of_an_expression_are_parted_by_semicolons() -> None:
    assert ExpressionWords("x", "", "glad; in good spirits ;").words == ("glad", "in good spirits")


def test_every_expression_is_found_under_its_name_and_has_words() -> None:
    rows = expression_words()
    assert len(rows) > 6
    assert all(row.name == name and row.words for name, row in rows.items())
