"""Tests of speech."""

from dataclasses import replace

import numpy as np
import pytest

from realizer.animation.channel import Layer
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import KINDS
from realizer.speech.utterance import Phoneme, SpeechRequest, Utterance
from tests.realizer.behaviours.elements import NOWHERE, at, check, expand, keys, node, timing


def spoken(duration: float, **marks: float) -> PlanningContext:
    phonemes = (Phoneme(0.1, 0.4, "m"), Phoneme(0.4, duration, "ɑː"))
    return PlanningContext(utterances={"x": Utterance(duration, (), phonemes, marks)})


def say(element: str, world: PlanningContext = NOWHERE) -> SpeechRequest:
    one = node(element)
    kind = KINDS[one.tag]
    assert kind.speech_request is not None
    said = kind.speech_request(one, world)
    assert said is not None
    return said


SPEECH = '<speech id="x"><text>A &lt;b&gt; &amp; <sync id="m"/>c<sync id="n"/></text>{}</speech>'


SSML = """<description priority="{}" type="application/ssml+xml"><speak xml:lang="de-DE"
    xmlns="http://www.w3.org/2001/10/synthesis">Eins &amp; <emphasis>zwei <mark name="m"/></emphasis>
    drei</speak></description>"""


def test_speech_moves_jaw_and_lips_by_its_attributes_or_the_settings() -> None:
    given = "xmlns:r='urn:bml-realizer:1' r:jaw='{}' r:lips='{}'"

    def moved(attributes: str, **settings: float) -> tuple[float, float]:
        world = replace(spoken(2.0), **settings)
        element = f"<speech id='x' {attributes}><text>ma</text></speech>"
        found = {c.target.name: np.abs(c.values).max() for c in expand(element, [0.0, 2.0], world)}
        return float(found["open_jaw"]), float(found["lower_t_midlip"])

    jaw, lips = moved("")
    assert moved(given.format(1, 1)) == moved(given.format(1, 1), jaw=0, lips=0) == (jaw, lips)
    assert moved(given.format(0.5, 1)) == moved("", jaw=0.5) == pytest.approx((0.5 * jaw, lips), rel=0.2)
    assert moved(given.format(1, 0.5)) == moved("", lips=0.5) == pytest.approx((jaw, 0.5 * lips), rel=0.2)


def test_speech_request_has_syncs_as_marks() -> None:
    assert say(SPEECH.format("")) == SpeechRequest(
        'A &lt;b&gt; &amp; <mark name="m"/>c<mark name="n"/>', ("m", "n"), "en-US"
    )
    assert say(SPEECH.format(""), PlanningContext(language="fr-FR")).language == "fr-FR"


def test_speech_request_takes_the_ssml_of_highest_priority() -> None:
    low = SSML.format(1).replace("Eins", "Null")
    said = say(SPEECH.format(low + SSML.format(3)))
    assert said.ssml.startswith("Eins &amp; <emphasis>zwei <mark name=")
    assert "xmlns" not in said.ssml
    assert said.marks == ("m",)
    assert said.language == "de-DE"


def test_speech_request_ignores_a_description_of_unknown_type() -> None:
    other = '<description priority="9" type="audio/x-unknown">nothing</description>'
    assert say(SPEECH.format(other)).marks == ("m", "n")


def test_speech_timing_is_rigid_with_syncs_at_their_times() -> None:
    wanted = timing(SPEECH.format(""), spoken(2.0, m=0.75, n=2.0))
    assert wanted.rigid
    assert wanted.points == ("start", "m", "n", "end")
    assert wanted.preferred.tolist() == [0.75, 1.25, 0.0]


def test_speech_timing_orders_syncs_by_time() -> None:
    wanted = timing(SPEECH.format(""), spoken(2.0, m=1.5, n=0.5))
    assert wanted.points == ("start", "n", "m", "end")


def test_speech_timing_places_a_sync_missing_in_the_ssml_by_its_text() -> None:
    wanted = timing(SPEECH.format(SSML.format(1)), spoken(4.0, m=1.0))
    assert wanted.points == ("start", "m", "n", "end")
    assert keys(wanted) == pytest.approx([0, 1, 4, 4])


def test_speech_timing_moves_marks_beyond_the_sound_to_its_ends() -> None:
    assert keys(timing(SPEECH.format(""), spoken(1.0, m=-0.1, n=1.2))).tolist() == [0, 0, 1, 1]


def test_speech_without_text_is_refused() -> None:
    (fault,) = check('<speech id="x"/>')
    assert fault.fatal
    assert "<text>" in fault.text


def test_speech_moves_the_lips_from_its_start_on() -> None:
    channels = expand(SPEECH.format(""), (3.0, 3.5, 4.0, 4.0), spoken(1.0))
    assert {channel.layer for channel in channels} == {Layer.SPEECH}
    assert {channel.source for channel in channels} == {"x"}
    assert at(channels, "lips", 2.9, 3.6) == [0, 1]


def test_check_explains_a_description_that_names_a_clip_wrongly() -> None:
    wrong = '<description priority="1" type="audio/x-clip">clip:c1</description>'
    (fault,) = check(f'<speech id="x"><text>Hello</text>{wrong}</speech>')
    assert not fault.fatal
    assert fault.text.startswith('wanted <bmlt:audiofile fileName="clip:ID"/> in its description, got a desc')
