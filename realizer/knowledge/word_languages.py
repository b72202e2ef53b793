"""The languages of texts and their emotional words."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass

from bml_schema import Block, Speech
from bml_schema.nodes import LANGUAGE, SSML
from realizer.speech.letter_to_sound import subtag
from realizer.tables.emotional_words import WordList, word_list


@dataclass(frozen=True)
class Words:
    """The emotional words of each language."""

    language: str = "en"  # BCP-47 tag of text without xml:lang
    own: WordList | None = None  # a user's list, which overrides the built-in one
    everywhere: bool = True  # whether `own` is for texts in all languages, not only in `language`

    def of(self, language: str) -> WordList | None:
        """Return the words of a language ("en-GB" is "en"), or None if there is no list."""
        if self.own is not None and (self.everywhere or subtag(language) == subtag(self.language)):
            return self.own
        return word_list(language)


ENGLISH = Words()


def language_of(speech: Speech, block: Block, default: str) -> str:
    """Return the first xml:lang of the SSML, the text, the speech and the block, or else `default`."""
    return next(filter(None, _languages(speech, block)), default)


def _languages(speech: Speech, block: Block) -> Iterator[str | None]:
    for description in sorted(speech.descriptions, key=lambda one: -one.priority):
        if description.type == SSML and description.priority >= 0:
            yield _ssml_language(description.content)
    if speech.text is not None:
        yield speech.text.language
    yield speech.unknown_attributes.get(LANGUAGE)
    yield block.unknown_attributes.get(LANGUAGE)


def _ssml_language(content: str) -> str | None:
    # Safe for untrusted content, as our parser has rejected DTDs and entities.
    try:
        return ElementTree.fromstring(content).get(LANGUAGE)
    except ElementTree.ParseError:
        return None
