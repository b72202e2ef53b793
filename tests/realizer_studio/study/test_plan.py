"""Tests of `realizer_studio.study.plan`."""

from __future__ import annotations

from collections import Counter

import pytest

from realizer_studio.study.drawing import Variant
from realizer_studio.study.plan import Plan


def test_plan_counts_what_it_draws() -> None:
    two = (Variant("ada"), Variant("ben"))
    assert Plan(("visual", "emotional"), two).drawn == 2 * Plan(("visual",), two[:1]).drawn


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.long
def test_items_of_one_seed_are_the_same() -> None:
    plan = Plan(("naming", "visual"), (Variant("ada"),), "ben", most=4, seed=3)
    one, two = plan.items(), plan.items()
    assert Counter(item.kind for item in one if not item.check) == {"visual": 4, "naming": 4}
    assert Counter(item.kind for item in one if item.check) == {"visual": 2, "naming": 2}
    assert [item.truth for item in one] == [item.truth for item in two]
    assert [item.options for item in one] == [item.options for item in two]
