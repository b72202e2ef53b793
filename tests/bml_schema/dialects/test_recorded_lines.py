"""Tests of SmartBody's recorded lines, as VHBuilder and NVBG write them."""

from __future__ import annotations

import numpy as np
import pytest

import realizer
from bml_schema import Block, FaceKeyframe, Speech, parse, read
from bml_schema.nodes import RECORDED
from realizer.animation.axis import AU_NAMES
from realizer.speech.silent import SilentVoice

LINE = """<?xml version="1.0" encoding="utf-8"?>
<bml>
  <speech id="sp1" start="{start}" ready="0.1" stroke="0.1" relax="0.2" end="0.2">
    <text><sync id="T0" time="0"/>Good <sync id="T1" time="0.3"/><sync id="T2" time="0.4"/>day there
    <sync id="T3" time="0.9"/></text>
    <description level="1" type="audio/x-wav"><file ref="talk"/></description>
  </speech>
  {more}
</bml>"""


def line(more: str = "", start: str = "0.0") -> str:
    return LINE.format(more=more, start=start)


def only(text: str) -> Block:
    (block,) = read(text)
    assert isinstance(block, Block), block
    return block


def recorded(block: Block, id: str = "sp1") -> str:
    (found,) = [d.content for d in block[id].descriptions if d.type == RECORDED]
    return found


def test_recorded_line_keeps_the_times_of_its_words() -> None:
    block = only(line())
    assert '<word end="0.3" start="0">Good</word>' in recorded(block).replace(
        'start="0" end="0.3"', 'end="0.3" start="0"'
    )
    assert "day there" in recorded(block)
    assert [str(ref) for ref in block["sp1"].syncs.values()] == ["0"]
    speech = block["sp1"]
    assert isinstance(speech, Speech)
    assert any('fileName="talk"' in d.content for d in speech.descriptions)
    (problem,) = block.problems
    assert problem.text.startswith("read as SmartBody's BML: <sync time> as the times of the words")


def test_recorded_line_without_its_sound_is_spoken_at_its_times() -> None:
    played = realizer.realize(line(start="1"), voice=SilentVoice())
    (schedule,) = played.schedules
    assert schedule["sp1"] == pytest.approx(
        {"start": 1, "T0": 1, "T1": 1.3, "T2": 1.4, "T3": 1.9, "end": 1.9}
    )
    (_, utterance) = played.speech[0]
    assert [(w.text, w.start, w.end) for w in utterance.words] == [("Good", 0, 0.3), ("day there", 0.4, 0.9)]
    assert sum(bool(p.ipa) for p in utterance.phonemes) > 4


def test_visemes_of_a_recorded_line_move_the_lips() -> None:
    lips = (
        '<lips viseme="BMP" articulation="1.0" start="1" ready="1" relax="1.2" end="1.2"/>'
        '<lips viseme="Ao" start="1.2" end="1.5"/><lips viseme="zork" start="1.5" end="1.6"/>'
        '<lips viseme="D" start="x" end="1.9"/>'
    )
    played = realizer.realize(line(lips, start="1"), voice=SilentVoice())
    (_, utterance) = played.speech[0]
    assert [(p.ipa, p.start, p.end) for p in utterance.phonemes[:2]] == [
        ("m", 0, pytest.approx(0.2)),
        ("ɔ", pytest.approx(0.2), pytest.approx(0.5)),
    ]
    texts = " ".join(warning.text for warning in played.warnings)
    assert "visemes without a mouth shape: zork" in texts
    assert '<lips viseme="D">' in texts


def test_visemes_alone_are_a_speech_without_sound() -> None:
    played = realizer.realize(
        '<bml id="b"><lips viseme="BMP" start="0.5" end="0.7"/><lips viseme="Ao" start="0.7" end="1"/></bml>',
        voice=SilentVoice(),
    )
    assert not played.plays_nothing
    (_, utterance) = played.speech[0]
    assert [p.ipa for p in utterance.phonemes] == ["", "m", "ɔ"]
    assert utterance.duration == pytest.approx(1)


def value(played: realizer.Realization, unit: str, at: float) -> float:
    frame = round(at * played.fps)
    return float(played.aus.aus[frame, list(AU_NAMES()).index(unit)])


