"""A buffer that joins pieces of speech into one utterance."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from realizer.core.array_types import Int16
from realizer.speech.hibari.times import Sound
from realizer.speech.utterance import Phoneme, tile
from realizer.speech.words import PlacedMark

FADE = 0.004  # s, where a sound is cut


@dataclass(slots=True)
class SpeechBuffer:
    """The speech so far.

    Attributes:
        pcm: the pieces, `length` samples in all.
        phonemes: in order; `start` and `end` in samples of the whole.
        words: first sample, end, text.
    """

    pcm: list[Int16] = field(default_factory=list)
    length: int = 0
    phonemes: list[Sound] = field(default_factory=list)
    words: list[tuple[int, int, str]] = field(default_factory=list)

    def add(self, pcm: Int16) -> None:
        """Append a piece of sound."""
        self.pcm.append(pcm)
        self.length += len(pcm)

    def sounds(self, rate: int) -> tuple[Phoneme, ...]:
        """Return phonemes and pauses, which cover the sound without gaps; `rate` is in Hz."""
        starts: list[tuple[float, str, int]] = []
        end = 0
        for sound in self.phonemes:
            if sound.start > end:
                starts.append((end, "", 0))
            if sound.end > sound.start:
                starts.append((sound.start, sound.ipa, sound.stress))
            end = sound.end
        return tile([*starts, (end, "", 0)], self.length, rate)

    def marks(self, placed: Sequence[PlacedMark]) -> dict[str, int]:
        """Return the sample of each mark: the start of the next word, or the last end before a <break>."""
        marks: dict[str, int] = {}
        for mark in placed:
            if mark.word < len(self.words) and not mark.paused:
                marks.setdefault(mark.name, self.words[mark.word][0])
            else:
                marks.setdefault(mark.name, self.words[mark.word - 1][1] if mark.word and self.words else 0)
        return marks


def cut(pcm: Int16, first: int, last: int, rate: int) -> Int16:
    """Return the samples from `first` to `last`, faded in and out where the sound is cut."""
    part = pcm[first:last].astype(np.float32)
    ramp = np.linspace(0, 1, min(len(part), round(FADE * rate)), dtype=np.float32)
    if first > 0:
        part[: len(ramp)] *= ramp
    if last < len(pcm):
        part[len(part) - len(ramp) :] *= ramp[::-1]
    return np.rint(part).astype(np.int16)
