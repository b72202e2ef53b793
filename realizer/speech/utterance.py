"""The values of speech: request, utterance, words, phonemes, and the voice protocol."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from realizer.core.array_types import Int16

# A voice can speak so much faster or slower and still be understood, as parts of its usual length; ours.
STRETCH = (0.6, 1.8)
# And a sound can be played so much faster or slower, here more and there less, without asking the voice.
WARP = (0.92, 1.08)
MAX_TEXT = 20_000  # characters; about 20 minutes of speech, beyond what one behaviour can want


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """Sound that is there already. It equals nothing but itself.

    Attributes:
        rate: Hz.
        pcm: (n,) int16 mono.
        text: what is said in it, plain, where whoever made it told.
        words, phonemes: when, in seconds from its start, where that was told; in order.
    """

    rate: int
    pcm: Int16
    text: str | None = None
    words: tuple[Word, ...] = ()
    phonemes: tuple[Phoneme, ...] = ()


@dataclass(frozen=True, slots=True)
class SpeechRequest:
    """What a voice is asked to say.

    Attributes:
        ssml: the content of <speak>: text with <mark name="x"/> and the SSML elements the document used;
            plain text has its <, > and & escaped.
        marks: names of the marks in the order of the text.
        language: BCP-47, such as "en-US".
        voice: name of a voice, or None for the language's default.
        rate: 1 is the voice's own rate, 2 twice as fast.
        seconds: how long it is to last; None as long as it takes. For `speech.fitting`, voices need not look.
        recording: somebody who says it already: no voice is asked, it is aligned (`speech.align`).
    """

    ssml: str
    marks: tuple[str, ...] = ()
    language: str = "en-US"
    voice: str | None = None
    rate: float = 1.0
    seconds: float | None = None
    recording: Recording | None = None


@dataclass(frozen=True, slots=True)
class Word:
    start: float
    end: float
    text: str


@dataclass(frozen=True, slots=True)
class Phoneme:
    """One phoneme.

    Attributes:
        ipa: "" for a pause.
        stress: 0 none, 1 primary, 2 secondary.
        volume: how loud it is meant, on the amplitude; 1 is the voice's own way.
    """

    start: float
    end: float
    ipa: str
    stress: int = 0
    volume: float = 1.0


@dataclass(frozen=True, eq=False)
class Utterance:
    """Speech with its times; all in seconds from its start.

    Attributes:
        duration: seconds; the PCM is exactly this long where there is any.
        sample_rate: Hz; 0 where there is no sound (silent voice).
        pcm: (n,) int16 mono, or None.
        words, phonemes: in order; phonemes do not overlap.
        marks: mark name -> seconds.
        warnings: sentences for the client, such as "the text is empty".
        stretch: the shortest and the longest it could be made, as parts of its duration, by asking the voice
            again; (1, 1) where it is as it is.
        sections: (start, utterance) of what it was joined of; () where it is one. While a long text is being
            made the duration is a guess, and the sound ends with the last part.
    """

    duration: float
    words: tuple[Word, ...]
    phonemes: tuple[Phoneme, ...]
    marks: Mapping[str, float]
    sample_rate: int = 0
    pcm: Int16 | None = None
    warnings: tuple[str, ...] = field(default=())
    stretch: tuple[float, float] = (1.0, 1.0)
    sections: tuple[tuple[float, Utterance], ...] = ()


class Voice(Protocol):
    """Turns text with marks into an utterance; one method, blocking, callable from any thread."""

    name: str

    def say(self, request: SpeechRequest) -> Utterance:
        """Speak.

        Raises:
            VoiceError: the engine is missing or died; the text says what to do. The next call works again.
        """
        ...

    def close(self) -> None:
        """End the engine's process, if it has one. May be called twice."""
        ...
