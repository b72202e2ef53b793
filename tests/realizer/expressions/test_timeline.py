"""Tests of `realizer.expressions.timeline`."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.expressions.library import builtin
from realizer.expressions.timeline import (
    Entry,
    Timeline,
    Track,
    duration_of,
    faults_of,
    remarks,
    spans,
    visible_spans,
)
from realizer.face.load import input_names


def test_faults_of_unknown_names_but_not_of_breaks() -> None:
    track = Track("a", (Entry("nobody"), Entry("NEUTRAL"), Entry("smiel")))
    first, second = faults_of(Timeline((track,)), builtin())
    assert first.startswith("channel a, entry 1, expression: wanted a name")
    assert second.endswith("got 'smiel', did you mean SMILE?")


TRACK = Track("a", (Entry("smile"),))


def test_remarks_are_empty_if_the_face_supports_the_mixer() -> None:
    assert remarks(Timeline((TRACK,)), input_names(deformer="mpeg4")) == []
    assert remarks(Timeline((TRACK,), "successive", (4, 1)), input_names(deformer="au")) == []
    assert remarks(Timeline((TRACK,), "successive", (4, 1))) == []


def test_remarks_name_settings_without_effect() -> None:
    (remark,) = remarks(Timeline((TRACK,), "successive", (4,)), input_names(deformer="mpeg4"))
    assert remark.startswith("mixer: no effect, FAPs move this face; wanted")
    (remark,) = remarks(Timeline((TRACK,), "additive", (4,)), input_names(deformer="au"))
    assert remark == 'order: no effect, a sum has no order; wanted mixer = "successive"'
    (remark,) = remarks(Timeline((TRACK,), "successive", (43, 4, 8)), input_names(deformer="au"))
    assert remark.startswith("order: no effect on 43, 8, which this face does not mix")


def test_spans_have_the_duration_of_the_expression_by_default() -> None:
    (span,) = spans(Track("a", (Entry("smile"),)), builtin())
    smile = builtin()["SMILE"]
    assert span.reached == pytest.approx(smile.onset)
    assert span.end - span.left == pytest.approx(smile.offset)
    assert duration_of(Timeline((Track("a", (Entry("smile"),), start=1.0),)), builtin()) == pytest.approx(
        1 + smile.duration
    )


NAMES = [*builtin(), "neutral"]


@given(
    entries=st.lists(
        st.tuples(st.sampled_from(NAMES), st.one_of(st.none(), st.floats(0.04, 9))), min_size=1, max_size=6
    ),
    joins=st.sampled_from(["both", "onset", "offset"]),
    start=st.floats(0, 5),
)
def test_spans_have_rising_times(entries, joins, start: float) -> None:
    track = Track(
        "a", tuple(Entry(name, 1.0, duration) for name, duration in entries), joins, "linear", start
    )
    shown = spans(track, builtin())
    times = [start]
    for span in shown:
        assert span.start == pytest.approx(times[-1]) or span.start <= span.reached
        assert span.start - 1e-9 <= span.reached <= span.left + 1e-9
        assert span.left <= span.end + 1e-9
        times.append(span.end)
    for one, other in pairwise(shown):
        assert one.end == pytest.approx(other.start)


def test_visible_spans_begin_and_end_in_the_middle_of_transitions() -> None:
    track = Track("a", (Entry("template:surprise", 1.0, 1.0), Entry("neutral"), Entry("smile")))
    one, other = visible_spans(Timeline((track,)), builtin())
    assert one.place == "channel a, entry 1"
    assert (one.expression.name, other.expression.name) == ("template:surprise", "SMILE")
    assert (one.begin, one.end) == pytest.approx((0.15, 0.75))
    assert (other.track, other.entry, other.times.entry) == (0, 2, track.entries[2])


def test_spans_take_the_onset_and_offset_of_an_entry() -> None:
    apex = builtin()["smile"].apex
    one, _, other = spans(
        Track("a", (Entry("smile", onset=0.2, offset=0.7), Entry("neutral"), Entry("smile", 1.0, 3.0, 1.0))),
        builtin(),
    )
    assert (one.reached, one.left, one.end) == pytest.approx((0.2, 0.2 + apex, 0.9 + apex))
    assert (other.reached - other.start, other.end - other.start) == pytest.approx((1.0, 3.0))
