"""Tests of `realizer.expressions.timeline`."""

from __future__ import annotations

from realizer.expressions.library import builtin
from realizer.expressions.timeline import Entry, Timeline, Track, faults_of, remarks
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
