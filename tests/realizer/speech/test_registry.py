"""The list of voices, with and without what they need."""

from __future__ import annotations

import importlib.util
import subprocess
import sys

import pytest

from realizer.core.errors import VoiceError
from realizer.speech.espeak.voice import EspeakVoice
from realizer.speech.hibari.voice import HibariVoice
from realizer.speech.registry import find_voice, voices


def test_voices_are_listed_with_what_they_are() -> None:
    assert [voice.name for voice in voices()] == ["espeak", "hibari", "silent"]
    assert all(voice.says for voice in voices())


def test_a_voice_that_is_not_installed_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    real = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "hibari" else real(name))
    listed = {voice.name: voice for voice in voices()}
    assert not listed["hibari"].available
    assert "pip install 'bml-realizer[neural]'" in listed["hibari"].says
    with pytest.raises(VoiceError, match=r"pip install 'bml-realizer\[neural\]'"):
        find_voice("hibari")


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        pytest.param("espeak:nl", EspeakVoice, marks=pytest.mark.espeak),
        pytest.param("hibari", HibariVoice, marks=pytest.mark.hibari),
    ],
)
def test_a_voice_is_found_by_its_name_and_no_engine_starts(name: str, kind: type) -> None:
    voice = find_voice(name)
    assert isinstance(voice, kind)
    assert (voice.name, getattr(voice, "pid", None)) == (name, None)


def test_listing_the_voices_loads_no_engine() -> None:
    code = "import sys; from realizer.speech import voices; voices(); print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert not {"hibari", "onnxruntime", "espeakng_loader"} & set(loaded.split())
