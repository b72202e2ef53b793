"""Runs of text with one prosody."""

from __future__ import annotations

from realizer.speech.hibari.text import ProsodyRun, runs
from realizer.speech.ssml import read_script
from realizer.speech.ssml_prosody import Prosody
from realizer.speech.utterance import SpeechRequest


def test_runs_end_at_breaks_and_where_prosody_changes() -> None:
    ssml = (
        'a <mark name="m"/>b <break time="1s"/>c <prosody rate="slow"> d</prosody> <sub alias="e f">x</sub>.'
    )
    found, marks = runs(read_script(SpeechRequest(ssml)))
    assert [(r.text.strip(), r.words, r.prosody.rate, r.pause) for r in found] == [
        ("a b", ("a", "b"), 1.0, 0.0),
        ("c", ("c",), 1.0, 1.0),
        ("d", ("d",), 0.75, 0.0),
        ("e f.", ("e", "f"), 1.0, 0.0),
    ]
    assert [(m.name, m.word, m.paused) for m in marks] == [("m", 1, False)]
    assert runs(read_script(SpeechRequest('a<break time="1s"/>')))[0][-1] == ProsodyRun(
        "", (), Prosody(), 1.0
    )


def test_runs_place_marks_before_and_after_breaks() -> None:
    ssml = 'a <mark name="m"/><break time="1s"/><mark name="n"/>b'
    _, marks = runs(read_script(SpeechRequest(ssml)))
    assert [(m.name, m.word, m.paused) for m in marks] == [("m", 1, True), ("n", 1, False)]


def test_runs_nest_prosody() -> None:
    ssml = 'a <prosody rate="fast">b <prosody volume="50">c</prosody> d</prosody> e'
    found, _ = runs(read_script(SpeechRequest(ssml)))
    assert [(r.words, r.prosody.rate, r.prosody.volume) for r in found] == [
        (("a",), 1.0, 1.0),
        (("b",), 1.4, 1.0),
        (("c",), 1.4, 0.5),
        (("d",), 1.4, 1.0),
        (("e",), 1.0, 1.0),
    ]
