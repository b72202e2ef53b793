"""Tests of the manager of blocks: composition, BMLA's attributes, preplanned blocks, resources."""

from __future__ import annotations

import numpy as np
import pytest

from bml_schema import BlockProgress, PredictionFeedback, WarningFeedback, parse
from realizer.core.options import PlayOptions
from realizer.playback.player import Player
from realizer.scheduling.timing import Schedule
from realizer.speech.silent import SilentVoice

BMLA = 'xmlns:bmla="http://www.asap-project.org/bmla"'


class Stage:
    """A player and the log of its feedback: "a:start 0.0", "a IN_PREP 0.0-", "! a:b TYPE"."""

    def __init__(self) -> None:
        self.player = Player(PlayOptions(idle=False))
        self.log: list[str] = []
        self.texts: list[str] = []
        self.now = 0.0

    def send(self, id: str, inside: str = "", *, at: float = 0.0, **attributes: str) -> Schedule:
        names = {
            "preplan",
            "appendAfter",
            "chunkAfter",
            "prependBefore",
            "chunkBefore",
            "interrupt",
            "onStart",
        }
        said = "".join(f' {"bmla:" if k in names else ""}{k}="{v}"' for k, v in attributes.items())
        block = parse(f'<bml id="{id}" {BMLA}{said}>{inside}</bml>')
        says = {b: SilentVoice().say(say) for b, say in self.player.speech_requests(block).items()}
        schedule = self.player.submit(block, at, says)
        self.until(at)
        return schedule

    def until(self, now: float) -> list[str]:
        for feedback in self.player.due(now):
            if isinstance(feedback, BlockProgress):
                self.log.append(f"{feedback.id} {feedback.status} {feedback.global_time:g}")
            elif isinstance(feedback, WarningFeedback):
                self.log.append(f"! {feedback.id} {feedback.type}")
                self.texts.append(feedback.text)
            elif isinstance(feedback, PredictionFeedback):
                (block,) = feedback.blocks
                end = "" if block.global_end is None else f"{block.global_end:g}"
                self.log.append(f"{block.id} {block.status} {block.global_start:g}-{end}")
        return self.log

    def progress(self) -> list[str]:
        self.now += 1e4
        return [line for line in self.until(self.now) if ":" in line and not line.startswith("!")]

    def au(self, target: int, times: list[float]) -> np.ndarray:
        return self.player.frames(np.array(times)).aus[:, target]


@pytest.fixture
def stage() -> Stage:
    return Stage()


def smile(end: float = 2.0) -> str:
    return f'<faceLexeme id="s" lexeme="SMILE" attackPeak="0.4" relax="{end - 0.5}" start="0" end="{end}"/>'


def wait(seconds: float, id: str = "w") -> str:
    return f'<wait id="{id}" duration="{seconds}"/>'


def gaze(id: str = "g", target: str = "x") -> str:
    return f'<gaze id="{id}" target="{target}" start="0" ready="0.4" relax="1.5" end="2"/>'


def test_manager_moves_a_block_through_its_states(stage: Stage) -> None:
    stage.send("a", smile())
    assert stage.until(9) == [
        "a IN_PREP 0-",
        "a LURKING 0-2",
        "a:start IN_EXEC 0",
        "a IN_EXEC 0-2",
        "a SUBSIDING 0-2",
        "a:end DONE 2",
    ]


def test_manager_starts_and_ends_an_empty_block_at_once(stage: Stage) -> None:
    stage.send("a", at=3.0)
    assert stage.progress() == ["a:start IN_EXEC 3", "a:end DONE 3"]


# APPEND and what BMLA adds to it


def test_append_waits_for_all_of_its_character(stage: Stage) -> None:
    stage.send("a", wait(2), characterId="Ann")
    stage.send("b", wait(3), at=0.5)
    stage.send("other", wait(9), characterId="Bob", at=0.5)
    stage.send("c", wait(1), composition="APPEND", at=0.6)
    assert "c:start IN_EXEC 3.5" in stage.progress()


def test_append_after_waits_for_the_named_blocks_only(stage: Stage) -> None:
    stage.send("a", wait(1))
    stage.send("b", wait(5))
    stage.send("c", wait(1), appendAfter="a,nobody")
    assert "c:start IN_EXEC 1" in stage.progress()


