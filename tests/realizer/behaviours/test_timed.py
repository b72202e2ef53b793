"""Tests of behaviours that are timed, and not shown on a face."""

import numpy as np
import pytest

from bml_schema import parse
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import KINDS
from realizer.playback.block_planner import plan
from tests.realizer.behaviours.elements import ELEMENTS, expand, timing

COMMANDS = {
    "interrupt": '<bmla:interrupt id="i" target="b:none" {sync}/>',
    "activate": '<bmla:activate id="i" target="none" {sync}/>',
    "change": '<bmla:parametervaluechange id="i" target="b:w" paramId="amount" {sync}>'
    '<bmla:trajectory type="linear" targetValue="1"/></bmla:parametervaluechange>',
}


@pytest.mark.parametrize("name", ["activate", "change"])
def test_block_control_is_instant_without_an_end(play, name: str) -> None:
    wait = '<wait id="w" duration="4"/>'
    assert play(wait + COMMANDS[name].format(sync='start="w:start+1"')).times("i") == {"start": 1, "end": 1}
    long = play(wait + COMMANDS[name].format(sync='start="1" end="w:end"')).times("i")
    assert long == pytest.approx({"start": 1, "end": 4}, abs=1e-4)


@pytest.mark.parametrize("element", [e for e in ELEMENTS if e.startswith(("<ge", "<po", "<lo", "<wa"))])
def test_body_behaviours_move_no_face(element: str) -> None:
    assert expand(element) == ()


def test_wait_lasts_its_duration_or_nothing() -> None:
    assert timing('<wait id="x" duration="1.5"/>').preferred.tolist() == [1.5]
    assert timing('<wait id="x"/>').preferred.tolist() == [0]


def test_wait_keeps_its_duration_and_stretches_what_is_tied_to_it() -> None:
    nod = '<bml id="b"><head id="n" lexeme="NOD"/>{}</bml>'
    tied = '<wait id="w" start="n:start" end="n:end" {}/>'

    def length(wait: str) -> float:
        times = plan(parse(nod.format(wait)), KINDS, PlanningContext()).schedule.times["n"]
        return float(np.ptp(times))

    alone = length("")
    for duration in (0.8 * alone, 1.3 * alone, 3 * alone):
        assert length(tied.format(f'duration="{duration}"')) == pytest.approx(duration, rel=0.02)
    assert length(tied.format("")) == pytest.approx(alone, rel=0.05)


@pytest.mark.parametrize(
    ("syncs", "says"),
    [
        ('start="0" end="1"', "it is 1 s shorter"),
        ('start="0" end="w:start + 5"', "it is 3 s longer"),
        ('start="x:start" end="x:start + 1"', "it is 1 s shorter"),
        ('start="0" end="2"', ""),
        ('start="0"', ""),
        ('start="x:start" end="x:end"', ""),  # both can move
    ],
)
def test_wait_that_states_another_duration_than_its_times_has_a_warning(play, syncs: str, says: str) -> None:
    played = play(f'<wait id="w" duration="2" {syncs}/><wait id="x" duration="2"/>')
    assert played.times("w")
    assert [id for id, _ in played.warnings] == ["b:w"] * bool(says)
    assert not says or says in played.warnings_text
