"""Tests of wait."""

from __future__ import annotations

from tests.realizer.behaviours.elements import timing


def test_wait_lasts_its_duration_or_nothing() -> None:
    assert timing('<wait id="x" duration="1.5"/>').preferred.tolist() == [1.5]
    assert timing('<wait id="x"/>').preferred.tolist() == [0]
