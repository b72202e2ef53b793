"""Tests of `realizer.knowledge.word_languages`."""

import pytest

from bml_schema import Speech, parse
from realizer.knowledge.word_languages import ENGLISH, Words, language_of
from realizer.tables.emotional_words import read_words

OWN = read_words(
    "# source: own\n# units: none\n# licence: MIT\nword,category,origin\nonzin,disapproval,own\n", "nl"
)


def language(block: str = "", speech: str = "", text: str = "", ssml: str = "", priority: int = 1) -> str:
    def named(tag: str) -> str:
        return f' xml:lang="{tag}"' if tag else ""

    spoken = f"<speak{named(ssml)}>x</speak>" if ssml else ""
    inside = f'<description priority="{priority}" type="application/ssml+xml">{spoken}</description>'
    document = parse(
        f'<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="b"{named(block)}>'
        f'<speech id="s"{named(speech)}><text{named(text)}>x</text>{inside if ssml else ""}</speech></bml>'
    )
    node = document["s"]
    assert isinstance(node, Speech)
    return language_of(node, document, "en-US")


def test_language_of_is_that_of_the_nearest_element() -> None:
    assert language() == "en-US"
    assert language(block="nl") == "nl"
    assert language(block="nl", speech="de") == "de"
    assert language(block="nl", speech="de", text="fr") == "fr"
    assert language(block="nl", speech="de", text="fr", ssml="pl") == "pl"


def test_language_of_ignores_a_description_that_is_not_spoken() -> None:
    assert language(text="fr", ssml="pl", priority=-1) == "fr"
    assert language(text="fr", ssml="pl", priority=0) == "pl"


@pytest.mark.parametrize("tag", ["en", "en-GB", "EN", "en_US"])
def test_words_of_english_count_in_every_country(tag: str) -> None:
    words = ENGLISH.of(tag)
    assert words is not None
    assert words.categories(["nonsense"]) == ["disapproval"]


@pytest.mark.parametrize("tag", ["nl", "de-AT", "eng", "../en", "", "\0"])
def test_words_of_english_do_not_count_in_other_languages(tag: str) -> None:
    assert ENGLISH.of(tag) is None


def test_words_of_a_user_are_for_one_language_or_for_all() -> None:
    dutch = Words("nl-BE", OWN, everywhere=False)
    assert dutch.of("nl") is OWN
    assert dutch.of("fr") is None
    assert dutch.of("en") is ENGLISH.of("en")
    assert Words("en", OWN).of("fr") is OWN
