"""The registry of voices: which can speak here, and what to install for the others."""

from __future__ import annotations

from dataclasses import dataclass

from realizer.core.errors import VoiceError
from realizer.speech.letter_to_sound import GENERIC, syllable_facts
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import Voice


@dataclass(frozen=True, slots=True)
class VoiceInfo:
    """One voice.

    Attributes:
        name: what `find_voice` takes.
        engine: what speaks.
        languages: BCP-47 tags; () if they are not known before the engine is installed.
        available: whether it works on this machine.
        says: one sentence: what it is, or what to install.
    """

    name: str
    engine: str
    languages: tuple[str, ...]
    available: bool
    says: str


def voices() -> tuple[VoiceInfo, ...]:
    """The voices, best first; starts no engine."""
    from realizer.speech.espeak import voice as espeak
    from realizer.speech.hibari import voice as hibari

    spelled = tuple(name for name in syllable_facts()["languages"] if name != GENERIC)
    return (
        VoiceInfo(
            name="espeak",
            engine="espeak-ng",
            languages=(),
            available=espeak.missing() is None,
            says=espeak.missing()
            or "espeak-ng speaks over 100 languages; a variant is named as in espeak:en-gb+f3 or espeak:nl",
        ),
        VoiceInfo(
            name="hibari",
            engine="hibari-tts",
            languages=("en-US", "en-GB"),
            available=hibari.missing() is None,
            says=hibari.missing()
            or "a neural voice, English only; its other voices are named as in hibari:emma",
        ),
        VoiceInfo(
            name="silent",
            engine="rules",
            languages=spelled,
            available=True,
            says="no sound: times and lips by rule, for any language",
        ),
    )


def find_voice(name: str | None = None) -> Voice:
    """The voice of that name.

    Args:
        name: "espeak", "espeak:VOICE" (a voice of espeak-ng such as "en-gb+f3"), "hibari", "hibari:VOICE",
            "silent", or None for the best that is installed.

    Raises:
        VoiceError: no such voice, or it is not installed; the text says what to do.
    """
    from realizer.speech.espeak import voice as espeak
    from realizer.speech.hibari import voice as hibari

    if name is None:
        name = next(voice.name for voice in voices() if voice.available)
    engine, _, variant = name.partition(":")
    if engine == "silent" and not variant:
        return SilentVoice()
    if engine in ("espeak", "espeak-ng"):
        if fix := espeak.missing():
            raise VoiceError(fix)
        return espeak.EspeakVoice(voice=variant or None)
    if engine in ("hibari", "hibari-tts"):
        if fix := hibari.missing() or (hibari.missing_voice(variant) if variant else None):
            raise VoiceError(fix)
        return hibari.HibariVoice(voice=variant or None)
    known = ", ".join(v.name for v in voices())
    raise VoiceError(f"voice: wanted one of {known}, got {name!r}; `realizer voices` says how to get them")
