"""Tests of speech synthesis for blocks."""

from __future__ import annotations

import pytest

from bml_schema import Block, parse
from realizer.behaviours.registry import VOCABULARY
from realizer.core.errors import VoiceError
from realizer.core.options import PlayOptions
from realizer.playback.player import Player
from realizer.playback.speaking import (
    open_voice,
    stretch_to_fit,
    submit_with_speech,
    synthesize,
    without_stretch,
)
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import SpeechRequest, Utterance

TEXT = "This is said at its own pace."


class CountingVoice(SilentVoice):
    """A silent voice that counts its requests; a broken one refuses them."""

    def __init__(self, broken: bool = False) -> None:
        self.requests: list[SpeechRequest] = []
        self.broken = broken
        self.closed = False

    def say(self, request: SpeechRequest) -> Utterance:
        self.requests.append(request)
        if self.broken:
            raise VoiceError("the voice is broken")
        return super().say(request)

    def close(self) -> None:
        self.closed = True


def block(attributes: str = "") -> Block:
    return parse(f'<bml id="b"><speech id="s" {attributes}><text>{TEXT}</text></speech></bml>', VOCABULARY)


def test_submit_with_speech_speaks_once_where_all_fits() -> None:
    voice = CountingVoice()
    schedule = submit_with_speech(Player(PlayOptions(idle=False)), block(), voice)
    assert len(voice.requests) == 1
    assert schedule.at("s", "end") == pytest.approx(SilentVoice().say(voice.requests[0]).duration)


def test_submit_with_speech_speaks_again_at_the_length_that_fits() -> None:
    natural = submit_with_speech(Player(PlayOptions(idle=False)), block(), SilentVoice()).at("s", "end")
    wanted = 1.15 * natural
    fixed = block(f'start="0" end="{wanted}"')
    voice = CountingVoice()
    schedule = submit_with_speech(Player(PlayOptions(idle=False)), fixed, voice)
    assert len(voice.requests) > 1
    assert schedule.at("s", "end") == pytest.approx(wanted, abs=1e-6)


def test_synthesize_takes_silence_and_a_warning_where_the_voice_fails() -> None:
    requests = Player().speech_requests(block())
    (spoken,) = synthesize(requests, CountingVoice(broken=True)).values()
    assert spoken.pcm is None
    assert spoken.duration > 0
    assert any("broken" in str(warning) for warning in spoken.warnings)


def test_synthesize_takes_silence_where_the_voice_of_a_plugin_raises(monkeypatch) -> None:
    voice = CountingVoice()
    monkeypatch.setattr(voice, "say", lambda request: 1 / 0)
    (spoken,) = synthesize(Player().speech_requests(block()), voice).values()
    assert any("the voice failed: ZeroDivisionError" in str(warning) for warning in spoken.warnings)


def test_without_stretch_is_not_spoken_again() -> None:
    (spoken,) = synthesize(Player().speech_requests(block()), SilentVoice()).values()
    assert without_stretch(spoken).stretch == (1.0, 1.0)


def test_open_voice_leaves_an_open_voice_open() -> None:
    voice = CountingVoice()
    with open_voice(voice) as opened:
        assert opened is voice
    assert not voice.closed


def test_open_voice_refuses_a_name_that_is_not_installed() -> None:
    with pytest.raises(VoiceError, match="nobody"), open_voice("nobody"):
        pass


def test_stretch_to_fit_fixes_utterances_without_a_planned_length() -> None:
    spoken = SilentVoice().say(SpeechRequest(TEXT))
    points = {"start": 0.0, "end": 1.1 * spoken.duration}
    fits = stretch_to_fit({"a": spoken, "b": spoken}, {"a": points})
    assert fits["a"].duration == pytest.approx(points["end"])
    assert fits["b"].duration == spoken.duration
    assert fits["b"].stretch == (1.0, 1.0)
