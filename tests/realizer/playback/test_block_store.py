"""Tests of the store of blocks."""

from __future__ import annotations

import pytest

from bml_schema import parse
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import KINDS
from realizer.playback.active_block import ActiveBlock
from realizer.playback.block_planner import plan
from realizer.playback.block_states import BlockEvent
from realizer.playback.block_store import PAST, BlockStore


def added(cast: BlockStore, id: str, start: float = 0.0, character: int = 0) -> ActiveBlock:
    block = parse(f'<bml id="{id}"><wait id="w" duration="1"/></bml>')
    planned = plan(block, KINDS, PlanningContext(), start=start)
    made = ActiveBlock(planned, KINDS, PlanningContext(), character, cast.new_number(), start)
    made.apply_plan(made.plan, start, start)
    cast.add(made)
    return made


def ended(cast: BlockStore, id: str, start: float = 0.0) -> ActiveBlock:
    made = added(cast, id, start)
    made.change_state(BlockEvent.START)
    made.change_state(BlockEvent.END)
    cast.end(made)
    return made


def test_find_has_a_block_while_it_is_active() -> None:
    cast = BlockStore()
    made = added(cast, "a")
    assert cast.find("a") is made
    assert cast.active() == cast.all() == [made]
    made.change_state(BlockEvent.START)
    made.change_state(BlockEvent.END)
    cast.end(made)
    assert cast.find("a") is None
    assert cast.all() == [made], "it may still be seen"


def test_of_character_has_the_blocks_of_one_character() -> None:
    cast = BlockStore()
    first, second = added(cast, "a"), added(cast, "b", character=1)
    assert (cast.of_character(0), cast.of_character(1)) == ([first], [second])


def test_forget_keeps_schedules_for_a_while() -> None:
    cast = BlockStore()
    ended(cast, "a")
    assert cast.forget(1.0) == []
    assert [p.block.id for p in cast.forget(1.1)] == ["a"]
    assert cast.all() == []
    schedule = cast.schedule_of("a")
    assert schedule is not None
    assert schedule.at("w", "end") == 1.0
    for n in range(PAST):
        ended(cast, f"b{n}")
    cast.forget(9.0)
    assert not cast.has_seen("a")
    assert cast.has_seen("b0")


@pytest.mark.parametrize("anew", [False, True])
def test_forget_keeps_fewer_long_schedules_but_always_the_last(
    monkeypatch: pytest.MonkeyPatch, anew: bool
) -> None:
    points = 2  # of a <wait>
    monkeypatch.setattr("realizer.playback.block_store.PAST_POINTS", 3 * points)
    cast = BlockStore()
    for n, name in enumerate("abacd"):
        ended(cast, name, 2.0 * n)
        cast.forget(2.0 * n + 1.5)
        if anew:  # as it is after a checkpoint
            again = BlockStore()
            again.restore(*cast.snapshot())
            cast = again
    assert [cast.has_seen(name) for name in "abcd"] == [True, False, True, True]
    monkeypatch.setattr("realizer.playback.block_store.PAST_POINTS", 1)
    ended(cast, "e", 20.0)
    cast.forget(30.0)
    assert [cast.has_seen(name) for name in "abcde"] == [False, False, False, False, True]


def test_note_revoked_remembers_an_id_but_no_points() -> None:
    cast = BlockStore()
    cast.note_revoked("a")
    assert cast.has_seen("a")
    ended(cast, "b")
    cast.forget(9.0)
    cast.note_revoked("b")
    schedule = cast.schedule_of("b")
    assert schedule is not None
    assert schedule.at("w", "end") == 1.0, "that of the block that played"


def test_schedule_of_an_id_is_that_of_the_newest_block() -> None:
    cast = BlockStore()
    ended(cast, "a")
    added(cast, "a", start=5.0)
    schedule = cast.schedule_of("a")
    assert schedule is not None
    assert schedule.start == 5.0


@pytest.mark.parametrize(("stopped", "end"), [(None, 1.0), (5.4, 0.4), (9.0, 1.0), (3.0, 0.0)])
def test_first_schedule_of_a_block_ends_where_it_was_stopped(stopped: float | None, end: float) -> None:
    cast = BlockStore()
    added(cast, "a", start=5.0).stopped_at = stopped
    schedule = cast.first_schedule_of("a")
    assert schedule is not None
    assert schedule.start == 5.0
    assert schedule.at("w", "end") == pytest.approx(end)


def test_drop_anticipators_removes_their_points_only() -> None:
    cast = BlockStore()
    for id in ("clock", "music"):
        cast.anticipate(id, {"beat": 3.0})
    cast.drop_anticipators(["clock", "never"])
    assert list(cast.anticipators) == ["music"]
    schedule = cast.schedule_of("anticipators")
    assert schedule is not None
    assert schedule.at("music", "beat") == 3.0
    assert "clock" not in schedule.times


def test_anticipate_makes_points_of_a_reserved_block() -> None:
    cast = BlockStore()
    cast.anticipate("clock", {"beat": 3.0})
    cast.anticipate("clock", {"bar": 4.0, "beat": 2.0})
    schedule = cast.schedule_of("anticipators")
    assert schedule is not None
    assert schedule["clock"] == pytest.approx({"beat": 2.0, "bar": 4.0})
