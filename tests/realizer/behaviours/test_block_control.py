"""Tests of behaviours that act on other blocks."""

from __future__ import annotations

import pytest

from bml_schema import parse
from realizer.behaviours.kind import Activate, Change, Interrupt
from realizer.behaviours.registry import KINDS, VOCABULARY

BMLA = 'xmlns:bmla="http://www.asap-project.org/bmla"'


def act(element: str) -> Interrupt | Activate | Change:
    (node,) = parse(f'<bml id="b" {BMLA}>{element}</bml>', VOCABULARY).behaviours
    does = KINDS[node.tag].command
    assert does is not None
    return does(node)


@pytest.mark.parametrize(
    ("element", "does"),
    [
        ('<bmla:interrupt id="i" target="a"/>', Interrupt("a")),
        ('<bmla:interrupt id="i" target="a" include="x,y"/>', Interrupt("a", frozenset("xy"))),
        ('<bmla:interrupt id="i" target="a" exclude="z"/>', Interrupt("a", None, frozenset("z"))),
        ('<bmla:activate id="i" target="a"/>', Activate("a")),
    ],
)
def test_command_names_its_target(element: str, does: Interrupt | Activate) -> None:
    assert act(element) == does


@pytest.mark.parametrize(
    ("sync", "type", "curve"),
    [
        ("", "linear", None),
        ('start="1"', "linear", None),
        ('start="1" end="3"', "linear", "linear"),
        ('end="3"', "linear", "linear"),
        ('start="1" end="3"', "instant", None),
    ],
)
def test_change_is_even_only_with_an_end(sync: str, type: str, curve: str | None) -> None:
    change = act(
        f'<bmla:parametervaluechange id="p" target="a:x" paramId="volume" {sync}>'
        f'<bmla:trajectory type="{type}" initialValue="20" targetValue="90"/></bmla:parametervaluechange>'
    )
    assert change == Change("a", "x", "volume", to=90, initial=20, curve=curve)


def test_change_without_an_initial_value_starts_where_it_is() -> None:
    change = act(
        '<bmla:parametervaluechange id="p" target="a:x" paramId="amount">'
        '<bmla:trajectory type="instant" targetValue="1"/></bmla:parametervaluechange>'
    )
    assert change == Change("a", "x", "amount", to=1)


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
