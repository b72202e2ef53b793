"""Tests of `realizer_studio.study.items`."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from realizer_studio.study.drawing import Drawer, Variant
from realizer_studio.study.items import ANSWERS, EMOTIONS, checks, displacements, naming
from tests.studies import matches


def test_checks_demand_an_answer_that_the_key_holds() -> None:
    found = checks(matches(60), np.random.default_rng(1))
    assert len(found) == 3
    assert all(one.check in ANSWERS["visual"] and one.truth == {"check": one.check} for one in found)
    assert len(checks(matches(3), np.random.default_rng(1))) == 2


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.long
def test_naming_and_displacements_are_as_many_as_published() -> None:
    with Drawer() as draw:
        named = list(naming([Variant("ada")], draw))
        moved = list(displacements([Variant("ada")], draw))
    assert Counter(one.truth["emotion"] for one in named) == dict.fromkeys(EMOTIONS, 6)
    assert len({one.shown["face"] for one in named}) == 30  # three published profiles are as printed
    assert len(moved) == 127
    assert {one.truth["fap"] for one in moved} == set(range(3, 69))
    still = {one.truth["fap"] for one in moved if not one.truth["moves"]}
    assert len(still) < 10, "most displacements can be seen"
    assert all(set(one.shown) == {"neutral", "moved", "difference"} for one in moved)
