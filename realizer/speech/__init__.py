"""Voices: text with marks in, sound and the times of words, phonemes and marks out.

What is here is loaded when it is first used: the values alone start no engine and read no table.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from realizer.speech.espeak.voice import EspeakVoice
    from realizer.speech.hibari.voice import HibariVoice
    from realizer.speech.registry import VoiceInfo, find_voice, voices
    from realizer.speech.silent import SilentVoice
    from realizer.speech.utterance import Phoneme, Say, Utterance, Voice, Word

__all__ = [
    "EspeakVoice",
    "HibariVoice",
    "Phoneme",
    "Say",
    "SilentVoice",
    "Utterance",
    "Voice",
    "VoiceInfo",
    "Word",
    "find_voice",
    "voices",
]

_HOME = {
    "EspeakVoice": "espeak.voice",
    "HibariVoice": "hibari.voice",
    "SilentVoice": "silent",
    "VoiceInfo": "registry",
    "find_voice": "registry",
    "voices": "registry",
}


def __getattr__(name: str) -> Any:
    if name in __all__:
        found = getattr(import_module(f"{__name__}.{_HOME.get(name, 'utterance')}"), name)
        globals()[name] = found
        return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
