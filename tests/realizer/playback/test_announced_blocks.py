"""What is done to a block that was announced is kept until it comes, and no longer."""

from __future__ import annotations

from bml_schema import parse
from realizer.playback.announced_blocks import AnnouncedBlocks
from realizer.playback.block_states import BlockEvent

BLOCK = parse('<bml id="a"/>')


def test_a_block_is_expected_from_its_announcement_until_it_arrives() -> None:
    expected = AnnouncedBlocks()
    assert "a" not in expected
    expected.add(BLOCK)
    assert "a" in expected
    expected.pop(BLOCK)
    assert "a" not in expected


def test_what_was_done_meanwhile_is_its_fate_once() -> None:
    expected = AnnouncedBlocks()
    expected.add(BLOCK)
    fate = expected.get("a")
    assert fate is not None
    fate.change_state(BlockEvent.STOP)
    assert expected.pop(BLOCK).revoked
    assert not expected.pop(BLOCK).revoked


def test_nothing_is_known_of_a_block_nobody_announced() -> None:
    assert AnnouncedBlocks().get("a") is None
