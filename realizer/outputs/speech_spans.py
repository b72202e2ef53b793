"""Times of words, phonemes and sync points of a realization, on one clock."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from realizer.animation.lips.visemes import sounds

# As in realizer.outputs.output: plug-ins import this while the modules of a realization are imported.
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


def visemes(speaking: ScheduledSpeech, name: Callable[[int, str], str]) -> list[Span]:
    """Return the strongest viseme of each sound; neighbours of one name are joined.

    Args:
        name: (viseme of MPEG-4, phoneme in IPA) -> the text of a span.
    """
    spans: list[Span] = []
    for phoneme in phonemes(speaking):
        start = phoneme.start
        for sound in sounds(phoneme.text):
            end = start + sound.share * (phoneme.end - phoneme.start)
            if sound.mix:
                text = name(max(sound.mix, key=lambda part: part[1])[0], phoneme.text)
                if spans and spans[-1].text == text and start - spans[-1].end < MIN_LENGTH:
                    start = spans.pop().start
                spans.append(Span(start, end, text))
            start = end
    return spans


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
