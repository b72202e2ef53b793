"""The result of an aligner: words and phonemes with times and a confidence."""

import math
from dataclasses import dataclass, replace

import numpy as np

from realizer.core.array_types import Float64
from realizer.core.errors import RealizerError
from realizer.speech.utterance import Phoneme, Utterance, Word

MIN_PAUSE = 0.02  # s; shorter ones are added to the sound before


class AlignError(RealizerError):
    """Raised if a recording and a text cannot be aligned."""


@dataclass(frozen=True, slots=True)
class Alignment:
    """The times of words and phonemes in a recording, in seconds from its start."""

    duration: float  # of the recording
    words: tuple[Word, ...]  # in the order of the text; words that were not found have no length
    phonemes: tuple[Phoneme, ...]  # with pauses (""), they cover 0..duration without gaps
    confidences: tuple[float, ...]  # 0..1, one for each word
    phoneme_confidences: tuple[float, ...]  # 0..1, one for each phoneme: that of its word; 1 for pauses
    confidence: float  # 0..1, of the whole; below 0.5 the recording probably has another text
    aligner: str  # "pocketsphinx", "espeak", or "even" if neither is installed and words are spread evenly
    warnings: tuple[str, ...] = ()  # sentences


def build(
    aligner: str,
    reference: Utterance,
    duration: float,
    spans: Float64,
    sounds: tuple[list[Phoneme], list[int]],
    each: list[float],
    confidence: float,
) -> Alignment:
    """Return an alignment with times in order, within the recording, and with pauses.

    Args:
        reference: an utterance with the same words.
        duration: of the recording.
        spans: (n, 2) times of the words.
        sounds: phonemes in order, and the word of each.
        each, confidence: of each word, and of the whole.
    """
    spans = np.clip(np.maximum.accumulate(np.nan_to_num(spans).ravel()), 0.0, duration).reshape(-1, 2)
    words = tuple(
        Word(float(start), float(end), word.text)
        for (start, end), word in zip(spans, reference.words, strict=True)
    )
    tiled: list[tuple[Phoneme, float]] = []
    now = 0.0
    for k, (phoneme, owner) in enumerate(zip(*sounds, strict=True)):
        start = min(max(phoneme.start, now), duration)
        end = min(max(phoneme.end, start), duration)
        following = sounds[0][k + 1].start if k + 1 < len(sounds[0]) else duration
        paused = start - now >= MIN_PAUSE or (not tiled and start > 0)
        if tiled and not paused:
            start = now
        if 0 < following - end < MIN_PAUSE:
            end = min(following, duration)
        if end > start:
            if paused:
                tiled.append((Phoneme(now, start, ""), 1.0))
            tiled.append((replace(phoneme, start=start, end=end), each[owner]))
            now = end
    if duration > now:
        tiled.append((Phoneme(now, duration, ""), 1.0))
    return Alignment(
        duration=duration,
        words=words,
        phonemes=tuple(phoneme for phoneme, _ in tiled),
        confidences=tuple(each),
        phoneme_confidences=tuple(sure for _, sure in tiled),
        confidence=confidence,
        aligner=aligner,
    )


def moved(
    aligner: str,
    reference: Utterance,
    duration: float,
    words: Float64,
    spans: Float64,
    each: list[float],
    confidence: float,
) -> Alignment:
    """Return an alignment with the phonemes of the reference; `spans` (m, 2) are their times."""
    starts = np.array([word.start for word in reference.words])
    phonemes, owners = [], []
    for phoneme, (start, end) in zip(reference.phonemes, spans, strict=True):
        if phoneme.ipa:
            phonemes.append(replace(phoneme, start=float(start), end=float(end)))
            owners.append(max(0, int(np.searchsorted(starts, phoneme.start + 1e-6, side="right")) - 1))
    return build(aligner, reference, duration, words, (phonemes, owners), each, confidence)


def probability(value: float, where: tuple[float, float]) -> float:
    """Return the value of a logistic curve, 0..1; `where` is its middle and its signed width."""
    middle, width = where
    return 1.0 / (1.0 + math.exp(min(50.0, max(-50.0, -(value - middle) / width))))
