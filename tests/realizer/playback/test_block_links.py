"""Tests of links between blocks."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import Block, PredictionFeedback, SyncPointProgress, SyncRef, parse
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import KINDS
from realizer.core.options import PlayOptions
from realizer.playback import block_manager
from realizer.playback.active_block import ActiveBlock, Dependency
from realizer.playback.block_links import (
    ExternalTimes,
    affected_blocks,
    all_dependencies,
    dependencies,
    existing_claims,
    followers,
    lead_times,
    with_stops,
)
from realizer.playback.block_planner import plan
from realizer.playback.block_states import BlockEvent, State
from realizer.playback.player import Player
from realizer.playback.references import Continuation
from realizer.scheduling.timing import Schedule
from realizer.speech.utterance import Phoneme, Utterance


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
    return [(w.block.block.id, w.moment == "subsides_at") for w in waits]


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
    second = alive("b", waits=[Dependency(first, "subsides_at")])
    assert len(dependencies(block("x", 'composition="APPEND"'), 0, 2, [first, second])) == 2


def test_all_dependencies_follow_any_chain() -> None:
    chain = [alive("a")]
    for name in "bcd":
        chain.append(alive(name, waits=[Dependency(chain[-1])]))
    assert all_dependencies([Dependency(chain[2], "subsides_at")]) == set(map(id, chain[:3]))
    circle = alive("e", waits=[Dependency(chain[3])])
    chain[0].dependencies.append(Dependency(circle))
    assert all_dependencies([Dependency(circle)]) == set(map(id, [*chain, circle]))


def test_dependencies_by_list_are_of_any_character_and_known() -> None:
    everyone = [alive("a"), alive("b", character=1), alive("c")]
    said = 'bmla:appendAfter="b,nobody" bmla:chunkAfter="c"'
    assert ids(dependencies(block("x", said), 0, 2, everyone)) == [("b", False), ("c", True)]


def test_dependencies_on_a_speech_leave_out_what_moves_the_face() -> None:
    first = alive("a", start=1.0)
    (wait,) = dependencies(Continuation.of(block("x"), ("a", "nobody")), 0, 2, [first])
    assert wait.until == first.start < first.end
    later = alive("b", waits=[wait], number=2)
    appended = dependencies(block("y", 'composition="APPEND"'), 0, 3, [first, later])
    assert ids(appended) == [("a", False), ("b", False)], "either may end last"


def test_followers_are_named_with_their_moment() -> None:
    said = 'bmla:prependBefore="a" bmla:chunkBefore="b"'
    assert followers(block("x", said)) == [("a", "end"), ("b", "subsides_at")]


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
        (SyncRef(block="p", behaviour="bml", sync="start"), None),
        (SyncRef(block="nobody", behaviour="h", sync="end"), None),
    ],
)
def test_external_times_are_known_for_known_points(ref: SyncRef, time: float | None) -> None:
    assert ExternalTimes(SCHEDULES.get, 10.0)(ref) == time


@pytest.mark.parametrize(
    ("name", "sync", "text"),
    [
        ("h", "ready", "a:h:ready: h has no ready, only start, stroke:2, end"),
        ("hh", "end", "a:hh:end: block a has no behaviour hh, did you mean h?"),
        ("bml", "relax", "a:bml:relax: bml has no relax, only start, end"),
    ],
)
def test_external_times_have_errors_with_the_names_of_a_block(name: str, sync: str, text: str) -> None:
    with pytest.raises(LookupError, match=re.escape(text)):
        ExternalTimes(SCHEDULES.get, 10.0)(SyncRef(block="a", behaviour=name, sync=sync))


def test_external_times_suggest_similar_names_ten_times() -> None:
    times, texts = ExternalTimes(SCHEDULES.get, 10.0), []
    for _ in range(12):
        with pytest.raises(LookupError) as error:
            times(SyncRef(block="a", behaviour="hh", sync="end"))
        texts.append(str(error.value))
    assert [("did you mean" in text) for text in texts] == 10 * [True] + 2 * [False]


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


class Stage:
    def __init__(self) -> None:
        self.player = Player(PlayOptions(idle=False), history=float("inf"))
        self.reported: list[SyncPointProgress] = []
        self.predicted: list[PredictionFeedback] = []

    def send(self, id: str, inside: str, at: float = 0.0, said: str = "") -> Schedule:
        schedule = self.player.submit(self.block(id, inside, said), at)
        self.until(at)
        return schedule

    @staticmethod
    def block(id: str, inside: str, said: str = "") -> Block:
        return parse(f'<bml id="{id}" xmlns:bmla="http://www.asap-project.org/bmla" {said}>{inside}</bml>')

    def until(self, now: float) -> None:
        for feedback in self.player.due(now):
            if isinstance(feedback, SyncPointProgress):
                self.reported.append(feedback)
            elif isinstance(feedback, PredictionFeedback):
                self.predicted.append(feedback)

    def times(self) -> dict[str, float]:
        self.until(1e6)
        assert len({f.id for f in self.reported}) == len(self.reported), "each once"
        return {f.id: f.global_time for f in self.reported}


FACE = '<faceLexeme id="f" lexeme="SMILE"{}/>'


@pytest.fixture
def stage() -> Stage:
    return Stage()


def test_replanning_shares_the_stretch_between_a_new_and_a_running_block(stage: Stage) -> None:
    alone = stage.send("a", FACE.format(""))
    # A wait of 9 s is tied to both ends of the face after half a second, so that both stretch.
    stage.send("b", '<wait id="w" duration="9" start="0" end="a:f:end"/>', at=0.1)
    times = stage.times()
    assert times["b:w:end"] == pytest.approx(times["a:f:end"])
    assert alone.end + 0.5 < times["a:f:end"] < 9.2
    assert times["a:f:start"] == 0.0


def test_replanning_never_changes_what_has_passed(stage: Stage) -> None:
    stage.send("a", FACE.format(""))
    stage.until(0.6)
    early = {f.id: f.global_time for f in stage.reported}
    stage.send("b", '<wait id="w" duration="9" start="0" end="a:f:end"/>', at=0.6)
    times = stage.times()
    assert {id: times[id] for id in early} == early
    assert times["a:f:relax"] > 0.6


def test_replanning_fixes_a_point_that_has_passed(stage: Stage) -> None:
    stage.send("a", FACE.format(' attackPeak="0.4"'))
    stage.until(1.0)
    before = stage.player.end
    stage.send("b", '<head id="n" lexeme="NOD" stroke="a:f:attackPeak + 2"/>', at=1.0)
    assert stage.times()["b:n:stroke"] == pytest.approx(2.4)
    assert stage.player.end == pytest.approx(max(before, stage.player.end))


def test_replanning_predicts_what_has_moved_only(stage: Stage) -> None:
    stage.send("a", FACE.format("") + '<wait id="apart" duration="1"/>')
    stage.predicted.clear()
    stage.send("b", '<wait id="w" duration="9" start="0" end="a:f:end"/>', at=0.1)
    of_a = [p for p in stage.predicted if p.blocks[0].id == "a"]
    assert len(of_a) == 1
    assert [b.id for b in of_a[0].behaviours] == ["a:f"]
    assert of_a[0].behaviours[0].syncs["end"].offset == pytest.approx(stage.times()["a:f:end"], abs=1e-6)


def test_replanning_leaves_unrelated_blocks_alone(stage: Stage) -> None:
    first = stage.send("a", FACE.format(""))
    stage.send("b", FACE.format(""), at=0.2)
    assert stage.player.latest(first).end == first.end


def test_replanning_drops_the_newer_behaviour_of_an_impossible_tie(stage: Stage) -> None:
    first = stage.send("a", FACE.format(' start="0" end="2"'))
    late = stage.send("b", '<wait id="w" start="a:f:end" end="bml:start + 1"/>', at=0.5)
    assert not late.times
    assert [w.id for w in late.warnings] == ["b:w"]
    assert "a:f:end = 2" in late.warnings[0].text
    assert stage.player.latest(first).end == 2.0


def test_replanning_moves_the_face_without_a_jump(stage: Stage) -> None:
    stage.send("a", FACE.format(""))
    for at in (0.2, 0.7, 1.2):
        stage.send(f"b{at}", f'<wait id="w" duration="{9 * at}" start="0" end="a:f:end"/>', at=at)
    stage.until(100)
    times = np.arange(0, stage.player.end, 0.002)
    course = stage.player.frames(times).aus.max(axis=1)
    assert course.max() > 0.3
    assert np.abs(np.diff(course)).max() < 0.02
    assert np.abs(np.diff(course, 2)).max() < 4e-4


def test_replanning_moves_a_block_that_waits_for_a_moved_one(stage: Stage) -> None:
    stage.send("a", FACE.format(""))
    after = stage.send("c", '<wait id="w" duration="1"/>', said='composition="APPEND"')
    stage.send("b", '<wait id="w" duration="9" start="0" end="a:f:end"/>', at=0.1)
    assert stage.player.latest(after).start == pytest.approx(stage.times()["a:f:end"])


def test_replanning_follows_an_interrupted_behaviour(stage: Stage) -> None:
    stage.send(
        "a", FACE.format(' start="0" attackPeak="0.5" relax="4" end="5"') + '<wait id="w" duration="9"/>'
    )
    stage.send("b", '<head id="n" lexeme="NOD" start="a:f:end"/>')
    stage.send("i", '<bmla:interrupt id="i" target="a" include="f"/>', at=1.0)
    assert stage.times()["b:n:start"] == pytest.approx(1.3)


def test_affected_blocks_are_connected_by_future_points() -> None:
    stage = Stage()
    stage.send("a", FACE.format(""))
    stage.send("b", '<head id="n" lexeme="NOD" start="a:f:end"/>')
    stage.send("c", FACE.format(""))
    new = stage.block("x", '<wait id="w" start="b:n:end"/>')
    alive = stage.player.blocks.active()
    assert [p.block.id for p in affected_blocks(new, alive, 0.0)] == ["a", "b"]
    assert affected_blocks(new, alive, 60.0) == []
    assert affected_blocks(stage.block("y", FACE.format("")), alive, 0.0) == []


BEAT = '<head id="n" lexeme="NOD" stroke="anticipators:clock:beat"/>'


def test_members_do_not_move_towards_an_anticipated_point(stage: Stage) -> None:
    stage.player.anticipate("clock", {"beat": 1e6}, 0.0)
    stage.send("first", '<wait id="w" duration="1"/>')
    stage.send("a", '<wait id="w" duration="2"/>', said='composition="APPEND"')
    stage.send("b", FACE.format(' start="a:w:start" end="anticipators:clock:beat"'))
    stage.player.anticipate("clock", {"beat": 30.0}, 0.5)
    times = stage.times()
    assert times["a:w:start"] == times["b:f:start"] == pytest.approx(1.0)
    assert times["b:f:end"] == pytest.approx(30.0)


def test_anticipate_moves_a_behaviour_tied_to_the_point(stage: Stage) -> None:
    stage.player.anticipate("clock", {"beat": 3.0}, 0.0)
    stage.send("a", BEAT)
    stage.until(1.0)
    stage.player.anticipate("clock", {"beat": 2.5}, 1.0)
    stage.player.anticipate("clock", {"beat": 4.0}, 2.2)
    times = stage.times()
    assert times["a:n:stroke"] == pytest.approx(4.0)
    assert times["a:n:start"] < 2.2, "it had begun by then"


@pytest.mark.slow
def test_anticipate_forgets_the_oldest_that_no_block_is_tied_to(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(block_manager, "ANTICIPATORS", most := 20)
    stage.player.anticipate("clock", {"beat": 3.0}, 0.0)
    stage.send("a", BEAT)
    for number in range(most + 5):
        stage.player.anticipate(f"other-{number}", {"beat": 9.0}, 0.0)
    known = stage.player.blocks.anticipators
    assert len(known) == most
    assert {"clock", f"other-{most + 4}"} <= set(known)
    assert "other-0" not in known
    stage.player.anticipate("clock", {"beat": 4.0}, 1.0)
    assert stage.times()["a:n:stroke"] == pytest.approx(4.0)


def test_anticipate_late_does_not_move_what_has_passed(stage: Stage) -> None:
    stage.player.anticipate("clock", {"beat": 1.0}, 0.0)
    stage.send("a", BEAT)
    stage.until(1.2)
    stage.player.anticipate("clock", {"beat": 2.0}, 1.2)
    assert stage.times()["a:n:stroke"] == pytest.approx(1.0)


def test_anticipate_in_the_past_means_at_once(stage: Stage) -> None:
    stage.player.anticipate("clock", {"beat": 9.0}, 0.0)
    stage.send("a", BEAT)
    stage.until(3.0)
    stage.player.anticipate("clock", {"beat": 2.0}, 3.0)
    times = stage.times()
    assert times["a:n:start"] == pytest.approx(3.0)
    assert 3.0 < times["a:n:stroke"] < 3.1, "its preparation takes its least time"


def test_anticipated_point_that_is_unknown_drops_the_behaviour(stage: Stage) -> None:
    schedule = stage.send("a", BEAT)
    assert not schedule.times
    assert [w.id for w in schedule.warnings] == ["a:n"]


def test_preplanned_block_moves_no_block_before_its_activation(stage: Stage) -> None:
    first = stage.send("a", FACE.format(""))
    stage.send("p", '<wait id="w" duration="9" start="0" end="a:f:end"/>', said='bmla:preplan="true"')
    assert stage.player.latest(first).end == first.end
    stage.send("x", '<bmla:activate id="x" target="p"/>', at=0.3)
    assert stage.player.latest(first).end > first.end


TALK = '<speech id="s"><text>one <sync id="m"/>two</text></speech><head id="n" lexeme="NOD" stroke="s:m"/>'


def spoken(mark: float, end: float) -> Utterance:
    return Utterance(end, (), (Phoneme(0.0, end, "a"),), {"m": mark})


def test_update_speech_moves_the_rest_with_a_slower_voice() -> None:
    stage = Stage()
    stage.player.submit(stage.block("a", TALK), 0.0, {"s": spoken(1.0, 2.0)})
    stage.until(0.5)
    assert stage.player.manager.update_speech_timing("a", "s", spoken(1.6, 3.0), 0.5)
    times = stage.times()
    assert times["a:s:m"] == times["a:n:stroke"] == pytest.approx(1.6)
    assert times["a:s:end"] == pytest.approx(3.0)


def test_update_speech_leaves_reported_marks() -> None:
    stage = Stage()
    stage.player.submit(stage.block("a", TALK), 0.0, {"s": spoken(1.0, 2.0)})
    stage.until(1.2)
    assert stage.player.manager.update_speech_timing("a", "s", spoken(1.6, 3.0), 1.2)
    times = stage.times()
    assert times["a:s:m"] == pytest.approx(1.0)
    assert times["a:s:end"] == pytest.approx(3.0)


def test_update_speech_of_a_past_speech_does_nothing() -> None:
    stage = Stage()
    stage.player.submit(stage.block("a", TALK), 0.0, {"s": spoken(1.0, 2.0)})
    stage.until(9.0)
    assert not stage.player.manager.update_speech_timing("a", "s", spoken(1.6, 3.0), 9.0)
    assert not stage.player.manager.update_speech_timing("nobody", "s", spoken(1.6, 3.0), 9.0)


def test_replanning_for_a_failed_block_moves_nothing(stage: Stage) -> None:
    first = stage.send("a", FACE.format(""))
    refused = stage.send("b", '<required><wait id="w" start="a:f:end" end="0"/></required>', at=0.1)
    assert refused.failed
    assert stage.player.latest(first).end == first.end


WAIT = '<bml id="a"><wait id="w" start="0" end="anticipators:clock:beat"/></bml>'


def anticipating(text: str) -> ActiveBlock:
    """Return a block that plays from 0 s on; unknown points are at 9 s."""
    block = parse(text)
    planned = plan(block, KINDS, PlanningContext(), external_times=lambda ref: 9.0 + ref.offset)
    made = ActiveBlock(planned, KINDS, PlanningContext(), 0, 1, 0.0)
    made.apply_plan(planned, 0.0, 0.0)
    return made


@pytest.mark.parametrize(
    ("body", "least"),
    [
        ("", 0.0),
        ('<faceLexeme id="f" lexeme="SMILE" start="0" end="a:w:end"/>', 0.04),
        ('<faceLexeme id="f" lexeme="SMILE" start="0" end="a:w:end-0.5"/>', 0.54),
        ('<faceLexeme id="f" lexeme="SMILE" start="0" relax="a:w:end"/>', 0.0),
        (
            '<faceLexeme id="f" lexeme="SMILE" start="0" end="n:end"/>'
            '<head id="n" lexeme="NOD" end="a:w:end"/>',
            0.12,
        ),
        (
            '<faceLexeme id="f" lexeme="SMILE" start="0"/><constraint id="c"><synchronize ref="a:w:end">'
            '<sync ref="f:end+0.1"/></synchronize></constraint>',
            0.14,
        ),
    ],
)
def test_lead_times_is_the_least_time_of_what_is_tied_to_a_point(body: str, least: float) -> None:
    group = [anticipating(WAIT), anticipating(f'<bml id="b">{body}</bml>')]
    found = lead_times(group, "clock", ("beat", "other"), 4.0)
    assert found["beat"] == pytest.approx(4.0 + least, abs=0.021)
    assert found["other"] == 4.0


def test_lead_times_keeps_the_least_gap_behind_a_point_that_has_passed() -> None:
    group = [
        anticipating(WAIT),
        anticipating('<bml id="b"><faceLexeme id="f" lexeme="SMILE" start="0" end="a:w:end"/></bml>'),
    ]
    relax = group[1].schedule.at("f", "relax")
    assert lead_times(group, "clock", ["beat"], relax + 0.01)["beat"] == pytest.approx(relax + 0.04)
    assert lead_times(group, "clock", ["beat"], 9.0)["beat"] == 9.0, "all has passed"