def test_append_after_in_composition_means_the_same(stage: Stage) -> None:
    stage.send("a", wait(1))
    stage.send("b", wait(2))
    stage.send("c", wait(1), composition="APPEND-AFTER(a,b)")
    assert "c:start IN_EXEC 2" in stage.progress()


def test_append_after_with_an_empty_list_waits_for_nothing(stage: Stage) -> None:
    stage.send("a", wait(1))
    stage.send("c", wait(1), composition="APPEND-AFTER()")
    assert "c:start IN_EXEC 0" in stage.progress()


def test_chunk_after_starts_when_the_other_subsides(stage: Stage) -> None:
    stage.send("a", smile())
    stage.send("b", wait(1), chunkAfter="a")
    assert stage.progress() == ["a:start IN_EXEC 0", "b:start IN_EXEC 1.5", "a:end DONE 2", "b:end DONE 2.5"]


def test_prepend_before_delays_a_waiting_block_and_reports_it(stage: Stage) -> None:
    stage.send("a", wait(1))
    stage.send("c", wait(1), composition="APPEND")
    stage.send("b", wait(3), prependBefore="c")
    assert "c LURKING 3-4" in stage.log
    assert "c:start IN_EXEC 3" in stage.progress()


def test_prepend_before_delays_all_followers_too(stage: Stage) -> None:
    stage.send("a", wait(4))
    stage.send("c", composition="APPEND")
    stage.send("e", composition="APPEND")
    stage.send("d", wait(4), prependBefore="c")
    expected = ["d:end DONE 4", "c:start IN_EXEC 4", "c:end DONE 4", "e:start IN_EXEC 4", "e:end DONE 4"]
    assert stage.progress()[-5:] == expected


def test_chunk_before_waits_for_the_subsiding_only(stage: Stage) -> None:
    stage.send("a", wait(1))
    stage.send("c", wait(1), composition="APPEND")
    stage.send("b", smile(), chunkBefore="c")
    assert "c:start IN_EXEC 1.5" in stage.progress()


def test_prepend_before_of_a_started_block_is_refused(stage: Stage) -> None:
    stage.send("a", wait(1))
    assert stage.send("b", wait(1), prependBefore="a").failed
    assert "! b TargetBlockAlreadyStartedException" in stage.log
    assert not any(line.startswith("b:") for line in stage.progress())


def test_prepend_before_refuses_a_circle_of_dependencies(stage: Stage) -> None:
    stage.send("a", wait(1))
    stage.send("b", wait(1), composition="APPEND")
    assert stage.send("c", wait(1), appendAfter="b", prependBefore="b").failed
    assert "! c IMPOSSIBLE_TO_SCHEDULE" in stage.log


def test_append_chain_follows_when_the_first_block_is_stopped(stage: Stage) -> None:
    stage.send("a", smile(5))
    stage.send("b", wait(2), composition="APPEND")
    stage.send("c", wait(1), composition="APPEND")
    stage.player.stop(1.0, ["a"])
    stage.until(1.0)
    assert stage.log[-5:-1] == ["a:end INTERRUPTED 1", "b LURKING 1-3", "c LURKING 3-4", "b:start IN_EXEC 1"]
    assert stage.progress()[-3:] == ["b:end DONE 3", "c:start IN_EXEC 3", "c:end DONE 4"]


def test_external_reference_keeps_its_time_when_the_start_moves(stage: Stage) -> None:
    stage.send("a", wait(4))
    stage.send("m", '<head id="n" lexeme="NOD" stroke="5"/>')
    later = stage.send("b", '<head id="k" lexeme="NOD" stroke="m:n:stroke + 1"/>', appendAfter="a")
    assert later.start + later.at("k", "stroke") == pytest.approx(6.0)
    stage.player.stop(1.0, ["a"])
    moved = stage.player.latest(later)
    assert moved.start == 1.0
    assert moved.start + moved.at("k", "stroke") == pytest.approx(6.0)


# REPLACE and interrupt


def test_accept_moves_no_block_that_it_ends() -> None:
    stage = Stage()
    for id in "abcde":
        stage.send(id, wait(1), composition="APPEND")
    seen = len(stage.log)
    stage.send("x", wait(1), composition="REPLACE", at=0.5)
    ended = [line for line in stage.log[seen:] if ":end " in line]
    assert ended[:5] == ["a:end INTERRUPTED 0.5", *(f"{id}:end REVOKED 0.5" for id in "bcde")]


