"""The knowledge base is read whole, and names only what there is."""

from __future__ import annotations

import pytest

from realizer.tables.knowledge import knowledge
from realizer.tables.templates import templates


def test_every_rule_says_where_it_comes_from() -> None:
    rules = [*knowledge().companies, *(rule for rules in knowledge().placings.values() for rule in rules)]
    assert all("Wojdel 6." in rule.says for rule in rules)


def test_every_expression_of_a_rule_is_a_template() -> None:
    shown = {name for rules in knowledge().placings.values() for rule in rules for name in rule.show}
    shown |= {name for company in knowledge().companies for name in (company.of, company.other)}
    assert {name.upper() for name in shown} <= set(templates())


def test_a_listener_is_offered_the_four_expressions_of_the_book() -> None:
    offered = {name for rule in knowledge().placings["listener"] for name in rule.show}
    assert offered == {"sadness", "regret", "disbelief", "astonishment"}


def test_the_depressed_show_few_expressions_for_long_and_the_confused_many_for_short() -> None:
    depressed, confused = knowledge().mood("Depressed"), knowledge().mood("confused")
    assert depressed.distance > confused.distance
    assert depressed.length > 1.5 > 1.0 > confused.length


def test_an_unknown_mood_names_those_that_are_near() -> None:
    with pytest.raises(KeyError, match="wanted a word such as happy, happiness; got 'happi'"):
        knowledge().mood("happi")
