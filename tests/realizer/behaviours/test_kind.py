"""Tests of the interface of behaviours."""

from __future__ import annotations

import numpy as np

from bml_schema import Wait
from realizer.behaviours.kind import BehaviourKind, PlanningContext, claiming
from realizer.behaviours.table_timing import table_timing

WAIT = Wait(id="w")
CONTEXT = PlanningContext()


def test_behaviour_kind_has_the_tag_of_its_node() -> None:
    assert BehaviourKind(Wait, table_timing("wait")).tag == Wait.tag


def test_behaviour_kind_plays_nothing_by_default() -> None:
    kind = BehaviourKind(Wait, table_timing("wait"))
    assert kind.expand(WAIT, np.array([0.0, 1.0]), CONTEXT) == ()
    assert kind.check(WAIT, CONTEXT) == ()
    assert kind.claims(WAIT, CONTEXT) == frozenset()
    assert (
        kind.sound(WAIT, CONTEXT)
        is kind.stretch(WAIT, CONTEXT)
        is kind.speech_request
        is kind.command
        is None
    )


def test_claiming_needs_its_resource_always() -> None:
    assert claiming("voice")(WAIT, CONTEXT) == {"voice"}
