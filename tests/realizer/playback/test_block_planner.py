"""Tests of the planning of one block."""

from __future__ import annotations

from bisect import bisect_left

import pytest

from bml_schema import parse
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import KINDS, VOCABULARY
from realizer.offline import realize
from realizer.playback.block_planner import Plan, plan
from realizer.speech.silent import SilentVoice
from tests.worst_documents import document


def planned(content: str, world: PlanningContext = PlanningContext()) -> Plan:  # noqa: B008 - a frozen value
    return plan(parse(f'<bml id="b">{content}</bml>', VOCABULARY), KINDS, world)


def test_plan_expands_every_scheduled_behaviour() -> None:
    made = planned('<head id="h" lexeme="NOD"/><gesture id="g" lexeme="BEAT"/>')
    assert set(made.schedule.times) == set(made.channels) == {"h", "g"}
    assert made.channels["h"]
    assert made.channels["g"] == (), "a face shows no gesture"


def test_plan_warns_once_of_a_parser_problem_with_its_place() -> None:
    (warning,) = planned('<head id="h" lexeme="NOD" amount="7"/>').schedule.warnings
    assert (warning.id, warning.type) == ("b:h", "PARSING_FAILURE")
    assert warning.text.count("line 1") == 1


def test_plan_drops_a_behaviour_with_a_fatal_fault() -> None:
    made = planned('<faceLexeme id="f" lexeme="SMIRKLE"/><head id="h" lexeme="NOD"/>')
    (warning,) = made.schedule.warnings
    assert warning.id == "b:f"
    assert warning.text.startswith("line 1, /bml/faceLexeme[1]: lexeme: ")
    assert set(made.channels) == {"h"}


def test_plan_keeps_a_behaviour_with_an_unknown_target() -> None:
    made = planned('<gaze id="g" target="cupp"/>', PlanningContext(scene={"cup": (0.1, 0.0, 0.5)}))
    assert [w.type for w in made.schedule.warnings] == ["NO_SUCH_TARGET"]
    assert made.channels["g"]


def test_plan_fails_for_a_required_fault_with_one_warning() -> None:
    made = planned('<required><faceLexeme id="f" lexeme="SMIRKLE"/></required><head id="h" lexeme="NOD"/>')
    assert made.schedule.failed
    assert [w.id for w in made.schedule.warnings] == ["b"]
    assert made.channels == {}


SPEECH = '<speech id="s"{}><text>one two <sync id="m"/>three four</text></speech>'


def natural() -> float:
    return realize(f'<bml id="b">{SPEECH.format("")}</bml>', voice=SilentVoice()).schedules[0].end


@pytest.mark.parametrize("ratio", [0.7, 1.5])
def test_plan_stretches_a_speech_if_nothing_else_fits(ratio: float) -> None:
    end = natural() * ratio
    said = SPEECH.format(f' start="0" end="{end}"')
    played = realize(f'<bml id="b">{said}</bml>', voice=SilentVoice())
    assert not played.warnings
    assert played.schedules[0].at("s", "end") == pytest.approx(end)
    assert played.speech[0][1].duration == pytest.approx(end)


def test_plan_leaves_a_speech_if_others_can_stretch() -> None:
    face = '<faceLexeme id="f" lexeme="SMILE" start="s:start" attackPeak="s:m" end="s:end"/>'
    played = realize(f'<bml id="b">{SPEECH.format("")}{face}</bml>', voice=SilentVoice())
    assert played.schedules[0].at("s", "end") == pytest.approx(natural())


def test_plan_gives_up_the_end_of_a_speech_that_would_be_too_fast() -> None:
    said = SPEECH.format(f' start="0" end="{natural() * 0.3}"')
    played = realize(f'<bml id="b">{said}</bml>', voice=SilentVoice())
    assert [w.id for w in played.warnings] == ["b:s"]
    (_, utterance) = played.speech[0]
    assert utterance.duration == pytest.approx(natural())


def test_plan_stretches_two_speeches_tied_at_both_ends() -> None:
    both = (
        '<speech id="s"><text>one two three</text></speech>'
        '<speech id="t" start="s:end + 0.1" end="4"><text>four five six seven</text></speech>'
    )
    played = realize(f'<bml id="b">{both}</bml>', voice=SilentVoice())
    assert not played.warnings
    assert played.schedules[0].at("t", "end") == pytest.approx(4.0)


@pytest.mark.parametrize("mark", [0.5, 0.7])
@pytest.mark.parametrize("voice", ["silent", pytest.param("espeak", marks=pytest.mark.espeak)])
def test_plan_stretches_a_speech_tied_at_a_mark_to_the_rate_that_fits(mark: float, voice: str) -> None:
    tie = f'<constraint><synchronize><sync ref="s:m"/><sync ref="{mark}"/></synchronize></constraint>'
    text = '<speech id="s" start="0"><text>hello my <sync id="m"/> dear friend of mine</text></speech>'
    played = realize(f'<bml id="b">{text}<required>{tie}</required></bml>', voice=voice)
    assert not played.warnings
    assert played.schedules[0].at("s", "m") == pytest.approx(mark)
    assert played.speech[0][1].marks["m"] == pytest.approx(mark)


@pytest.mark.parametrize("pattern", ["linked", "impossible", "squeezed", "overlapping", "free"])
def test_plan_refuses_a_block_that_takes_too_many_steps(pattern: str) -> None:
    block = parse(document(pattern, 40), VOCABULARY)

    def limited(steps: int) -> Plan:
        return plan(block, KINDS, PlanningContext(max_planning=steps))

    def fits(steps: int) -> bool:
        return not limited(steps).schedule.over_limit

    needed = bisect_left(range(1_000_000), True, key=fits)
    assert 100 < needed < 1_000_000
    assert limited(needed).schedule.behaviours == limited(10**9).schedule.behaviours
    refused = limited(needed - 1)
    assert refused.schedule.failed
    assert not refused.channels
    (warning,) = refused.schedule.warnings
    assert (warning.id, warning.type) == ("worst", "IMPOSSIBLE_TO_SCHEDULE")
    assert f"wanted at most {needed - 1} steps" in warning.text
    assert "REALIZER_MAX_PLANNING" in warning.text
