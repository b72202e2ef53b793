"""The registry of voices."""

from dataclasses import dataclass
from functools import cache

from realizer.core.errors import UnknownVoiceError, VoiceError
from realizer.core.registry import Registry
from realizer.core.similar import did_you_mean, similar
from realizer.speech.base_voice import BaseVoice
from realizer.speech.utterance import Voice

# The first that is installed is the default voice; plug-ins never are.
VOICES: Registry[type[BaseVoice]] = Registry(
    "realizer.voices",
    {
        "espeak": "realizer.speech.espeak.voice:EspeakVoice",
        "hibari": "realizer.speech.hibari.voice:HibariVoice",
        "silent": "realizer.speech.silent:SilentVoice",
    },
    wanted="a subclass of realizer.speech.base_voice.BaseVoice",
    accepts=lambda value: isinstance(value, type) and issubclass(value, BaseVoice),
)
OTHER_NAMES = {"espeak-ng": "espeak", "hibari-tts": "hibari"}


@dataclass(frozen=True, slots=True)
class VoiceInfo:
    """A row of the list of voices.

    Attributes:
        name: its name for `find_voice`.
        engine: the name of its engine.
        languages: BCP-47 tags; () if they are unknown before the engine is installed.
        available: whether it works on this machine.
        description: one sentence: what it is, or what to install.
    """

    name: str
    engine: str
    languages: tuple[str, ...]
    available: bool
    description: str


def voices() -> tuple[VoiceInfo, ...]:
    """Return the voices, best first, without starting an engine."""
    found = []
    for name, voice in VOICES.working():
        fix = voice.missing()
        found.append(VoiceInfo(name, voice.engine, voice.languages(), fix is None, fix or voice.description))
    return tuple(found)


def find_voice(name: str | None = None) -> Voice:
    """Return a voice by name.

    Args:
        name: "espeak", "espeak:VOICE" (a voice of espeak-ng such as "en-gb+f3"), "hibari", "hibari:VOICE",
            "silent", the name of a plug-in's voice, or None for the best that is installed.

    Raises:
        VoiceError: if it is not installed; the text says what to do.
        UnknownVoiceError: if there is no such voice, or its engine has none of that name.
        PluginError: if the voice belongs to a plug-in that cannot be used.
    """
    if name is None:
        name = next(known for known, voice in VOICES.working() if voice.missing() is None)
    engine, _, variant = name.partition(":")
    engine = OTHER_NAMES.get(engine, engine)
    if engine not in VOICES:
        known, near = ", ".join(VOICES), did_you_mean(similar(engine, VOICES))
        raise UnknownVoiceError(
            f"voice: wanted one of {known}, got {name!r}{near or ';'} "
            "`realizer voices` says how to install them"
        )
    voice = VOICES[engine]
    if fix := voice.missing():
        raise VoiceError(fix)
    if fix := voice.missing(variant or None):
        raise UnknownVoiceError(fix)
    return voice(variant or None)


@cache
def reference_voice() -> Voice:
    """Return the voice whose phonemes and times recordings are compared with; one for the process."""
    name = "espeak" if VOICES["espeak"].missing() is None else "silent"
    return find_voice(name)