def test_replace_ends_playing_and_waiting_blocks_and_frees_their_ids(stage: Stage) -> None:
    stage.send("a", smile(5))
    stage.send("b", wait(1), composition="APPEND")
    stage.send("a", wait(1), composition="REPLACE", at=1.0)
    assert stage.progress() == [
        "a:start IN_EXEC 0",
        "a:end INTERRUPTED 1",
        "b:end REVOKED 1",
        "a:start IN_EXEC 1",
        "a:end DONE 2",
    ]


def test_replace_leaves_other_characters_alone(stage: Stage) -> None:
    stage.send("a", smile(5), characterId="Ann")
    stage.send("b", smile(5), characterId="Bob")
    stage.send("c", wait(1), composition="REPLACE", characterId="Ann", at=1.0)
    assert "b:end DONE 5" in stage.progress()


def test_replace_relaxes_the_face_without_a_jump(stage: Stage) -> None:
    stage.send("a", smile(5))
    stage.send("b", wait(1), composition="REPLACE", at=2.0)
    times = list(np.arange(1.9, 2.6, 0.001))
    face = stage.player.frames(np.array(times)).aus
    assert face[0].max() > 0.3
    assert face[-1].max() == 0.0
    assert np.abs(np.diff(face, axis=0)).max() < 0.01


def test_interrupt_attribute_ends_blocks_when_the_block_is_scheduled(stage: Stage) -> None:
    stage.send("a", smile(5))
    stage.send("b", smile(5))
    stage.send("c", wait(1), interrupt="a", at=1.0)
    progress = stage.progress()
    assert progress.index("a:end INTERRUPTED 1") < progress.index("c:start IN_EXEC 1")
    assert "b:end DONE 5" in progress


def test_interrupt_attribute_of_a_refused_block_ends_nothing(stage: Stage) -> None:
    stage.send("a", smile(5))
    stage.send("c", '<required><faceLexeme id="f" lexeme="NOTHING"/></required>', interrupt="a", at=1.0)
    assert "a:end DONE 5" in stage.progress()


# preplan


def test_preplan_waits_until_another_block_activates_it(stage: Stage) -> None:
    stage.send("p", smile(), preplan="true")
    assert "p PENDING 0-2" in stage.until(1.0)
    stage.send("a", wait(1), onStart="p", at=3.0)
    assert stage.progress() == ["a:start IN_EXEC 3", "p:start IN_EXEC 3", "a:end DONE 4", "p:end DONE 5"]


def test_preplan_delays_a_block_that_waits_for_it(stage: Stage) -> None:
    stage.send("p", wait(2), preplan="true")
    stage.send("b", wait(1), appendAfter="p")
    assert stage.progress() == []
    stage.send("a", wait(1), onStart="p", at=1.5e4)
    progress = [line for line in stage.progress() if line[0] == "b"]
    assert progress == ["b:start IN_EXEC 15002", "b:end DONE 15003"]


def test_preplan_does_not_delay_an_append(stage: Stage) -> None:
    stage.send("p", wait(2), preplan="true")
    stage.send("b", wait(1), composition="APPEND")
    assert "b:start IN_EXEC 0" in stage.progress()


def test_preplan_block_that_is_replaced_is_revoked(stage: Stage) -> None:
    stage.send("p", wait(2), preplan="true")
    stage.send("b", wait(1), composition="REPLACE", at=1.0)
    assert "p:end REVOKED 1" in stage.progress()


def test_on_start_of_an_unknown_block_warns(stage: Stage) -> None:
    stage.send("a", wait(1), onStart="nobody")
    assert "! a EXECUTION_FAILURE" in stage.until(9)


def test_accept_warns_of_attributes_that_name_unknown_blocks(stage: Stage) -> None:
    stage.send("a", wait(1))
    stage.send("b", wait(1), appendAfter="a", interrupt="a", at=2.0)  # it is over
    stage.send("c", wait(1), appendAfter="a,nobody", interrupt="none", at=3.0)
    assert [line for line in stage.until(9) if line[0] == "!"] == ["! c EXECUTION_FAILURE"] * 2
    assert stage.texts == [
        "interrupt: wanted a block, got 'none', of which nothing was heard",
        "appendAfter: wanted a block, got 'nobody', of which nothing was heard",
    ]


