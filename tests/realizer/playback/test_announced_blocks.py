"""Tests of blocks that have arrived and are not planned yet."""

from __future__ import annotations

import pytest

from bml_schema import Block, parse
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import KINDS
from realizer.playback.active_block import ActiveBlock, Dependency
from realizer.playback.announced_blocks import AnnouncedBlocks, BlockRejectedError
from realizer.playback.block_planner import plan
from realizer.playback.block_states import BlockEvent
from realizer.playback.block_store import BlockStore


def block(id: str, said: str = "") -> Block:
    text = f'<bml xmlns:bmla="http://www.asap-project.org/bmla" id="{id}" {said}>'
    return parse(f'{text}<wait id="w" duration="1"/></bml>')


@pytest.fixture
def store() -> BlockStore:
    return BlockStore()


@pytest.fixture
def announced(store: BlockStore) -> AnnouncedBlocks:
    return AnnouncedBlocks(store)


def accept(store: BlockStore, id: str, said: str = "", character: int = 0) -> ActiveBlock:
    context = PlanningContext()
    planned = plan(block(id, said), KINDS, context)
    playing = ActiveBlock(planned, KINDS, context, character, store.new_number(), 0.0)
    store.add(playing)
    return playing


def test_add_numbers_blocks_in_order_of_arrival_and_each_once(announced: AnnouncedBlocks) -> None:
    first, second = announced.add(block("a"), 0), announced.add(block("b"), 0)
    assert first is not None
    assert second is not None
    assert announced.add(block("a"), 0) is None
    assert (first.number, second.number, len(announced)) == (1, 2, 2)
    assert announced.before(second) == [first]
    assert announced.pop("a") is first
    assert announced.find("a") is None


@pytest.mark.parametrize(
    ("said", "character", "is_added"),
    [
        ("", 0, False),
        ('composition="REPLACE"', 0, True),
        ('composition="REPLACE"', 1, False),
    ],
)
def test_add_takes_an_id_that_is_in_use_if_its_block_ends(
    store, announced, said, character, is_added
) -> None:
    accept(store, "a")
    assert (announced.add(block("a", said), character) is not None) is is_added


def test_blocks_to_end_are_earlier_ones_that_are_interrupted_or_replaced(store, announced) -> None:
    own, other = accept(store, "a"), accept(store, "b", character=1)
    replaces = announced.add(block("r", 'composition="REPLACE"'), 0)
    interrupts = announced.add(block("i", 'bmla:interrupt="b,later"'), 0)
    accept(store, "later")
    assert announced.blocks_to_end(replaces) == [own]
    assert announced.blocks_to_end(interrupts) == [other]
    assert replaces.ends(interrupts)
    assert not interrupts.ends(replaces)


def test_links_are_dependencies_and_blocks_that_wait(store, announced) -> None:
    first, second = accept(store, "a"), accept(store, "b")
    added = announced.add(block("c", 'bmla:appendAfter="a" bmla:prependBefore="b"'), 0)
    waits, waiting = announced.links(added)
    assert [wait.block for wait in waits] == [first]
    assert waiting == [(second, "end")]


@pytest.mark.parametrize("event", [None, BlockEvent.START])
def test_links_are_refused_for_blocks_that_started_or_are_unknown(store, announced, event) -> None:
    if event is not None:
        accept(store, "b").change_state(event)
    added = announced.add(block("c", 'bmla:prependBefore="b"'), 0)
    assert added.is_too_late
    with pytest.raises(BlockRejectedError, match="wanted blocks that have not started, got 'b'"):
        announced.links(added)


def test_links_may_name_a_block_that_was_revoked(store, announced) -> None:
    store.note_revoked("b")
    added = announced.add(block("c", 'bmla:prependBefore="b"'), 0)
    assert not added.is_too_late
    assert announced.links(added) == ([], [])


def test_links_are_refused_in_a_circle(store, announced) -> None:
    accept(store, "a")
    added = announced.add(block("c", 'bmla:appendAfter="a" bmla:chunkBefore="a"'), 0)
    with pytest.raises(BlockRejectedError, match="does not wait for itself"):
        announced.links(added)


def test_place_after_lets_earlier_blocks_wait(store, announced) -> None:
    early = announced.add(block("a"), 0)
    playing = accept(store, "b", 'bmla:prependBefore="a,later"')
    later = announced.add(block("later"), 0)
    announced.place_after(playing)
    assert [wait.block for wait in announced.dependencies(early)] == [playing]
    assert announced.dependencies(later) == []
    assert isinstance(early.dependencies[0], Dependency)
