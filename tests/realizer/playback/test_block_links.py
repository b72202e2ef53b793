"""Tests of links between blocks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import Block, SyncRef, parse
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import KINDS
from realizer.playback.active_block import ActiveBlock, Dependency, State
from realizer.playback.block_links import (
    all_dependencies,
    dependencies,
    existing_claims,
    external_times,
    followers,
    with_stops,
)
from realizer.playback.block_planner import plan
from realizer.playback.block_states import BlockEvent
from realizer.scheduling.timing import Schedule


def block(id: str, said: str = "", inside: str = '<gaze id="g" target="x"/>') -> Block:
    return parse(f'<bml id="{id}" xmlns:bmla="http://www.asap-project.org/bmla" {said}>{inside}</bml>')


def alive(
    id: str,
    character: int = 0,
    start: float = 0.0,
    waits: list[Dependency] | None = None,
    number: int = 1,
) -> ActiveBlock:
    context = PlanningContext()
    planned = plan(block(id), KINDS, context)
    made = ActiveBlock(planned, KINDS, context, character, number, start, waits or [])
    made.apply_plan(made.plan, start, start)
    return made


def ids(waits: list[Dependency]) -> list[tuple[str, bool]]:
    return [(w.block.block.id, w.subsiding) for w in waits]


def test_dependencies_of_append_are_only_the_last_of_a_chain() -> None:
    first = alive("a")
    second = alive("b", waits=[Dependency(first)], number=2)
    apart = alive("c", number=3)
    other = alive("d", character=1, number=4)
    never = alive("e", start=float("inf"), number=5)
    later = alive("f", number=7)
    everyone = [first, second, apart, other, never, later]
    assert ids(dependencies(block("x", 'composition="APPEND"'), 0, 6, everyone)) == [
        ("b", False),
        ("c", False),
    ]


def test_dependencies_of_append_name_what_was_put_before_an_earlier_block() -> None:
    second = alive("b", number=2)
    first = alive("a", waits=[Dependency(second)])
    assert ids(dependencies(block("x", 'composition="APPEND"'), 0, 3, [first, second])) == [
        ("a", False),
        ("b", False),
    ]


def test_dependencies_on_the_end_and_the_subsiding_are_both_named() -> None:
    first = alive("a")
    second = alive("b", waits=[Dependency(first, subsiding=True)])
    assert len(dependencies(block("x", 'composition="APPEND"'), 0, 2, [first, second])) == 2


def test_all_dependencies_follow_any_chain() -> None:
    chain = [alive("a")]
    for name in "bcd":
        chain.append(alive(name, waits=[Dependency(chain[-1])]))
    assert all_dependencies([Dependency(chain[2], subsiding=True)]) == set(map(id, chain[:3]))
    circle = alive("e", waits=[Dependency(chain[3])])
    chain[0].dependencies.append(Dependency(circle))
    assert all_dependencies([Dependency(circle)]) == set(map(id, [*chain, circle]))


def test_dependencies_by_list_are_of_any_character_and_known() -> None:
    everyone = [alive("a"), alive("b", character=1), alive("c")]
    said = 'bmla:appendAfter="b,nobody" bmla:chunkAfter="c"'
    assert ids(dependencies(block("x", said), 0, 2, everyone)) == [("b", False), ("c", True)]


def test_followers_are_named_with_their_kind_of_dependency() -> None:
    said = 'bmla:prependBefore="a" bmla:chunkBefore="b"'
    assert followers(block("x", said)) == [("a", False), ("b", True)]


def test_existing_claims_are_those_of_the_others_of_a_character() -> None:
    everyone = [alive("a"), alive("b", start=5.0), alive("c", character=1)]
    assert [(c.block, c.begin) for c in existing_claims(0, 2, everyone)] == [("a", 0.0), ("b", 5.0)]
    assert [c.block for c in existing_claims(0, 2, everyone, without=everyone[:1])] == ["b"]


@given(st.booleans(), st.booleans(), st.integers(1, 3))
def test_existing_claims_of_what_waits_are_of_earlier_blocks_with_a_start(
    begun: bool, known: bool, number: int
) -> None:
    other = alive("a", start=5.0 if known else float("inf"))
    other.number = 2
    other.state = State.IN_EXEC if begun else State.LURKING
    assert bool(existing_claims(0, number, [other])) == (begun or (known and number > 2))


SCHEDULES = {
    "a": Schedule("a", {"h": ("start", "stroke:2", "end")}, {"h": np.array([0.0, 1.0, 2.0])}, start=10.0),
    "p": Schedule("p", {}, {}, start=float("inf")),
}


@pytest.mark.parametrize(
    ("ref", "time"),
    [
        (SyncRef(block="a", behaviour="h", sync="end", offset=0.5), 2.5),
        (SyncRef(block="a", behaviour="h", sync="stroke", index=2), 1.0),
        (SyncRef(block="a", behaviour="bml", sync="start"), 0.0),
        (SyncRef(block="a", behaviour="bml", sync="end", offset=1.0), 3.0),
        (SyncRef(block="a", behaviour="h", sync="ready"), None),
        (SyncRef(block="a", behaviour="nobody", sync="end"), None),
        (SyncRef(block="a", behaviour="bml", sync="relax"), None),
        (SyncRef(block="p", behaviour="bml", sync="start"), None),
        (SyncRef(block="nobody", behaviour="h", sync="end"), None),
    ],
)
def test_external_times_are_known_for_known_points(ref: SyncRef, time: float | None) -> None:
    assert external_times(SCHEDULES.get, 10.0)(ref) == time


@given(st.floats(0, 20))
def test_with_stops_nothing_of_a_stopped_block_is_later(now: float) -> None:
    playing = alive("a")
    playing.change_state(BlockEvent.START)
    stopped = with_stops(SCHEDULES.get, [playing], now)("a")
    assert stopped is not None
    at, planned = (stopped.start + stopped.times["h"], SCHEDULES["a"].start + SCHEDULES["a"].times["h"])
    assert at == pytest.approx(np.minimum(planned, max(now, stopped.start)))


def test_with_stops_the_other_blocks_go_on() -> None:
    schedule_of = with_stops(SCHEDULES.get, [alive("a"), alive("nobody")], 11.0)
    assert schedule_of("a") is None  # it has not started
    assert schedule_of("p") is SCHEDULES["p"]
    assert schedule_of("nobody") is None
