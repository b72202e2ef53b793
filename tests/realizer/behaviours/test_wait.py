"""Tests of wait."""

from __future__ import annotations

import numpy as np
import pytest

from bml_schema import parse
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import KINDS
from realizer.playback.block_planner import plan
from tests.realizer.behaviours.elements import timing


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
