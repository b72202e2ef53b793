"""What a timeline asks for that a library or a face does not have."""

from __future__ import annotations

from realizer.expressions.library import builtin
from realizer.expressions.timeline import Entry, Timeline, Track, faults_of, remarks
from realizer.face.load import input_names


def test_names_that_nobody_knows_are_faults_and_breaks_are_not() -> None:
    track = Track("a", (Entry("nobody"), Entry("NEUTRAL"), Entry("smiel")))
    first, second = faults_of(Timeline((track,)), builtin())
    assert first.startswith("channel a, entry 1, expression: wanted a name")
    assert second.endswith("got 'smiel', did you mean SMILE?")


TRACK = Track("a", (Entry("smile"),))


def test_what_the_mixer_of_a_face_can_do_needs_no_remark() -> None:
    assert remarks(Timeline((TRACK,)), input_names(deformer="mpeg4")) == []
    assert remarks(Timeline((TRACK,), "successive", (4, 1)), input_names(deformer="au")) == []
    assert remarks(Timeline((TRACK,), "successive", (4, 1))) == []


def test_a_choice_without_effect_is_told_in_a_sentence() -> None:
    (told,) = remarks(Timeline((TRACK,), "successive", (4,)), input_names(deformer="mpeg4"))
    assert told.startswith("mixer: no effect, FAPs move this face; wanted")
    (told,) = remarks(Timeline((TRACK,), "additive", (4,)), input_names(deformer="au"))
    assert told == 'order: no effect, a sum has no order; wanted mixer = "successive"'
    (told,) = remarks(Timeline((TRACK,), "successive", (43, 4, 8)), input_names(deformer="au"))
    assert told.startswith("order: no effect on 43, 8, which this face does not mix")
