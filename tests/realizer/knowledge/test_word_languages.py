"""Each text is in its own language, and only the words of that language count in it."""

from __future__ import annotations

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


def test_the_nearest_element_says_the_language() -> None:
    assert language() == "en-US"
    assert language(block="nl") == "nl"
    assert language(block="nl", speech="de") == "de"
    assert language(block="nl", speech="de", text="fr") == "fr"
    assert language(block="nl", speech="de", text="fr", ssml="pl") == "pl"


def test_a_description_that_is_not_spoken_does_not_say_the_language() -> None:
    assert language(text="fr", ssml="pl", priority=-1) == "fr"


@pytest.mark.parametrize("tag", ["en", "en-GB", "EN", "en_US"])
def test_english_words_count_in_every_kind_of_english(tag: str) -> None:
    words = ENGLISH.of(tag)
    assert words is not None
    assert words.categories(["nonsense"]) == ["disapproval"]


@pytest.mark.parametrize("tag", ["nl", "de-AT", "eng", "../en", "", "\0"])
def test_english_words_do_not_count_in_other_languages(tag: str) -> None:
    assert ENGLISH.of(tag) is None


def test_a_users_list_is_for_the_language_that_was_asked_for_or_for_all() -> None:
    dutch = Words("nl-BE", OWN, everywhere=False)
    assert dutch.of("nl") is OWN
    assert dutch.of("fr") is None
    assert dutch.of("en") is ENGLISH.of("en")
    assert Words("en", OWN).of("fr") is OWN
