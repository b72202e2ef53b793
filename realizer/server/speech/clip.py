"""A sound clip, and its division into parts that are spoken while it arrives."""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from realizer.core.array_types import Int16
from realizer.protocol.messages.speech import TimedText
from realizer.speech.utterance import Phoneme
from realizer.speech.voice_activity import VoiceActivity

if TYPE_CHECKING:
    from realizer.speech.sound_visemes.recogniser import VisemeRecogniser

FIRST = 0.2  # s; the least length of a part
HOLD = 1.0  # s; a last word whose end is not known waits at most so long for the end of the clip


@dataclass(eq=False)
class Clip:
    """A clip, complete or not.

    Attributes:
        pieces: the bytes received so far, until the last piece has arrived.
        recogniser: recognises mouth shapes in the pieces; None if they come too fast, or are not needed.
    """

    pieces: list[bytes] = field(default_factory=list)
    rate: int = 0  # Hz of raw PCM; 0 for a sound file
    sound: tuple[int, Int16] | None = None  # rate and int16 samples; None until the last piece has arrived
    text: str | None = None
    words: list[TimedText] = field(default_factory=list)
    phonemes: list[TimedText] = field(default_factory=list)
    is_annotated: bool = True  # whether the annotation is complete
    recogniser: VisemeRecogniser | None = None
    heard: list[Phoneme] = field(default_factory=list)
    warnings: tuple[str, ...] = ()  # about the sound

    @property
    def size(self) -> int:
        return sum(map(len, self.pieces)) if self.sound is None else self.sound[1].nbytes

    @property
    def is_described(self) -> bool:
        """Whether its text or its times are known, so that mouth shapes need not be recognised."""
        return bool(self.text or self.words or self.phonemes)

    def to_json(self) -> dict[str, Any]:
        """Return the fields as JSON values, without what can be recognised again."""
        sound = None
        if self.sound is not None:
            sound = {"rate": self.sound[0], "pcm": _base64(self.sound[1].astype("<i2").tobytes())}
        return {
            "pieces": [_base64(piece) for piece in self.pieces],
            "rate": self.rate,
            "sound": sound,
            "text": self.text,
            "words": [word.model_dump() for word in self.words],
            "phonemes": [phoneme.model_dump() for phoneme in self.phonemes],
            "told": self.is_annotated,
        }

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Clip:
        """Return the clip that `to_json` wrote.

        Raises:
            KeyError, TypeError, ValueError: it is not one.
        """
        sound = None
        if fields["sound"] is not None:
            sound = int(fields["sound"]["rate"]), samples_of(base64.b64decode(fields["sound"]["pcm"]))
        words, phonemes = ([TimedText(**item) for item in fields[name]] for name in ("words", "phonemes"))
        pieces = [base64.b64decode(piece) for piece in fields["pieces"]]
        return cls(pieces, fields["rate"], sound, fields["text"], words, phonemes, fields["told"])


@dataclass(eq=False)
class ArrivingClip:
    """The sound of a clip that is in no part yet.

    Attributes:
        words, phonemes: of the whole clip; without any, mouth shapes are recognised in each part.
    """

    rate: int
    words: list[TimedText]
    phonemes: list[TimedText]
    sound: bytearray = field(default_factory=bytearray)  # little-endian int16 samples
    taken: int = 0
    count: int = 0
    activity: VoiceActivity = field(init=False)

    def __post_init__(self) -> None:
        self.activity = VoiceActivity(self.rate)

    @property
    def ready(self) -> int:
        """The number of samples that the next part can have now; 0 if there are too few."""
        there = len(self.sound) // 2
        ends = [self._at(word.start) for word in self.words[1:]]
        if self.words:
            last = self.words[-1]
            ends.append(self._at(last.start + HOLD if last.end is None else last.end))
        # Behind the last word, or without words, a part may end anywhere.
        is_free = not ends or there >= ends[-1]
        count = there if is_free else max((end for end in ends if end <= there), default=0)
        return count if count >= FIRST * self.rate else 0

    def take(self, count: int, *, ends: bool = False) -> tuple[Int16, list[TimedText], list[TimedText]]:
        """Return so many samples as the next part, the words that begin in it, and its phonemes.

        If the sound `ends` here, those that begin later are added, so that they are warned about.
        """
        begin, start, end = self.taken, self.taken / self.rate, (self.taken + count) / self.rate
        words = [w for w in self.words if self._at(w.start) >= 0 and (ends or self._at(w.start) < count)]
        following = [*(p.start for p in self.phonemes[1:]), math.inf]
        spans = [
            (p, later if p.end is None else p.end) for p, later in zip(self.phonemes, following, strict=False)
        ]
        phonemes: list[tuple[TimedText, float | None]]
        phonemes = [(p, min(until, end)) for p, until in spans if p.start < end and until > start]
        phonemes += [(p, p.end) for p in self.phonemes if ends and p.start >= end]
        pcm = samples_of(bytes(self.sound[: 2 * count]))
        turns = self.activity.add(pcm)
        begun = self.activity.speaks or bool(turns) or self.activity.loud > 0
        if not (begun or self.words or self.phonemes):  # noise and hum are pauses
            phonemes = [(TimedText(start=start, text=""), end)]
        del self.sound[: 2 * count]
        self.taken, self.count = begin + count, self.count + 1
        return (
            pcm,
            [_moved(word, word.end, start) for word in words],
            [_moved(phoneme, until, start) for phoneme, until in phonemes],
        )

    def _at(self, time: float) -> int:
        """Return a time in the clip as samples after those that are taken."""
        return round(time * self.rate) - self.taken


def _moved(item: TimedText, end: float | None, start: float) -> TimedText:
    moved = {"start": max(0.0, item.start - start), "end": None if end is None else max(0.0, end - start)}
    return item.model_copy(update=moved)


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()


def samples_of(data: bytes) -> Int16:
    """Return little-endian int16 samples."""
    return np.frombuffer(data, "<i2").astype(np.int16, copy=False)
