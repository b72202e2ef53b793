"""What the site draws from the code."""

from __future__ import annotations

from xml.etree import ElementTree

from docs.generator.states import PLACES, drawing
from realizer.playback.block_states import TRANSITIONS, State


def test_states_are_drawn_with_each_transition() -> None:
    assert set(PLACES) == set(State)
    root = ElementTree.fromstring(drawing())
    texts = [element.text for element in root.iter("{http://www.w3.org/2000/svg}text")]
    assert sorted(filter(None, texts)) == sorted([*State, *(event for _, event in TRANSITIONS)])
    assert len(list(root.iter("{http://www.w3.org/2000/svg}line"))) == len(TRANSITIONS) + 1