def test_preplan_block_is_planned_again_when_it_is_activated(stage: Stage) -> None:
    stage.send("p", gaze() + smile(), preplan="true")
    stage.send("a", gaze("h"), onStart="p", at=1.0)
    assert stage.until(9).count("! p:g CANNOT_CREATE_BEHAVIOR") == 1
    assert "p:end DONE 3" in stage.log


# arbitration


def test_claims_of_an_earlier_block_keep_its_gaze(stage: Stage) -> None:
    stage.send("a", gaze())
    schedule = stage.send("b", gaze("h") + smile(), at=1.0)
    assert list(schedule.times) == ["s"]
    assert "! b:h CANNOT_CREATE_BEHAVIOR" in stage.log
    assert "gaze" in stage.texts[0]
    assert "a:g" in stage.texts[0]


def spoken(text: str, more: str = "") -> str:
    return f'<speech id="s{text}"{more}><text>{text}</text></speech>'


def test_claims_let_speeches_without_times_follow_each_other(stage: Stage) -> None:
    schedule = stage.send("a", spoken("one") + spoken("two") + spoken("three"))
    assert schedule.at("stwo", "start") == schedule.at("sone", "end")
    assert schedule.at("sthree", "start") == schedule.at("stwo", "end")
    warnings = [line for line in stage.log if line[0] == "!"]
    assert warnings == ["! a:stwo IMPOSSIBLE_TO_SCHEDULE", "! a:sthree IMPOSSIBLE_TO_SCHEDULE"]
    assert "waits for sone" in stage.texts[0]


def test_claims_let_a_speech_wait_that_begins_before_the_end_of_another(stage: Stage) -> None:
    schedule = stage.send("a", spoken("one") + spoken("two-and-three-and-four", ' start="0.1"'))
    assert schedule.at("stwo-and-three-and-four", "start") == schedule.at("sone", "end")
    assert ["start = 0.1 was given up" in text for text in stage.texts] == [True]


def test_claims_drop_a_speech_inside_another(stage: Stage) -> None:
    schedule = stage.send("a", spoken("one-and-two-and-three-and-four") + spoken("five", ' start="0.1"'))
    assert list(schedule.times) == ["sone-and-two-and-three-and-four"]


def test_claims_within_a_block_follow_priority(stage: Stage) -> None:
    schedule = stage.send("a", gaze("g") + gaze("h").replace("<gaze", '<gaze bmla:priority="5"'))
    assert list(schedule.times) == ["h"]


def test_claims_of_a_required_gaze_win(stage: Stage) -> None:
    schedule = stage.send("a", gaze("g") + f"<required>{gaze('h')}</required>")
    assert list(schedule.times) == ["h"]


def test_claims_of_two_required_gazes_fail_their_block(stage: Stage) -> None:
    assert stage.send("a", f"<required>{gaze('g')}{gaze('h')}</required>").failed
    assert [line for line in stage.log if line[0] == "!"] == ["! a CANNOT_CREATE_BEHAVIOR"]


def test_claims_lost_are_named_with_the_lost_references(stage: Stage) -> None:
    nod = '<head id="n" lexeme="NOD" start="h:relax"/>'
    schedule = stage.send("a", gaze("g") + gaze("h") + nod)
    assert list(schedule.times) == ["g", "n"]
    assert "with it went n:start" in stage.texts[0]


def test_claims_lost_by_a_required_constraint_fail_the_block(stage: Stage) -> None:
    tie = '<required><constraint><after ref="h:end"><sync ref="g:end"/></after></constraint></required>'
    assert stage.send("a", gaze("g") + gaze("h") + tie).failed


def test_claims_of_two_characters_are_independent(stage: Stage) -> None:
    stage.send("a", gaze(), characterId="Ann")
    stage.send("b", gaze(), characterId="Bob")
    assert not stage.texts


def test_claims_end_with_the_relax_of_another_block(stage: Stage) -> None:
    stage.send("a", gaze())
    stage.send("b", gaze(), at=1.5)
    assert not stage.texts


# ids


def test_submit_refuses_an_id_in_use(stage: Stage) -> None:
    stage.send("a", smile())
    assert stage.send("a", smile(), at=1.0).failed
    stage.send("a", smile(), at=2.0)
    assert stage.progress().count("a:end DONE 4") == 1


