"""The language of each text, and the emotional words that apply to it."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass

from bml_schema import Block, Speech
from realizer.tables.emotional_words import WordList, word_list

SSML = "application/ssml+xml"
LANG = "{http://www.w3.org/XML/1998/namespace}lang"


@dataclass(frozen=True)
class Words:
    """Which words count in which language.

    Attributes:
        language: BCP-47 of a text that names none.
        own: a user's list, before the built-in ones; None if there is none.
        everywhere: whether that list is for all texts, because no language was requested; if not, for
            those in `language`.
    """

    language: str = "en"
    own: WordList | None = None
    everywhere: bool = True

    def of(self, language: str) -> WordList | None:
        """Return the words of a language ("en-GB" is "en"), or None, so that no word counts."""
        if self.own is not None and (self.everywhere or _same(language, self.language)):
            return self.own
        return word_list(language)


ENGLISH = Words()


def language_of(speech: Speech, block: Block, usual: str) -> str:
    """BCP-47, as xml:lang says: the first of its SSML, its text, the speech and the block; or `usual`."""
    return next(filter(None, _named(speech, block)), usual)


def _named(speech: Speech, block: Block) -> Iterator[str | None]:
    for description in sorted(speech.descriptions, key=lambda one: -one.priority):
        if description.type == SSML and description.priority >= 0:
            yield _of_ssml(description.content)
    if speech.text is not None:
        yield speech.text.language
    yield speech.unknown_attributes.get(LANG)
    yield block.unknown_attributes.get(LANG)


def _of_ssml(content: str) -> str | None:
    # The content comes from the parser, which rejects DTDs and entities.
    try:
        return ElementTree.fromstring(content).get(LANG)
    except ElementTree.ParseError:
        return None


def _same(one: str, other: str) -> bool:
    """Return whether two tags are of one language, whatever their country."""
    first, second = (tag.replace("_", "-").partition("-")[0].lower() for tag in (one, other))
    return first == second
