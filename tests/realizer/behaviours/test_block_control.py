"""Tests of behaviours that act on other blocks."""

from __future__ import annotations

import pytest

ELEMENTS = {
    "interrupt": '<bmla:interrupt id="i" target="b:none" {sync}/>',
    "activate": '<bmla:activate id="i" target="none" {sync}/>',
    "change": '<bmla:parametervaluechange id="i" target="b:w" paramId="amount" {sync}>'
    '<bmla:trajectory type="linear" targetValue="1"/></bmla:parametervaluechange>',
}


@pytest.mark.parametrize("name", ["activate", "change"])
def test_block_control_is_instant_without_an_end(play, name: str) -> None:
    wait = '<wait id="w" duration="4"/>'
    assert play(wait + ELEMENTS[name].format(sync='start="w:start+1"')).times("i") == {"start": 1, "end": 1}
    long = play(wait + ELEMENTS[name].format(sync='start="1" end="w:end"')).times("i")
    assert long == pytest.approx({"start": 1, "end": 4}, abs=1e-4)
