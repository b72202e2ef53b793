"""One streaming speech: its chunks and their states."""

from __future__ import annotations

import pytest

from bml_schema import AudioFile, Speech, write
from realizer.server.speech.speech_stream import SpeechStream
from realizer.spoken_block import Chunk
from realizer.text.stream import TextStream


def turn(text: str = "", *, close: bool = False) -> SpeechStream:
    made = SpeechStream("turn", 1, "MERGE", Chunk("turn", 0, "bob", "en-US"))
    made.add(text, None)
    if close:
        made.close()
    return made


def test_own_block_waits_for_its_anticipator() -> None:
    speech = turn("One. Two.")
    block = speech.own_block()
    assert (block.id, block.composition, block.character_id) == ("turn", "MERGE", "bob")
    assert f"anticipators:{speech.anticipator}:end" in write(block)
    assert speech.is_announced
    assert speech.open_chunks == []  # it is no piece


def test_next_chunk_numbers_blocks() -> None:
    speech = turn("One. Two. ")
    assert [speech.next_chunk().id, speech.next_chunk().id] == ["turn.1", "turn.2"]
    assert (speech.unplanned, speech.scheduled) == (["turn.1", "turn.2"], [])
    speech.on_planned("turn.1")
    assert (speech.unplanned, speech.scheduled, speech.open_chunks) == (
        ["turn.2"],
        ["turn.1"],
        ["turn.1", "turn.2"],
    )
    speech.on_done("turn.2")  # it was refused
    speech.on_planned("turn.2")
    assert speech.open_chunks == ["turn.1"]
    speech.on_done("turn.1")
    assert speech.open_chunks == []


def test_add_holds_back_an_incomplete_sentence() -> None:
    speech = turn("One. And tw")
    assert speech.unspoken_length == len("One.")
    speech.add("o", None)
    assert speech.unspoken_length == len("One.")
    speech.close()
    assert speech.unspoken_length == len("One. And two")


def test_add_ends_the_text_before_a_clip() -> None:
    speech = turn()
    speech.add("Listen", "c1")
    assert speech.unspoken_length == len("Listen")
    first, second = speech.next_chunk(), speech.next_chunk()
    assert "Listen" in write(first)
    (said,) = (node for node in second.behaviours if isinstance(node, Speech))
    assert AudioFile.tag.rpartition("}")[2] in said.descriptions[0].content
    assert "clip:c1" in said.descriptions[0].content


@pytest.mark.parametrize(
    ("text", "close", "part"),
    [("One, ", False, True), ("One. ", False, False), ("One", True, False)],
)
def test_next_chunk_marks_parts_of_a_sentence(text: str, close: bool, part: bool) -> None:
    speech = turn(f"{text}{'two and three, ' * 20 if part else ''}", close=close)
    assert (speech.next_chunk().id in speech.partial_chunks) is part


def test_awaits_sync_until_its_chunk_is_planned() -> None:
    speech = turn('See <sync id="m"/>this. ')
    assert speech.awaits_sync("m")
    speech.next_chunk()
    assert speech.marks == {"m": "turn.1"}
    assert speech.awaits_sync("m")
    speech.on_planned("turn.1")
    assert not speech.awaits_sync("m")
    assert speech.awaits_sync("never")
    speech.close()
    assert not speech.awaits_sync("never")


def test_next_chunk_knows_the_syncs_of_earlier_chunks() -> None:
    speech = turn('See <sync id="m"/>this. Nod <head lexeme="NOD" start="turn:m"/>now. ')
    speech.next_chunk()
    assert 'start="turn.1:turn:m"' in write(speech.next_chunk())


def test_add_reads_markdown_and_marks_that_are_cut_anywhere() -> None:
    speech = SpeechStream("turn", 1, "MERGE", Chunk("turn", 0), TextStream())
    for token in ("**Ye", "s** [n", "od] it", " costs $1", "2.50.\n", "```\nx", "\n```\nDo", "ne."):
        speech.add(token, None)
    speech.close()
    first, second = speech.next_chunk(), speech.next_chunk()
    words = " ".join(str(first.behaviours[0].text).split())
    assert words == "Yes it costs twelve dollars and fifty cents."
    assert [type(node).__name__ for node in first.behaviours] == ["Speech", "Head"]
    assert [problem.text for block in (first, second) for problem in block.problems] == [
        "a block of code is not spoken"
    ]
    assert "Done." in write(second)
