"""Tests of base states and direct values of a character."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer import tables
from realizer.animation.axis import au, axis
from realizer.animation.blend import blend
from realizer.animation.channel import Channel, Layer
from realizer.animation.fap.conversion import to_fap
from realizer.playback.character import BaseShift, Character

SMILE = au(12, "LEFT")[0]
HEAD = au(51)[0]


def shift(begin: float, end: float, value: float, target=SMILE, region: str = "face") -> BaseShift:
    channel = Channel(
        target, np.array([begin, end]), np.array([0.0, value]), layer=Layer.BASE, keeps_last=True
    )
    return BaseShift.of(begin, end, region, (channel,))


def shown(character: Character, time: float, target=SMILE) -> float:
    return float(blend(character.channels(), np.array([time])).values[0, target.column])


def test_shift_holds_until_the_next_of_its_region() -> None:
    ann = Character("Ann")
    ann.add_shifts([shift(0, 1, 0.6)])
    ann.add_shifts([shift(5, 6, 0.2)])
    assert [shown(ann, t) for t in (0, 1, 4, 5, 6, 50)] == pytest.approx(
        [0, 0.6, 0.6, 0.6, 0.2, 0.2], abs=1e-6
    )


def test_shift_of_another_region_leaves_it_alone() -> None:
    ann = Character("Ann")
    ann.add_shifts([shift(0, 1, 0.6), shift(2, 3, 0.5, HEAD, "head")])
    assert shown(ann, 10) == pytest.approx(0.6)
    assert shown(ann, 10, HEAD) == pytest.approx(0.5)


def test_cancel_drops_a_shift_that_has_not_begun() -> None:
    ann = Character("Ann")
    begun, waiting = shift(0, 1, 0.6), shift(5, 6, 0.2)
    ann.add_shifts([begun, waiting])
    ann.cancel([begun, waiting], now=0.5)
    assert shown(ann, 50) == pytest.approx(0.6)


def test_forget_changes_nothing_visible() -> None:
    ann = Character("Ann")
    ann.add_shifts([shift(i, i + 0.5, 0.1 + 0.01 * i) for i in range(20)])
    before = [shown(ann, t) for t in (18.7, 19.2, 30)]
    ann.forget(18.6)
    assert len(ann.shifts) == 2
    assert [shown(ann, t) for t in (18.7, 19.2, 30)] == before


def test_set_direct_holds_and_an_unknown_name_changes_nothing() -> None:
    ann = Character("Ann")
    ann.set_direct({"12L": 0.8, "open_jaw": 200.0}, now=1.0)
    assert shown(ann, 9.0) == pytest.approx(0.8)
    with pytest.raises(KeyError):
        ann.set_direct({"12L": 0.1, "nose_flute": 1.0}, now=2.0)
    assert shown(ann, 9.0) == pytest.approx(0.8)
    ann.set_direct({"12L": None}, now=3.0)
    assert shown(ann, 9.0) == pytest.approx(0, abs=1e-9)


ASKED = (
    ("direct", {"12L": 0.2}),
    ("direct", {"raise_l_cornerlip": 150.0, "open_jaw": 90.0}),
    ("direct", {"4L": 1.0, "raise_l_i_eyebrow": -40.0}),
    ("emotion", {"12L": 0.9, "12R": 0.9, "1L": 0.5, "open_jaw": 30.0}),
)


@given(st.permutations(ASKED), st.floats(1.0, 2.0))
def test_set_direct_and_set_emotion_do_not_depend_on_their_order(
    order: list[tuple[str, dict[str, float]]], now: float
) -> None:
    times = np.linspace(0.0, 4.0, 101)
    shown = []
    for some in (ASKED, order):
        ann = Character(None)
        for kind, values in some:
            getattr(ann, f"set_{kind}")(values, now)
        shown.append(to_fap(blend(ann.channels(), times)).values)
    np.testing.assert_allclose(shown[0], shown[1], atol=1e-3)
    last = dict(zip((row.name for row in tables.faps()), shown[1][-1], strict=True))
    assert last["raise_l_cornerlip"] == 150
    assert last["open_jaw"] == 90
    assert last["raise_l_i_eyebrow"] == -40
    assert last["raise_r_cornerlip"] > 50


@given(st.lists(st.tuples(st.floats(0.0, 0.5), st.none() | st.floats(-300, 300)), min_size=1, max_size=6))
def test_set_direct_never_jumps(
    steps: list[tuple[float, float | None]],
) -> None:
    """A message does not change the frame at its own time."""
    ann = Character(None)
    ann.set_emotion({"12L": 0.8}, 0.0)
    now = 1.0
    for wait, value in steps:
        now += wait
        before = to_fap(blend(ann.channels(), np.array([now]))).values
        ann.set_direct({"raise_l_cornerlip": value}, now)
        after = to_fap(blend(ann.channels(), np.array([now, now + 1e-4]))).values
        np.testing.assert_allclose(after[:1], before, atol=0.1)
        np.testing.assert_allclose(after[1:], before, atol=1.5)


def test_set_direct_at_0_hides_the_mood_while_it_changes() -> None:
    ann = Character(None)
    ann.set_emotion({"12L": 0.8}, 0.0)
    ann.set_direct({"12L": 0.0}, 1.0)
    ann.set_direct({"12L": 0.3}, 2.0)
    course = blend(ann.channels(), np.linspace(2.0, 3.0, 101)).values[:, axis()["12L"].column]
    assert course[0] == 0
    assert course.max() <= 0.3 + 1e-6
