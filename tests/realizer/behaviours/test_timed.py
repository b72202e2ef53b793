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
