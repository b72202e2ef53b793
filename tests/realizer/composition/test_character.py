"""Base states take over from one another, and what a client sets holds until it lets go."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.animation.blend import blend
from realizer.animation.channel import Channel, Layer
from realizer.animation.targets import au
from realizer.composition.character import Character, Shift

SMILE = au(12, "LEFT")[0]
HEAD = au(51)[0]


def shift(begin: float, end: float, value: float, target=SMILE, region: str = "face") -> Shift:
    channel = Channel(target, np.array([begin, end]), np.array([0.0, value]), layer=Layer.BASE, holds=True)
    return Shift.of(begin, end, region, (channel,))


def shown(character: Character, time: float, target=SMILE) -> float:
    return float(blend(character.channels(), np.array([time])).values[0, target.column])


def test_a_shift_holds_until_the_next_of_its_region() -> None:
    ann = Character("Ann")
    ann.shift([shift(0, 1, 0.6)])
    ann.shift([shift(5, 6, 0.2)])
    assert [shown(ann, t) for t in (0, 1, 4, 5, 6, 50)] == pytest.approx(
        [0, 0.6, 0.6, 0.6, 0.2, 0.2], abs=1e-6
    )


def test_a_shift_of_another_region_leaves_it_alone() -> None:
    ann = Character("Ann")
    ann.shift([shift(0, 1, 0.6), shift(2, 3, 0.5, HEAD, "head")])
    assert shown(ann, 10) == pytest.approx(0.6)
    assert shown(ann, 10, HEAD) == pytest.approx(0.5)


def test_a_shift_that_has_not_begun_can_be_cancelled() -> None:
    ann = Character("Ann")
    begun, waiting = shift(0, 1, 0.6), shift(5, 6, 0.2)
    ann.shift([begun, waiting])
    ann.cancel([begun, waiting], now=0.5)
    assert shown(ann, 50) == pytest.approx(0.6)


def test_forgetting_changes_nothing_that_can_still_be_seen() -> None:
    ann = Character("Ann")
    ann.shift([shift(i, i + 0.5, 0.1 + 0.01 * i) for i in range(20)])
    before = [shown(ann, t) for t in (18.7, 19.2, 30)]
    ann.forget(18.6)
    assert len(ann.shifts) == 2
    assert [shown(ann, t) for t in (18.7, 19.2, 30)] == before


def test_what_is_set_holds_and_an_unknown_name_changes_nothing() -> None:
    ann = Character("Ann")
    ann.set_direct({"12L": 0.8, "open_jaw": 200.0}, now=1.0)
    assert shown(ann, 9.0) == pytest.approx(0.8)
    with pytest.raises(KeyError):
        ann.set_direct({"12L": 0.1, "nose_flute": 1.0}, now=2.0)
    assert shown(ann, 9.0) == pytest.approx(0.8)
    ann.set_direct({"12L": None}, now=3.0)
    assert shown(ann, 9.0) == pytest.approx(0, abs=1e-9)
