"""Tests of blocks that move when other blocks are tied to them."""

from __future__ import annotations

import numpy as np
import pytest

from bml_schema import Block, PredictionFeedback, SyncPointProgress, parse
from realizer.core.options import PlayOptions
from realizer.playback import block_manager
from realizer.playback.player import Player
from realizer.playback.replanning import affected_blocks
from realizer.scheduling.timing import Schedule
from realizer.speech.utterance import Phoneme, Utterance


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
    assert stage.player.update_speech_timing("a", "s", spoken(1.6, 3.0), 0.5)
    times = stage.times()
    assert times["a:s:m"] == times["a:n:stroke"] == pytest.approx(1.6)
    assert times["a:s:end"] == pytest.approx(3.0)


def test_update_speech_leaves_reported_marks() -> None:
    stage = Stage()
    stage.player.submit(stage.block("a", TALK), 0.0, {"s": spoken(1.0, 2.0)})
    stage.until(1.2)
    assert stage.player.update_speech_timing("a", "s", spoken(1.6, 3.0), 1.2)
    times = stage.times()
    assert times["a:s:m"] == pytest.approx(1.0)
    assert times["a:s:end"] == pytest.approx(3.0)


def test_update_speech_of_a_past_speech_does_nothing() -> None:
    stage = Stage()
    stage.player.submit(stage.block("a", TALK), 0.0, {"s": spoken(1.0, 2.0)})
    stage.until(9.0)
    assert not stage.player.update_speech_timing("a", "s", spoken(1.6, 3.0), 9.0)
    assert not stage.player.update_speech_timing("nobody", "s", spoken(1.6, 3.0), 9.0)


def test_replanning_for_a_failed_block_moves_nothing(stage: Stage) -> None:
    first = stage.send("a", FACE.format(""))
    refused = stage.send("b", '<required><wait id="w" start="a:f:end" end="0"/></required>', at=0.1)
    assert refused.failed
    assert stage.player.latest(first).end == first.end
