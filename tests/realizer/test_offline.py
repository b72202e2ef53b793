"""Tests of realize and schedule."""

import inspect
import wave
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from bml_schema import BMLError, parse
from realizer import realize, schedule
from realizer.behaviours.registry import VOCABULARY
from realizer.core.options import PlayOptions
from realizer.playback.player import Player
from realizer.playback.speaking import submit_with_speech
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import SpeechRequest
from tests.cases import CASES
from tests.rows import each_row

NOD = '<bml id="b"><head id="n" lexeme="NOD"/></bml>'


def test_realize_has_the_options_of_playing_with_their_defaults() -> None:
    parameters = inspect.signature(realize).parameters
    options = {name: p.default for name, p in parameters.items() if name not in ("source", "voice", "plain")}
    assert options == {f.name: f.default for f in fields(PlayOptions)}


def test_realize_takes_one_text_or_several() -> None:
    one, two = realize(NOD, idle=False), realize([NOD, NOD.replace('"b"', '"c"')], idle=False)
    assert (len(one.schedules), len(two.schedules)) == (1, 2)


def test_realize_plays_a_recording_and_finds_it_beside_a_document(tmp_path: Path) -> None:
    said = SilentVoice().say(SpeechRequest("Hello there"))
    pcm = (8000 * np.sin(np.arange(round(22050 * said.duration)) / 30)).astype("<i2")
    with wave.open(str(tmp_path / "talk.wav"), "wb") as file:
        file.setparams((1, 2, 22050, len(pcm), "NONE", ""))
        file.writeframes(pcm.tobytes())
    audio = '<audiofile xmlns="http://hmi.ewi.utwente.nl/bmlt" id="a" fileName="talk.wav"/>'
    (tmp_path / "talk.bml").write_text(f'<bml id="b">{audio}</bml>')
    for source in (tmp_path / "talk.wav", tmp_path / "talk.bml"):
        played = realize(source, idle=False)
        assert not played.warnings
        assert played.duration == pytest.approx(len(pcm) / 22050, abs=0.01)
        assert np.abs(played.sound()).max() > 7000
    assert realize(tmp_path / "talk.wav").aus.aus.any()


def test_realize_refuses_a_rate_that_is_not_above_0() -> None:
    with pytest.raises(ValueError, match="fps: wanted a number above 0, got 0"):
        realize(NOD, fps=0)


def test_schedule_has_the_times_that_realize_plays() -> None:
    (played,) = realize(NOD, idle=False).schedules
    assert schedule(NOD).behaviours == played.behaviours


@each_row("case", CASES[::12])
def test_schedule_is_what_a_player_plays(case) -> None:
    try:
        block = parse(case.document, VOCABULARY)
    except BMLError:
        with pytest.raises(BMLError):
            schedule(case.document)
        return
    voice = SilentVoice()
    played = submit_with_speech(Player(PlayOptions()), block, voice)
    scheduled = schedule(case.document, voice=voice)
    assert scheduled.to_json() == played.to_json()
    assert (scheduled.cost, scheduled.failed, scheduled.late) == (played.cost, played.failed, played.late)


def test_schedule_reads_dialects_unless_it_is_strict() -> None:
    draft = '<bml id="b"><head id="n" type="NOD"/></bml>'
    assert schedule(draft).behaviours == schedule(NOD).behaviours
    assert not schedule(draft, strict_bml=True).behaviours


def test_schedule_refuses_a_document_without_a_block() -> None:
    with pytest.raises(BMLError, match="id"):
        schedule("<bml/>")


def test_realize_speaks_a_text(tmp_path: Path) -> None:
    (block,) = realize("Hello there", voice="silent").schedules
    assert block.at("speech", "end") > 0.3
    (tmp_path / "x.bml").write_text(NOD)
    assert realize(tmp_path / "x.bml").schedules[0].block == "b"


@each_row(
    "text, left_out",
    [
        ("```\nonly code\n```", "a block of code is not spoken"),
        ("*clears throat*", "the stage direction 'clears throat' is not known"),
        ("*", "nothing in the text can be spoken"),
        ("...", "nothing in the text can be spoken"),
    ],
)
def test_realize_names_what_is_left_out_of_a_text_without_words(text: str, left_out: str) -> None:
    played = realize(text, voice="silent")
    assert played.plays_nothing
    assert left_out in played.warnings[0].text


def test_realize_names_what_is_left_out_beside_a_behaviour() -> None:
    played = realize("[nod]\n```\ncode\n```", voice="silent")
    assert not played.plays_nothing
    assert "a block of code is not spoken" in played.warnings[0].text


@pytest.mark.parametrize("source", ["<bml/>", "", ["<bml id='b'><oops", "<bml/>"], b"\x89\x01\0"])
def test_realize_refuses_a_source_without_a_document(source: str | bytes | list[str]) -> None:
    with pytest.raises(BMLError) as error:
        realize(source)
    assert error.value.line == 1


def test_realize_plays_the_rest_of_a_broken_source() -> None:
    played = realize(["<bml/>", NOD], idle=False)
    assert len(played.schedules) == len(played.refusals) == 1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"fps": "25"}, "fps: wanted a number, got '25'"),
        ({"face": 3}, "face: wanted the name or the path of a face"),
        ({"idle": 1}, "idle: wanted True or False"),
        ({"seed": 1.5}, "seed: wanted an integer"),
        ({"scene": ["ball"]}, "scene: wanted a mapping"),
        ({"voice": 3}, "voice: wanted the name of a voice"),
        ({"colour": "red"}, "colour"),
    ],
)
def test_realize_refuses_other_types(options: dict[str, object], words: str) -> None:
    with pytest.raises(TypeError, match=words):
        realize(NOD, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"face": "adda"}, "face: wanted one of ada, ben"),
        ({"voice": "nobody"}, "voice: wanted one of"),
        ({"deformer": "x"}, "deformer: wanted mpeg4 or au"),
        ({"liveliness": 2}, "liveliness: wanted a number 0..1"),
        ({"scene": {"ball": (1, 2)}}, "scene: wanted x, y, z of ball"),
    ],
)
def test_realize_refuses_unknown_names_and_numbers(options: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        realize(NOD, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["face", "media", "expressions", "mapping", "cooccurrence"])
def test_realize_reports_missing_files(name: str) -> None:
    with pytest.raises(FileNotFoundError, match="no/such"):
        realize(NOD, **{name: "no/such"})  # type: ignore[arg-type]


def test_schedule_names_the_syncs_that_there_are() -> None:
    with pytest.raises(KeyError, match="n:strok: wanted a sync point of n: start, "):
        schedule(NOD).at("n", "strok")
    with pytest.raises(ValueError, match="wanted one document"):
        schedule([NOD, NOD])  # type: ignore[arg-type]