def test_curves_move_action_units_head_and_eyes() -> None:
    curves = (
        '<curves><curve name="au_12_left" num_keys="3" owner="analysis">0 0 0 0 1 0.8 0 0 2 0 0 0</curve>'
        '<curve name="Head_Pitch" num_keys="3">0 0 1 20 2 0</curve>'
        '<curve name="Gaze Eye Yaw" num_keys="3">0 0 1 -20 2 0</curve>'
        '<curve name="foo" num_keys="2">0 1 2 2</curve><curve name="au_1">0 x</curve></curves>'
    )
    played = realizer.realize(f'<bml id="b">{curves}</bml>', voice=SilentVoice(), idle=False, fps=100)
    assert value(played, "12L", 1) == pytest.approx(0.8, abs=0.02)
    assert value(played, "12R", 1) == 0
    assert value(played, "54", 1) == pytest.approx(0.5, abs=0.02)  # 20 of 40 degrees down
    assert value(played, "62", 1) == pytest.approx(0.5, abs=0.02)  # 20 of 40 degrees to the right
    assert value(played, "61", 1) == 0
    (text,) = [w.text for w in played.warnings]
    assert '<curve name="foo">' in text
    assert '<curve name="au_1">' in text


def test_curves_of_two_columns_and_of_four_are_read_alike() -> None:
    two = only('<bml id="b"><curves><curve name="au_4" num_keys="2">0 0 1 0.5</curve></curves></bml>')
    four = only(
        '<bml id="b"><curves><curve name="au_4" num_keys="2">0 0 9 9 1 0.5 9 9</curve></curves></bml>'
    )
    assert isinstance(two["curve1"], FaceKeyframe)
    assert two.behaviours == four.behaviours


def test_sides_of_action_units_and_modes_of_saccades_are_read() -> None:
    block = only(
        '<bml id="b"><face id="f" type="facs" au="45_left"/><face id="g" type="facs" au="12_both"/>'
        '<saccade id="s" mode="listen"/><saccade id="t" finish="true"/><saccade id="u" direction="90"/></bml>'
    )
    assert (block["f"].au, block["f"].side) == (45, "LEFT")  # type: ignore[attr-defined]
    assert block["g"].side == "BOTH"  # type: ignore[attr-defined]
    assert (block["s"].eyes, block["t"].eyes) == ("LISTENING", "WAITING")  # type: ignore[attr-defined]
    assert block["u"].tag.endswith("gaze")


def test_lines_without_times_stay_as_they_are() -> None:
    block = only('<bml id="b"><speech id="s"><text>Hello <sync id="m"/>there</text></speech></bml>')
    assert not block["s"].descriptions
    assert not block.problems
    assert np.isfinite(realizer.schedule('<bml id="b"><lips/></bml>', voice="silent").duration)


@pytest.mark.parametrize(
    "text",
    [
        "Good <sync id='T1' time='99999'/>day",
        "Good <sync id='T1' time='0.3'/>day <sync id='T2' time='0.6'/>",
        "<sync id='T0' time='0'/>Good <sync id='T1' time='0.5'/>day <sync id='T2' time='0.1'/>",
        "<sync id='T0' time='0'/>Good <sync id='T1' time='abc'/>day<sync id='T2' time='1'/>",
        "<sync id='T0' time='0'/>Good <sync id='T1' time='0'/>day<sync id='T2' time='0'/>",
        "<sync id='T0' time='-3'/>Good <sync id='T1' time='0.5'/>day<sync id='T2' time='1'/>",
    ],
)
def test_times_that_cannot_be_those_of_all_words_are_given_up_and_named(text: str) -> None:
    block = parse(f"<bml id='b'><speech id='s'><text>{text}</text></speech></bml>")
    (speech,) = block.behaviours
    assert isinstance(speech, Speech)
    assert speech.text is not None
    assert (
        " ".join("".join(part for part in speech.text.parts if isinstance(part, str)).split()) == "Good day"
    )
    assert not [form for form in speech.descriptions if form.type == RECORDED]
    assert "without <sync time=" in block.problems[0].text


def test_lips_too_short_for_the_words_are_given_up_and_named() -> None:
    lips = "<lips viseme='BMP' articulation='1' start='0' end='0.07'/>"
    block = parse(f"<bml id='b'><speech id='s'><text>Good day to you</text></speech>{lips}</bml>")
    (speech,) = block.behaviours
    assert isinstance(speech, Speech)
    assert not [form for form in speech.descriptions if form.type == RECORDED]
    assert 'without <lips viseme="BMP">' in block.problems[0].text
