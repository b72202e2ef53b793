"""Tests of <speak> documents."""

import pytest

from bml_schema import Block, BMLError, Speech, Sync, parse, read
from tests.rows import each_row

PROLOG = """<?xml version="1.0"?>
<!-- a letter -->
<!DOCTYPE speak PUBLIC "-//W3C//DTD SYNTHESIS 1.0//EN" "http://www.w3.org/TR/speech-synthesis/synthesis.dtd">
"""


def speech_of(block: Block) -> Speech:
    (speech,) = block.behaviours
    assert isinstance(speech, Speech)
    return speech


@each_row(
    "prolog, start, end",
    [
        ("", "<speak>", "</speak>"),
        (PROLOG, '<speak version="1.1" xmlns="http://www.w3.org/2001/10/synthesis">', "</speak>"),
        ("\ufeff \n", '<x:speak xmlns:x="http://www.w3.org/2001/10/synthesis">', "</x:speak>"),
    ],
)
def test_a_speak_document_is_a_block_that_speaks(prolog: str, start: str, end: str) -> None:
    text = f'{prolog}{start}Dear <sync id="m"/>friend{end}'
    for document in (text, text.encode()):
        block = parse(document)
        assert not block.problems
        assert block.composition == "APPEND"
        assert speech_of(block).text is not None
        assert speech_of(block).text.parts == ("Dear ", Sync(id="m"), "friend")


def test_speak_documents_have_their_language_and_ids_of_their_own() -> None:
    document = '<speak xml:lang="nl"><p>Dag</p></speak>'
    ids = iter(["one", "two"])
    blocks = [block for _ in range(2) for block in read(document, block_ids=ids)]
    assert [block.id for block in blocks if isinstance(block, Block)] == ["one", "two"]
    assert isinstance(blocks[0], Block)
    assert speech_of(blocks[0]).text.language == "nl"


@each_row(
    "document, words",
    [
        ("<speak>Hello <emphasis>my friend</speak>", "Hello my friend"),
        ("<speak>Hello <b>my</speak> friend", "Hello my"),
        ("<speak>Tom & Jerry, 5 < 6, <3</speak>", "Tom & Jerry, 5 < 6, <3"),
        ("<speak>Hello", "Hello"),
        ("<speak>Hello <break time=1s/> you</speak>", "Hello"),
    ],
)
def test_a_broken_speak_document_is_spoken_as_far_as_it_can_be_read(document: str, words: str) -> None:
    block = parse(document)
    assert str(speech_of(block).text).startswith(words)
    assert "not well-formed" in block.problems[0].text


def test_a_speak_document_is_no_strict_bml() -> None:
    with pytest.raises(BMLError, match="wanted <bml>"):
        parse("<speak>Hello</speak>", strict_bml=True)
