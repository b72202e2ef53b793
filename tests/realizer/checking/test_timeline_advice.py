"""Tests of `realizer.checking.timeline_advice`."""

from __future__ import annotations

import pytest

from realizer.checking.timeline_advice import Companion, missing_companions, timeline_advice
from realizer.expressions.library import builtin
from realizer.expressions.timeline import Entry, Timeline, Track


def of(*entries: Entry, start: float = 1.0) -> Timeline:
    return Timeline((Track("a", entries, start=start),))


def companions(*names: str) -> list[Companion]:
    return list(missing_companions(of(*(Entry(f"template:{name}") for name in names)), builtin()))


def test_timeline_advice_names_the_entry_that_lasts_too_long() -> None:
    (advice,) = timeline_advice(of(Entry("smile"), Entry("template:surprise", duration=4.0)), builtin())
    assert (advice.id, advice.is_impossible) == ("channel a, entry 2", False)
    (advice, *_) = timeline_advice(of(Entry("template:grief", duration=6.0)), builtin())
    assert advice.is_impossible


def test_missing_companions_frame_astonishment_and_disgust() -> None:
    for name, other in (("astonishment", "surprise"), ("disgust", "anger")):
        (one,) = companions(name)
        length = builtin()[f"template:{name}"].duration
        assert (one.track, one.entry, one.expression, one.must) == (0, 0, f"template:{other}", True)
        assert (one.start, one.end) == pytest.approx((0.88, 1.12 + length))
        assert name in one.says


def test_missing_companions_come_before_happiness_and_after_disbelief() -> None:
    (before,) = companions("happiness")
    assert (before.expression, before.must) == ("template:surprise", False)
    assert before.start == pytest.approx(0.4)
    assert before.end > 1.0
    (after,) = companions("disbelief")
    assert after.expression == "template:anger"
    assert after.start > 1.0


def test_missing_companions_are_not_those_that_are_there() -> None:
    assert companions("surprise", "astonishment") == []
    assert companions("anger") == []
    assert [one.expression for one in companions("grief")] == ["template:surprise"]
    assert companions("grief", "regret") == []


def test_missing_companions_begin_at_0_at_the_earliest() -> None:
    (one,) = missing_companions(of(Entry("template:astonishment"), start=0.0), builtin())
    assert one.start == 0.0
    assert list(missing_companions(of(Entry("template:happiness"), start=0.0), builtin())) == []