@pytest.mark.slow
def test_append_of_hundreds_of_blocks_moves_together(stage: Stage) -> None:
    for n in range(400):
        stage.send(f"b{n}", wait(1), composition="APPEND")
    stage.player.stop(0.5, ["b0"])
    stage.until(0.5)
    ends = [line for line in stage.progress() if ":end" in line]
    assert ends[:2] == ["b0:end INTERRUPTED 0.5", "b1:end DONE 1.5"]
    assert ends[-1] == "b399:end DONE 399.5"


@pytest.mark.parametrize("said", [{"interrupt": "b"}, {"composition": "REPLACE"}])
@pytest.mark.parametrize("before", ["prependBefore", "chunkBefore"])
def test_prepend_before_that_ends_its_follower_leaves_it_ended(
    stage: Stage, said: dict[str, str], before: str
) -> None:
    stage.send("a", wait(0.5))
    stage.send("b", wait(0.5), composition="APPEND")
    assert not stage.send("c", wait(1), **said, **{before: "b"}).failed
    progress = stage.progress()
    assert "b:end REVOKED 0" in progress
    assert "c:end DONE 1" in progress
    assert not any(line.startswith("b:start") for line in progress)


def test_replace_refuses_the_id_of_another_characters_block(stage: Stage) -> None:
    stage.send("b", wait(0.5), characterId="Ann")
    stage.send("x", wait(0.5), characterId="Bob")
    assert stage.send("x", wait(1), composition="REPLACE", characterId="Ann").failed
    assert "still in use" in stage.texts[0]
    assert "x:end DONE 0.5" in stage.progress()


def test_interrupt_of_a_preplanned_block_holds_after_activation(stage: Stage) -> None:
    stage.send("p", wait(0.5) + wait(0.2, id="s"), preplan="true")
    stage.send("i", '<bmla:interrupt id="x" target="p" include="w"/>')
    stage.send("a", '<bmla:activate id="k" target="p"/>', at=1.0)
    assert "p:end DONE 1.2" in stage.progress()


def test_interrupt_of_a_wait_ends_it_at_once(stage: Stage) -> None:
    stage.send("a", wait(2) + wait(1, id="v"))
    stage.send("i", '<bmla:interrupt id="x" target="a" include="w" start="0.3"/>')
    assert "a:end DONE 1" in stage.progress()


# order of arrival, and conflicts at the start


def warnings(stage: Stage) -> list[str]:
    return [line for line in stage.until(99) if line[0] == "!"]


def interrupt(target: str, at: float) -> str:
    return f'<bmla:interrupt id="i" target="{target}" start="{at}"/>'


def test_claims_end_where_another_block_has_promised_to_interrupt(stage: Stage) -> None:
    stage.send("a", gaze())
    stage.send("p", interrupt("a", 1.0) + wait(5))
    stage.send("b", '<gaze id="g" target="y" start="1.2" end="3"/>', at=0.5)
    assert warnings(stage) == []


def test_claims_of_a_new_block_outlast_an_interrupt_of_its_namesake(stage: Stage) -> None:
    stage.send("a", gaze())
    stage.send("p", interrupt("a", 0.5) + wait(9))
    stage.send("a", gaze(), at=2.0)
    stage.send("b", gaze("h", "y"), at=2.5)
    assert warnings(stage) == ["! b:h CANNOT_CREATE_BEHAVIOR"]


def test_append_waits_for_blocks_that_were_announced_before(stage: Stage) -> None:
    stage.send("a", wait(2))
    late = parse(f'<bml id="b" {BMLA} composition="APPEND">{wait(1)}</bml>')
    stage.player.announce(late, 0.1)
    stage.send("c", wait(8), at=0.2)
    stage.player.submit(late, 0.3)
    assert "b:start IN_EXEC 2" in stage.until(99)


def test_waiting_block_loses_a_claim_only_when_it_starts(stage: Stage) -> None:
    stage.send("a", wait(1))
    stage.send("g", '<gaze id="g" target="x" start="0" relax="8" end="9"/>')
    stage.send("b", gaze("h", "y") + smile(), appendAfter="a")
    assert not [line for line in stage.log if line[0] == "!"]
    assert warnings(stage) == ["! b:h CANNOT_CREATE_BEHAVIOR"]
    assert stage.log.index("! b:h CANNOT_CREATE_BEHAVIOR") < stage.log.index("b:start IN_EXEC 1")


