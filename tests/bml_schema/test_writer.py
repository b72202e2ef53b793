"""What is written reads back as the same block."""

from __future__ import annotations

from hypothesis import given

from bml_schema import Block, parse, write
from tests.strategies import blocks


@given(blocks())
def test_a_written_block_reads_back_as_the_same(block: Block) -> None:
    text = write(block)
    back = parse(text)
    assert back == block, text
    assert not back.problems
    assert write(back) == text


@given(blocks())
def test_a_written_block_reads_back_from_bytes_too(block: Block) -> None:
    assert parse(write(block).encode()) == block
