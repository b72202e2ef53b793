"""Tests of the timeline of blocks."""

from __future__ import annotations

from graphlib import CycleError
from itertools import pairwise

import pytest

from bml_schema import BlockProgress, parse
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import KINDS
from realizer.playback.active_block import ActiveBlock, Dependency
from realizer.playback.block_states import BlockEvent, State
from realizer.playback.block_timeline import BlockTimeline
from realizer.playback.character import Character
from realizer.playback.joint_planner import Arrival


def taken_in(
    course: BlockTimeline, id: str, after: ActiveBlock | None = None, state: State = State.LURKING
) -> ActiveBlock:
    block = parse(f'<bml id="{id}"><wait id="w" duration="2"/></bml>')
    planned, _ = course.planner.plan(Arrival(block, 0, 1, PlanningContext()), 0.0, 0.0)
    waits = [] if after is None else [Dependency(after)]
    made = ActiveBlock(planned, KINDS, PlanningContext(), 0, course.blocks.new_number(), 0.0, waits, state)
    made.apply_plan(planned, made.earliest, 0.0)
    course.blocks.add(made)
    course.place(made)
    return made


def course() -> BlockTimeline:
    return BlockTimeline(KINDS, [Character(None)])


def test_stop_moves_the_followers_of_a_block() -> None:
    blocks = course()
    first = taken_in(blocks, "a")
    second = taken_in(blocks, "b", after=first)
    third = taken_in(blocks, "c", after=second)
    first.change_state(BlockEvent.START)
    blocks.stop(first, 0.5)
    assert (first.state, first.end) == (State.INTERRUPTED, 0.5)
    assert (second.start, third.start) == (0.5, 2.5)
    ends = [f for f in blocks.reports.take_all() if isinstance(f, BlockProgress)]
    assert [(f.id, f.status) for f in ends] == [("a:end", "INTERRUPTED")]


def test_stop_of_a_waiting_block_revokes_it() -> None:
    blocks = course()
    first = taken_in(blocks, "a")
    blocks.stop(first, 0.0)
    assert first.state is State.REVOKED
    assert blocks.events.next is None
    assert blocks.blocks.find("a") is None


def test_timeline_has_no_events_of_a_block_that_is_not_activated() -> None:
    blocks = course()
    pending = taken_in(blocks, "p", state=State.PENDING)
    assert blocks.events.next is None
    pending.change_state(BlockEvent.ACTIVATE)
    assert blocks.move(pending, 3.0)
    assert blocks.events.next == pending.start == 0.0


def test_reorder_moves_blocks_behind_what_they_wait_for() -> None:
    blocks = course()
    first = taken_in(blocks, "a")
    second = taken_in(blocks, "b", after=first)
    third = taken_in(blocks, "c")
    first.add_dependency(Dependency(third))
    blocks.reorder(first)
    assert third.order < first.order < second.order


def test_reorder_visits_each_block_once() -> None:
    blocks = course()
    first = taken_in(blocks, "a")
    layers = [[first]]
    for number in range(40):  # 2 ** 40 paths
        layer = [taken_in(blocks, f"{side}{number}", after=layers[-1][0]) for side in "lr"]
        for block in layer:
            for other in layers[-1][1:]:
                block.add_dependency(Dependency(other))
        layers.append(layer)
    blocks.reorder(first)
    for before, layer in pairwise(layers):
        assert max(block.order for block in before) < min(block.order for block in layer)


def test_reorder_refuses_blocks_that_wait_for_each_other() -> None:
    blocks = course()
    first = taken_in(blocks, "a")
    first.add_dependency(Dependency(taken_in(blocks, "b", after=first)))
    with pytest.raises(CycleError):
        blocks.reorder(first)


def test_version_increases_with_every_visible_change() -> None:
    blocks = course()
    before = blocks.version
    first = taken_in(blocks, "a")
    assert blocks.version > before
    before = blocks.version
    blocks.stop(first, 0.0)
    assert blocks.version > before