def test_waiting_block_that_requires_a_lost_claim_never_starts(stage: Stage) -> None:
    stage.send("a", wait(1))
    stage.send("g", '<gaze id="g" target="x" start="0" relax="8" end="9"/>')
    stage.send("b", f"<required>{gaze('h', 'y')}</required>", appendAfter="a")
    assert warnings(stage) == ["! b CANNOT_CREATE_BEHAVIOR"]
    assert "b:end REVOKED 1" in stage.log
    assert not any(line.startswith("b:start") for line in stage.log)


def test_constraint_that_was_dropped_binds_no_later_block(stage: Stage) -> None:
    unknown = '<constraint id="c"><before ref="x:s:end"><sync ref="w:end"/></before></constraint>'
    stage.send("a", wait(2) + unknown)
    stage.send("b", '<head id="n" lexeme="NOD" start="a:w:end"/>', at=0.1)
    assert warnings(stage) == ["! a:c IMPOSSIBLE_TO_SCHEDULE"]
    assert "b:start IN_EXEC 0.1" in stage.log


def test_constraint_is_reported_once_beside_a_lost_claim(stage: Stage) -> None:
    unknown = '<constraint id="c"><before ref="x:s:end"><sync ref="w:end"/></before></constraint>'
    stage.send("a", gaze())
    stage.send("b", gaze() + wait(2) + unknown)
    assert sorted(warnings(stage)) == ["! b:c IMPOSSIBLE_TO_SCHEDULE", "! b:g CANNOT_CREATE_BEHAVIOR"]


def test_waiting_block_reports_a_loss_of_what_had_a_warning_before(stage: Stage) -> None:
    stage.player.set_scene({"x": (0.1, 0.0, 1.0)})
    stage.send("a", gaze("g", "x"))
    stage.send("b", gaze("h", "nobody"), preplan="true")
    stage.send("c", '<bmla:activate id="i" target="b" start="0.5"/>')
    assert warnings(stage) == ["! b:h NO_SUCH_TARGET", "! b:h CANNOT_CREATE_BEHAVIOR"]


def test_forgotten_points_bind_a_playing_block_no_more(stage: Stage) -> None:
    stage.send("x", '<head id="n" lexeme="NOD" start="2"/>')
    stage.send("a", '<head id="n" lexeme="NOD" start="x:n:start+0.5"/>' + wait(12))
    stage.send("i", interrupt("x", 1.0))
    stage.until(8)
    assert stage.send("b", '<head id="n" lexeme="NOD" start="a:w:end"/>', at=8).at("n", "start") == 4.0
    assert not warnings(stage)


def test_revoked_block_is_not_refused_after_its_end(stage: Stage) -> None:
    late = parse(f'<bml id="b" {BMLA} bmla:prependBefore="nobody">{smile()}</bml>')
    stage.player.announce(late, 0.0)
    stage.send("a", wait(1), interrupt="b")
    assert stage.player.submit(late, 0.2).failed
    assert not warnings(stage)
    assert "b:end REVOKED 0" in stage.log


HELLO = "<text>Hello there my friend</text>"


@pytest.mark.parametrize("end", ["", 'end="2"'])
def test_speech_begins_in_the_closing_silence_of_its_own_block(stage: Stage, end: str) -> None:
    found = stage.send(
        "a", f'<speech id="s" {end}>{HELLO}</speech><speech id="t" start="s:end-0.1">{HELLO}</speech>'
    )
    assert not warnings(stage)
    assert found.at("t", "start") == pytest.approx(found.at("s", "end") - 0.1)
    assert "a:end DONE 2.42" in stage.log or end


def test_speech_in_a_silence_of_stated_end_causes_no_warning(stage: Stage) -> None:
    stage.send("a", f'<speech id="s" end="2">{HELLO}</speech>')
    stage.send("b", f'<speech id="t" start="0">{HELLO}</speech>', at=1.9)
    stage.send("c", '<head id="n" lexeme="NOD" start="a:s:end"/>', at=1.95)
    assert not warnings(stage)
    assert "a:end DONE 2" in stage.log
    assert "c:start IN_EXEC 1.95" in stage.log


def test_speech_tied_to_the_end_of_another_moves_it_not(stage: Stage) -> None:
    stage.send("a", f'<speech id="s">{HELLO}</speech>')
    found = stage.send("b", f'<speech id="t" start="a:s:end-0.2">{HELLO}</speech>', at=0.1)
    assert not warnings(stage)
    assert "a:end DONE 1.26" in stage.log
    assert found.at("t", "start") == pytest.approx(0.96)
