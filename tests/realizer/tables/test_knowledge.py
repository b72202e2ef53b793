"""Tests of `realizer.tables.knowledge`."""

from dataclasses import replace
from pathlib import Path
from typing import get_args

import pytest

from realizer.core.errors import TableError
from realizer.tables.emotional_words import CATEGORIES
from realizer.tables.knowledge import By, knowledge, read_knowledge
from realizer.tables.templates import templates

HEAD = "# source: test\n# units: s\n# licence: MIT\n"


def test_knowledge_names_the_source_of_every_rule() -> None:
    rules = [*knowledge().companies, *(rule for rules in knowledge().placings.values() for rule in rules)]
    assert all("Wojdel 6." in rule.says for rule in rules)


def test_knowledge_uses_only_templates() -> None:
    shown = {name for rules in knowledge().placings.values() for rule in rules for name in rule.show}
    shown |= {name for company in knowledge().companies for name in (company.of, company.other)}
    assert {name.upper() for name in shown | knowledge().apart.keys()} <= set(templates())
    assert all(name.islower() for name in shown | knowledge().apart.keys())


def test_knowledge_places_expressions_at_known_sentences_and_words() -> None:
    rules = [rule for rules in knowledge().placings.values() for rule in rules]
    known = {"question", "exclamation", *CATEGORIES}
    assert {category for rule in rules for category in (rule.when, *rule.unless, *rule.beside)} <= known
    assert {company.by for company in knowledge().companies} <= set(get_args(By))


def test_knowledge_has_the_four_expressions_of_listeners() -> None:
    offered = {name for rule in knowledge().placings["listener"] for name in rule.show}
    assert offered == {"sadness", "regret", "disbelief", "astonishment"}


def test_knowledge_has_moods_of_different_distance_and_length() -> None:
    depressed, confused = knowledge().mood("Depressed"), knowledge().mood("confused")
    assert depressed.distance > confused.distance
    assert depressed.length > 1.5 > 1.0 > confused.length


def test_knowledge_has_the_mean_length_of_table_6_3() -> None:
    segments = [9, 106, 6, 5, 8, 40, 66, 22, 20, 2, 2, 1]
    frames = [165, 2712, 153, 185, 362, 1197, 1914, 480, 832, 58, 23, 15]
    mean = sum(frames) / sum(segments)
    assert mean == pytest.approx(28.2, abs=0.05)
    assert knowledge().mood("sorrow").length == pytest.approx(47.6 / mean, rel=2e-3)


def test_mood_suggests_names_for_an_unknown_one() -> None:
    with pytest.raises(KeyError, match="wanted a word such as happy, happiness; got 'happi'"):
        knowledge().mood("happi")


def test_mood_says_that_there_are_none() -> None:
    with pytest.raises(KeyError, match="wanted none, as this knowledge has no moods; got 'happy'"):
        replace(knowledge(), moods={}).mood("happy")


@pytest.mark.parametrize(
    "text", ["", "[mood]\nmean = 1\n", HEAD + "[pace]\nspeaker = 1\n", HEAD + "speaker = 3\n"]
)
def test_read_knowledge_names_a_damaged_file(tmp_path: Path, text: str) -> None:
    path = tmp_path / "knowledge.toml"
    path.write_text(text)
    with pytest.raises(TableError, match=r"knowledge\.toml: wanted"):
        read_knowledge(path)


def test_read_knowledge_needs_only_pace_and_moods(tmp_path: Path) -> None:
    path = tmp_path / "knowledge.toml"
    path.write_text(
        HEAD + "[pace]\nspeaker = 2\nlistener = 4\n[mood]\nmean = 20\nglum = {distance = 3, frames = 30}\n"
    )
    found = read_knowledge(path)
    assert (found.usual_distance, found.mood("glum").length, found.placings["speaker"]) == (2, 1.5, ())
