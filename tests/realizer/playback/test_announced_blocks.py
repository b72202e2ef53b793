"""What is done to a block that was announced is kept until it comes, and no longer."""

from __future__ import annotations

from bml_schema import parse
from realizer.playback.announced_blocks import AnnouncedBlocks
from realizer.playback.block_states import BlockEvent

BLOCK = parse('<bml id="a"/>')


def test_announced_block_is_known_until_it_arrives() -> None:
    expected = AnnouncedBlocks()
    assert "a" not in expected
    expected.add(BLOCK)
    assert "a" in expected
    expected.pop(BLOCK)
    assert "a" not in expected


def test_pop_returns_the_commands_so_far_once() -> None:
    expected = AnnouncedBlocks()
    expected.add(BLOCK)
    fate = expected.get("a")
    assert fate is not None
    fate.change_state(BlockEvent.STOP)
    assert expected.pop(BLOCK).revoked
    assert not expected.pop(BLOCK).revoked


def test_pop_of_a_block_that_was_not_announced_is_new() -> None:
    assert AnnouncedBlocks().get("a") is None
