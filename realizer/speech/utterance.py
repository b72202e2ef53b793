"""The data types of speech: request, utterance, word, phoneme, recording, and the voice protocol."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from realizer.core.array_types import Int16

# Limits of the length of synthesized speech that is still intelligible, relative to the usual; our choice.
STRETCH = (0.6, 1.8)
# Limits of the length of sound that is resampled, not synthesized again.
WARP = (0.92, 1.08)
MAX_TEXT = 20_000  # characters; about 20 minutes of speech, more than a behaviour needs
RATES = (1000, 384_000)  # Hz of recordings


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """Recorded speech. It equals nothing but itself."""

    rate: int  # Hz
    pcm: Int16  # (n,) int16 mono
    text: str | None = None  # the plain text, if known
    # words, phonemes: in order, in seconds from its start; () if unknown
    words: tuple[Word, ...] = ()
    phonemes: tuple[Phoneme, ...] = ()
    # the phonemes that were recognised in the sound when it arrived, or None
    heard: tuple[Phoneme, ...] | None = None
    warnings: tuple[str, ...] = ()  # sentences about the sound itself


@dataclass(frozen=True, slots=True)
class SpeechRequest:
    """A text to be spoken by a voice."""

    # the content of <speak>: text with <mark name="x"/> and the SSML elements of the document; the <, > and &
    # of plain text are escaped
    ssml: str
    marks: tuple[str, ...] = ()  # names of the marks in the order of the text
    language: str = "en-US"  # BCP-47, such as "en-US"
    voice: str | None = None  # name of a voice, or None for the language's default
    rate: float = 1.0  # 1 is the voice's own rate, 2 twice as fast
    # wanted duration, or None for the voice's own; handled by `duration_fit`, not by voices
    seconds: float | None = None
    # a recording of the text, which is aligned (`speech.align`) instead of synthesizing speech
    recording: Recording | None = None
    # the times of a recording that is not there, at which the voice speaks
    given: GivenTimes | None = None


@dataclass(frozen=True, slots=True)
class Word:
    start: float
    end: float
    text: str


@dataclass(frozen=True, slots=True)
class Phoneme:
    """One phoneme."""

    start: float
    end: float
    ipa: str  # "" for a pause
    stress: int = 0  # 0 none, 1 primary, 2 secondary
    volume: float = 1.0  # requested factor of the amplitude; 1 is the voice's own


@dataclass(frozen=True, eq=False)
class GivenTimes:
    """Times of a recording that its document gives, in seconds from its start; what is not given is empty."""

    marks: Mapping[str, float]
    words: tuple[Word, ...] = ()
    phonemes: tuple[Phoneme, ...] = ()  # of visemes; without gaps
    unknown: tuple[str, ...] = ()  # names of visemes that have no mouth shape

    @property
    def last(self) -> float:
        """When the last viseme ends."""
        return self.phonemes[-1].end if self.phonemes else 0.0

    @property
    def duration(self) -> float:
        """When all of them have ended; never nothing."""
        return max((*self.marks.values(), *(word.end for word in self.words), self.last, 0.1))

    @property
    def warnings(self) -> tuple[str, ...]:
        return (f"visemes without a mouth shape: {', '.join(self.unknown)}",) if self.unknown else ()


@dataclass(frozen=True, eq=False)
class Utterance:
    """Speech with its times, all in seconds from its start."""

    duration: float  # seconds; exactly the length of the PCM, if there is any
    # words, phonemes: in order; phonemes do not overlap
    words: tuple[Word, ...]
    phonemes: tuple[Phoneme, ...]
    marks: Mapping[str, float]  # seconds by name
    sample_rate: int = 0  # Hz; 0 if there is no sound (silent voice)
    pcm: Int16 | None = None  # (n,) int16 mono, or None
    warnings: tuple[str, ...] = field(default=())  # sentences for the client, such as "the text is empty"
    # the least and the greatest length, relative to its duration, to which it can be changed; (1, 1) if it
    # cannot
    stretch: tuple[float, float] = (1.0, 1.0)
    # (start, utterance) of the parts it was joined from, if any. While a long text is being synthesized, the
    # duration is an estimate and the sound ends with the last part.
    sections: tuple[tuple[float, Utterance], ...] = ()

    @property
    def silent_from(self) -> float:
        """When its closing pause begins; its duration if it has none, or is not complete yet."""
        last = self.phonemes[-1] if self.phonemes and not self.sections else None
        return self.duration if last is None or last.ipa or last.end < self.duration else last.start


def tile(starts: Iterable[tuple[float, str, int]], end: float, rate: float = 1.0) -> tuple[Phoneme, ...]:
    """Return phonemes without gaps, each until the next starts or the `end`; adjacent pauses are joined.

    `starts` are (time, IPA, stress) in order; IPA is "" for a pause. `rate` is how many times are a second.
    """
    kept: list[tuple[float, str, int]] = []
    for start in starts:
        if start[1] or not kept or kept[-1][1]:
            kept.append(start)
    ends = [*(time for time, _, _ in kept[1:]), end]
    return tuple(
        Phoneme(time / rate, until / rate, ipa, stress)
        for (time, ipa, stress), until in zip(kept, ends, strict=False)
        if until > time
    )


class Voice(Protocol):
    """A speech synthesizer; see `base_voice.BaseVoice`."""

    name: str

    def say(self, request: SpeechRequest) -> Utterance: ...

    def close(self) -> None: ...
