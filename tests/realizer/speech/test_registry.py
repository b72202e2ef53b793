"""The registry of voices, with and without their engines."""

import importlib.util
import subprocess
import sys

import pytest

from realizer.core.errors import UnknownVoiceError, VoiceError
from realizer.speech.espeak.voice import EspeakVoice
from realizer.speech.hibari.voice import HibariVoice
from realizer.speech.registry import VOICES, find_voice, voices

pytestmark = pytest.mark.xdist_group("voices")


def test_voices_are_listed_with_what_they_are() -> None:
    assert [voice.name for voice in voices()] == list(VOICES)
    assert all(voice.description for voice in voices())


def test_voices_that_are_missing_say_how_to_install_them(monkeypatch: pytest.MonkeyPatch) -> None:
    real = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "hibari" else real(name))
    listed = {voice.name: voice for voice in voices()}
    assert not listed["hibari"].available
    assert "pip install 'bml-realizer[neural]'" in listed["hibari"].description
    with pytest.raises(VoiceError, match=r"pip install 'bml-realizer\[neural\]'"):
        find_voice("hibari")


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        pytest.param("espeak:nl", EspeakVoice, marks=pytest.mark.espeak),
        pytest.param("hibari", HibariVoice, marks=pytest.mark.hibari),
    ],
)
def test_find_voice_starts_no_engine(name: str, kind: type) -> None:
    voice = find_voice(name)
    assert isinstance(voice, kind)
    assert (voice.name, getattr(voice, "pid", None)) == (name, None)


def test_voices_are_listed_without_an_engine() -> None:
    code = "import sys; from realizer.speech.registry import voices; voices(); print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert not {"hibari", "onnxruntime", "espeakng_loader"} & set(loaded.split())


def test_voices_have_descriptions() -> None:
    listed = {voice.name: voice for voice in voices()}
    assert {"espeak", "silent"} <= set(listed)
    assert listed["silent"].available
    assert all(len(voice.description) > 20 for voice in listed.values())


def test_find_voice_without_an_engine_is_silent(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, voice in VOICES.working():
        if name not in ("espeak", "hibari", "silent"):
            monkeypatch.setattr(voice, "missing", classmethod(lambda cls, variant=None: "pip install it"))
    monkeypatch.setattr(
        "realizer.speech.espeak.voice.install_hint", lambda: "pip install 'bml-realizer[speech]'"
    )
    monkeypatch.setattr("realizer.speech.hibari.voice.install_hint", lambda: None)
    assert find_voice(None).name == "hibari"
    monkeypatch.setattr(
        "realizer.speech.hibari.voice.install_hint", lambda: "pip install 'bml-realizer[neural]'"
    )
    assert find_voice(None).name == "silent"
    assert not voices()[0].available
    assert "pip install" in voices()[0].description
    with pytest.raises(VoiceError, match="pip install"):
        find_voice("espeak:nl")


@pytest.mark.espeak
def test_find_voice_prefers_sound() -> None:
    assert find_voice(None).name == "espeak"
    assert find_voice("espeak:en-gb+f3").name == "espeak:en-gb+f3"


def test_find_voice_refuses_an_unknown_name() -> None:
    with pytest.raises(UnknownVoiceError, match=f"wanted one of {', '.join(VOICES)}, got 'hal'"):
        find_voice("hal")
    with pytest.raises(UnknownVoiceError, match=r"got 'expeak:nl', did you mean espeak\?"):
        find_voice("expeak:nl")


@pytest.mark.parametrize("name", ["espeak-ng:nl", pytest.param("hibari-tts", marks=pytest.mark.hibari)])
def test_find_voice_takes_the_name_of_an_engine(name: str) -> None:
    assert find_voice(name).name == name.replace("-ng", "").replace("-tts", "")


def test_find_voice_refuses_a_variant_of_a_voice_that_has_none() -> None:
    with pytest.raises(UnknownVoiceError, match="voice silent: wanted nothing after its name, got 'loud'"):
        find_voice("silent:loud")
