"""Tests of the registry of behaviours, and of all behaviours by it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import VOCABULARY as CORE
from realizer.animation.channel import Layer
from realizer.animation.curves import sample
from realizer.behaviours.registry import KINDS, VOCABULARY
from tests.realizer.behaviours.elements import ELEMENTS, check, expand, keys, node, timing


def test_kinds_cover_every_core_element() -> None:
    # Other behaviours have their class in their own module, or in a plug-in.
    assert {tag: VOCABULARY.get(tag) for tag in CORE} == dict(CORE)
    assert set(KINDS) == set(VOCABULARY)


@pytest.mark.parametrize("element", ELEMENTS)
def test_kinds_have_the_sync_points_of_the_standard_and_positive_gaps(element: str) -> None:
    one, wanted = node(element), timing(element)
    assert [p for p in wanted.points if ":" not in p] == list(one.sync_points)
    assert np.all(wanted.preferred >= wanted.least)
    assert np.all(wanted.least >= 0)
    assert np.all(wanted.stiffness > 0)
    assert not check(element)


@pytest.mark.parametrize("element", ELEMENTS)
def test_kinds_expand_to_channels_that_start_at_rest_and_end_there_or_hold(element: str) -> None:
    times = keys(timing(element))
    for channel in expand(element):
        assert channel.source == "x"
        assert channel.times[0] >= times[0]
        assert channel.times[-1] == times[-1]
        assert channel.values[0] == 0
        assert channel.keeps_last == (KINDS[node(element).tag].region is not None)
        assert channel.values[-1] == 0 or channel.keeps_last
        assert (channel.layer is Layer.BASE) == channel.keeps_last


@pytest.mark.parametrize("element", ELEMENTS)
@given(gaps=st.lists(st.sampled_from([0.0, 0.001, 0.3, 5.0]), min_size=12, max_size=12))
def test_kinds_expand_any_rising_times_to_finite_keys(element: str, gaps: list[float]) -> None:
    count = len(timing(element).points)
    for channel in expand(element, np.cumsum(gaps[:count]).tolist()):
        assert np.all(np.diff(channel.times) >= 0)
        assert np.all(np.isfinite(channel.values))
        assert np.all(np.isfinite(sample([channel], np.linspace(0, 60, 100))))
