"""Tests of accepted blocks."""

from __future__ import annotations

import pytest

from bml_schema import parse
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import KINDS
from realizer.playback.active_block import ActiveBlock, Dependency
from realizer.playback.block_planner import plan
from realizer.playback.block_states import State

FACE = '<faceLexeme id="s" lexeme="SMILE" start="0" attackPeak="0.5" relax="2" end="3"/>'


def playing(state: State = State.IN_EXEC) -> ActiveBlock:
    context = PlanningContext()
    planned = plan(parse(f'<bml id="a">{FACE}</bml>'), KINDS, context, start=10.0)
    made = ActiveBlock(planned, KINDS, context, character=0, number=0, not_before=10.0, state=state)
    made.apply_plan(planned, 10.0, 10.0)
    return made


@pytest.mark.parametrize("state", [State.LURKING, State.IN_EXEC])
def test_cut_plans_a_waiting_block_again_without_what_was_removed(state: State) -> None:
    made = playing(state)
    assert made.cut(["s"], 9.0) == ["s"]
    assert [node.id for node in made.block.behaviours] == ([] if state is State.LURKING else ["s"])


def test_earliest_start_is_after_all_dependencies() -> None:
    first, second = playing(), playing()
    second.add_dependency(Dependency(first, "subsides_at"))
    assert second.earliest == 12.0
    second.add_dependency(Dependency(first))
    assert second.earliest == 13.0
    assert first.followers == [second, second]
