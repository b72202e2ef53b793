"""Detection of the phrases of an utterance and of the accents in them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from weakref import WeakKeyDictionary

import numpy as np

from realizer import tables
from realizer.speech.utterance import Utterance

PRIMARY = 1
prosody_facts = partial(tables.toml_table, "prosody.toml")


@dataclass(frozen=True, slots=True)
class Accent:
    """A stressed syllable; `nuclear` if it is the last of its phrase, which is the most prominent one."""

    time: float
    nuclear: bool = False


@dataclass(frozen=True, slots=True)
class Phrase:
    """The speech between two pauses, in seconds from the start of the utterance."""

    start: float
    end: float
    accents: tuple[Accent, ...]


# Results are cached as long as the utterance is in use.
_known: WeakKeyDictionary[Utterance, tuple[Phrase, ...]] = WeakKeyDictionary()


def phrases(utterance: Utterance) -> tuple[Phrase, ...]:
    """Return the phrases of an utterance, in order.

    A phrase ends at a pause, such as that of a comma. Its accents are the middles of phonemes with primary
    stress. If the voice does not report stress, they are the loudest words; without sound, the longest word.
    """
    found = _known.get(utterance)
    if found is None:
        found = _known[utterance] = tuple(_find_phrases(utterance))
    return found


def _find_phrases(utterance: Utterance) -> list[Phrase]:
    sounds = [(p.start, p.end) for p in utterance.phonemes if p.ipa]
    words = [(w.start, w.end) for w in utterance.words] or sounds
    stressed = [(p.start + p.end) / 2 for p in utterance.phonemes if p.stress == PRIMARY and p.ipa]
    spans: list[tuple[float, float]] = []
    for start, end in sounds or words:
        if spans and start - spans[-1][1] < prosody_facts()["phrases"]["pause"]:
            spans[-1] = (spans[-1][0], end)
        else:
            spans.append((start, end))
    found = []
    for start, end in spans:
        if stressed:
            times = [t for t in stressed if start <= t < end]
        else:
            times = _accent_times(utterance, [w for w in words if start <= (w[0] + w[1]) / 2 < end])
        accents = [Accent(time) for time in times]
        if accents:
            accents[-1] = replace(accents[-1], nuclear=True)
        found.append(Phrase(start, end, tuple(accents)))
    return found


def _accent_times(utterance: Utterance, words: Sequence[tuple[float, float]]) -> list[float]:
    """Return the times at which the loudest words are loudest, or the middle of the longest word."""
    if not words:
        return []
    loudest = [_loudest(utterance, start, end) for start, end in words]
    most = max(loudness for loudness, _ in loudest)
    if most == 0.0:
        start, end = max(words, key=lambda word: word[1] - word[0])
        return [(start + end) / 2]
    return [time for loudness, time in loudest if loudness >= prosody_facts()["accents"]["loud"] * most]


def _loudest(utterance: Utterance, start: float, end: float) -> tuple[float, float]:
    """Return the largest root mean square of a short window, 0 if there is no sound, and its time."""
    if utterance.pcm is None or not utterance.sample_rate:
        return 0.0, start
    rate, window = utterance.sample_rate, prosody_facts()["accents"]["window"]
    samples = utterance.pcm[round(start * rate) : round(end * rate)].astype(np.float64)
    size = max(1, round(window * rate))
    count = len(samples) // size
    if not count:
        return 0.0, start
    power = np.square(samples[: count * size]).reshape(count, size).mean(axis=1)
    best = int(power.argmax())
    return float(np.sqrt(power[best])), start + (best + 0.5) * size / rate
