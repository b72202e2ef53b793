"""Tests of planned blocks on the session clock."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from bml_schema import parse
from realizer.animation.channel import Gain
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import KINDS
from realizer.playback.block_planner import plan
from realizer.playback.placed_block import PlacedBlock
from realizer.playback.scheduled_speech import SPEECH_FADE
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import SpeechRequest, Utterance
from tests.rows import each_row

FACE = '<faceLexeme id="s" lexeme="SMILE" start="0" attackPeak="0.5" relax="2" end="3"/>'


def placed(
    inside: str = FACE, start: float = 10.0, utterances: Mapping[str, Utterance] | None = None
) -> PlacedBlock:
    context = PlanningContext(utterances=utterances or {})
    planned = plan(parse(f'<bml id="a">{inside}</bml>'), KINDS, context, start=start)
    made = PlacedBlock(planned, KINDS, context, character=0)
    made.apply_plan(planned, start, start)
    return made


def test_apply_plan_at_another_start_moves_channels_claims_and_ends() -> None:
    made = placed('<gaze id="g" target="x" start="0" ready="0.5" relax="1" end="2"/>')
    (claim,) = made.plan.claims
    assert (claim.begin, claim.end, made.schedule.end) == (10.0, 11.0, 12.0)
    made.apply_plan(made.plan, 20.0, 12.0)
    (claim,) = made.plan.claims
    assert (claim.begin, claim.end, made.schedule.end) == (20.0, 21.0, 22.0)
    assert {c.span[0] for c in made.moving_channels()} == {20.0}
    assert {motion.known for motion in made.known_motions()} == {12.0}


@each_row(
    "inside, wants, plays",
    [
        (FACE, True, True),
        ('<wait id="w" duration="1"/>', False, False),
        ('<head id="h" lexeme="NODD"/>', True, False),
        ('<head id="h" lexeme="NOD" amount="0"/>', True, False),
        ('<faceLexeme id="f" lexeme="SMILE" amount="0"/>', True, False),
        ('<gaze id="g" target="x" influence="EYES"/>', True, True),
        ('<wait id="w" duration="1"/><faceLexeme id="f" lexeme="NOSUCH"/>', True, False),
        ('<postureShift id="p"><stance type="SITTING"/></postureShift>', True, False),
    ],
)
def test_plays_something_that_moves_the_face(inside: str, wants: bool, plays: bool) -> None:
    made = placed(inside)
    assert (made.wants, made.plays) == (wants, plays)


def test_apply_plan_that_moves_nothing_keeps_since_when_it_is_known() -> None:
    made = placed()
    made.apply_plan(made.plan, 10.0, 5.0)
    assert {motion.known for motion in made.known_motions()} == {10.0}


def test_placed_block_shows_nothing_before_its_start_is_known() -> None:
    made = placed()
    made.apply_plan(made.plan, float("inf"), 10.0)
    assert not list(made.moving_channels())
    assert made.schedule.end == float("inf")


@pytest.mark.parametrize(
    ("at", "points", "times"),
    [
        (9.0, None, None),
        (10.2, ("start", "relax", "end"), [0.0, 0.2, 0.5]),
        (11.0, ("start", "attackPeak", "relax", "end"), [0.0, 0.5, 1.0, 1.3]),
        (12.9, ("start", "attackPeak", "relax", "end"), [0.0, 0.5, 2.0, 3.0]),
        (13.5, ("start", "attackPeak", "relax", "end"), [0.0, 0.5, 2.0, 3.0]),
    ],
)
def test_cut_keeps_past_points_then_relaxes_and_ends(
    at: float, points: tuple[str, ...] | None, times: list[float] | None
) -> None:
    made = placed()
    made.cut(["s"], at)
    assert made.schedule.points.get("s") == points
    if times is not None:
        assert list(made.schedule.times["s"]) == pytest.approx(times)


def test_cut_removes_behaviours_that_have_not_begun() -> None:
    made = placed()
    made.cut(["s"], 10.0)
    assert not any(c.span[0] < c.span[1] for c in made.moving_channels())
    assert made.schedule.end == 10.0


def test_cut_fades_the_lips_of_a_speech_that_has_not_begun() -> None:
    spoken = SilentVoice().say(SpeechRequest("Five six"))
    made = placed('<speech id="s" start="1"><text>Five six</text></speech>', utterances={"s": spoken})
    lips = {c.target for c in made.moving_channels() if c.span[0] < 10.95}
    assert lips
    made.cut(["s"], 10.95)
    fading = {c.target: c.span for c in made.moving_channels() if c.gains}
    assert set(fading) == lips
    assert max(last for _, last in fading.values()) == pytest.approx(10.95 + SPEECH_FADE)
    assert "s" not in made.schedule.times
    assert not made.speech["s"].is_heard


def test_cut_ends_the_named_behaviours_only() -> None:
    made = placed(FACE + FACE.replace('"s"', '"t"'))
    made.cut(["s"], 11.0)
    assert made.unfinished(12.0) == {"t"}
    assert made.schedule.end == 13.0


def test_scale_changes_channels_or_sound() -> None:
    made = placed()
    made.scale("s", [Gain(10.0, 11.0, 0.5)], sound=False)
    assert all(c.gains for c in made.moving_channels())
    made.scale("s", [Gain(10.0, 11.0, 0.5)], sound=True)  # a smile has no sound
    assert not made.speech
