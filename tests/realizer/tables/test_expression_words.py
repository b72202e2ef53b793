"""Tests of `realizer.tables.expression_words`."""

from __future__ import annotations

from realizer.tables.expression_words import ExpressionWords, expression_words


def test_expression_words_are_separated_by_semicolons() -> None:
    assert ExpressionWords("x", "", "glad; in good spirits ;").words == ("glad", "in good spirits")


def test_expression_words_exist_for_every_expression() -> None:
    rows = expression_words()
    assert len(rows) > 6
    assert all(row.name == name and row.words for name, row in rows.items())
