"""Tests of realizations."""

import json

import numpy as np
import pytest

from realizer import realize
from realizer.core.errors import RealizerError
from realizer.examples import examples
from realizer.playback.scheduled_speech import ScheduledSpeech
from realizer.realization import MAX_FRAMES, frames_until
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import Phoneme, Utterance

HELLO = examples()["greeting"]


def test_frame_times_reach_from_0_to_the_end() -> None:
    played = realize(HELLO, voice=SilentVoice(), fps=30)
    assert played.frames == int(played.duration * 30 + 1e-6) + 1
    assert played.faps.values.shape == (played.frames, 68)
    assert played.aus.times[1] == pytest.approx(1 / 30)


def test_to_json_has_every_part() -> None:
    out = json.loads(json.dumps(realize(HELLO, voice=SilentVoice()).to_json()))
    assert {"fps", "frames", "duration", "face", "schedule", "fap", "au", "feedback", "warnings"} <= set(out)
    assert len(out["fap"]["names"]) == len(out["fap"]["mask"]) == 68
    assert len(out["fap"]["values"]) == len(out["au"]["values"]) == out["frames"]
    assert all(isinstance(v, int) for v in out["fap"]["values"][0])
    assert all(0 <= v <= 1 for row in out["au"]["values"] for v in row)
    assert len(out["visemes"]["names"]) == 15
    assert [sum(row) for row in out["visemes"]["values"]] == pytest.approx([1] * out["frames"], abs=0.01)
    assert out["schedule"][0]["block"] == "greeting"
    assert out["feedback"][0].startswith("<predictionFeedback")


def test_sound_is_mixed_at_its_time() -> None:
    played = realize('<bml id="b"><wait id="w" duration="2"/></bml>', idle=False)
    tone = Utterance(0.5, (), (), {}, 8000, np.full(4000, 1000, np.int16))
    object.__setattr__(
        played, "speeches", (ScheduledSpeech(1.0, float("inf"), tone, 0), ScheduledSpeech(1.2, 1.3, tone, 0))
    )
    sound = played.sound(16000)
    assert len(sound) == 32000
    assert sound[:16000].max() == 0
    assert sound[int(1.1 * 16000)] == 1000
    assert sound[int(1.25 * 16000)] == 2000
    assert sound[int(1.4 * 16000)] == 1000


def test_with_first_shows_another_character_with_its_speech() -> None:
    text = '<bml id="{0}" characterId="{0}"><speech id="s"><text>{1}</text></speech></bml>'
    said = text.format("Ada", "No.") + text.format("Ben", "That is a long sentence.")
    played = realize(said, voice=SilentVoice(), idle=False)
    ben = played.with_first("Ben")
    assert list(ben.characters) == ["Ben", "Ada"]
    assert np.array_equal(ben.faps.values, played.characters["Ben"].faps.values)
    assert np.array_equal(ben.visemes(0), played.visemes(1))
    assert np.array_equal(ben.visemes(1), played.visemes(0))
    with pytest.raises(ValueError, match="character: wanted one of Ada, Ben, got 'Bob'"):
        played.with_first("Bob")


def test_visemes_are_those_of_their_character_until_a_cut() -> None:
    played = realize('<bml id="b"><wait id="w" duration="2"/></bml>', idle=False, fps=50)
    vowel = Utterance(1.0, (), (Phoneme(0.0, 1.0, "ɑ"),), {})
    object.__setattr__(
        played,
        "speeches",
        (ScheduledSpeech(0.5, float("inf"), vowel, 1), ScheduledSpeech(1.0, 1.4, vowel, 0)),
    )
    said = played.visemes()
    assert (said[:51, 0] == 1).all()
    assert said[65, 10] > 0.9
    assert (said[77:, 0] == 1).all()
    assert played.visemes(1)[50, 10] > 0.9


def test_frames_until_has_a_limit() -> None:
    assert frames_until(2.0, 25) == 51
    with pytest.raises(RealizerError, match=rf"wanted at most {MAX_FRAMES} frames, got 900001 of 36000 s"):
        frames_until(36000, 25)
