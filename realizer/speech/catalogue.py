"""Which voices there are, which can speak here, and what to install for the others."""

from __future__ import annotations

from dataclasses import dataclass

from realizer.errors import VoiceError
from realizer.speech.silent import SilentVoice
from realizer.speech.spelling import GENERIC, syllable_facts
from realizer.speech.utterance import Voice

__all__ = ["VoiceInfo", "find_voice", "voices"]


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
    from realizer.speech.espeak import missing

    fix = missing()
    spelled = tuple(name for name in syllable_facts()["languages"] if name != GENERIC)
    return (
        VoiceInfo(
            name="espeak",
            engine="espeak-ng",
            languages=(),
            available=fix is None,
            says=fix
            or "espeak-ng speaks over 100 languages; a variant is named as in espeak:en-gb+f3 or espeak:nl",
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
        name: "espeak", "espeak:VOICE" (a voice of espeak-ng such as "en-gb+f3"), "silent", or None for the
            best that is installed.

    Raises:
        VoiceError: no such voice, or it is not installed; the text says what to do.
    """
    from realizer.speech.espeak import EspeakVoice, missing

    if name is None:
        return SilentVoice() if missing() else EspeakVoice()
    engine, _, variant = name.partition(":")
    if engine == "silent" and not variant:
        return SilentVoice()
    if engine in ("espeak", "espeak-ng"):
        fix = missing()
        if fix:
            raise VoiceError(fix)
        return EspeakVoice(voice=variant or None)
    known = ", ".join(v.name for v in voices())
    raise VoiceError(f"voice: wanted one of {known}, got {name!r}; `realizer voices` says how to get them")
