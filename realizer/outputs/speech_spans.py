"""Times of words, phonemes and sync points of a realization, on one clock."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from realizer.playback.scheduled_speech import ScheduledSpeech
    from realizer.realization import Realization
    from realizer.speech.utterance import Phoneme, Word

MIN_LENGTH = 0.001  # s; shorter spans are rounding errors


@dataclass(frozen=True, slots=True)
class Span:
    """A text and its seconds from the start of the realization; blanks in `text` are single."""

    start: float
    end: float
    text: str


def words(speaking: ScheduledSpeech) -> Iterator[Span]:
    """Yield the words of an utterance in order, until it is cut off."""
    return _audible(speaking, ((word, word.text) for word in speaking.utterance.words))


def phonemes(speaking: ScheduledSpeech) -> Iterator[Span]:
    """Yield the phonemes of an utterance in IPA, without pauses."""
    return _audible(speaking, ((phoneme, phoneme.ipa) for phoneme in speaking.utterance.phonemes))


def points(realization: Realization) -> Iterator[tuple[float, str]]:
    """Yield (seconds, "block:behaviour:point") of every sync point, by block and behaviour."""
    for schedule in realization.schedules:
        for behaviour, times in schedule.times.items():
            for point, time in zip(schedule.points[behaviour], times, strict=True):
                yield schedule.start + float(time), f"{schedule.block}:{behaviour}:{point}"


def _audible(speaking: ScheduledSpeech, timed: Iterator[tuple[Word | Phoneme, str]]) -> Iterator[Span]:
    for part, text in timed:
        start = speaking.start + part.start
        end = min(speaking.start + part.end, speaking.until)
        if end - start >= MIN_LENGTH and text.strip():
            yield Span(start, end, " ".join(text.split()))
