"""The SSML for espeak-ng, and the places of words in it."""

from realizer.speech.espeak.document import write_document
from realizer.speech.ssml import read_script
from realizer.speech.utterance import SpeechRequest


def test_document_has_attributes_in_double_quotes() -> None:
    text = write_document(read_script(SpeechRequest("<sub alias='say \"this\" &amp; that'>x</sub>"))).text
    assert text == '<speak><sub alias="say  this  &amp; that">x</sub></speak>'


def test_document_places_count_characters_of_the_text() -> None:
    document = write_document(read_script(SpeechRequest('a &amp; b <mark name="z"/>c')))
    assert [(word, document.text[place - 1 :][: len(word)]) for word, place in document.words] == [
        ("a", "a"),
        ("&", "&"),
        ("b", "b"),
        ("c", "c"),
    ]
