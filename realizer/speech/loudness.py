"""The loudness of vowels in the sound of an utterance, raised at accents, and the silence around pauses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from realizer.core.array_types import Float64
from realizer.speech.accents import phrases, prosody_facts
from realizer.speech.utterance import Phoneme, Utterance
from realizer.tables.phonemes import vowels

STEP = 8  # every so many samples are measured, which is enough for a mean
WINDOW, QUIET = 0.01, 0.03  # s; of the loud parts, below which a window is silent
STOPS = "pbtdkɡgqʔ"  # they begin and end with silence
LEAST = 0.02  # s of a sound beside a pause


def with_loudness(utterance: Utterance) -> tuple[Phoneme, ...]:
    """Return its phonemes; vowels have the requested volume times the loudness at which they are heard.

    The loudness is relative to the median of the vowels, and the last accent of a phrase, which is the most
    prominent one, is louder by the table's factor. Pauses include the silence that a voice counts to the
    sounds beside them.
    """
    sound = Levels(utterance) if utterance.pcm is not None and utterance.sample_rate else None
    phonemes = utterance.phonemes if sound is None else _with_whole_pauses(utterance, sound)
    sung = [k for k, phoneme in enumerate(phonemes) if phoneme.ipa[:1] in vowels()]
    if not sung:
        return phonemes
    spans = np.array([(phonemes[k].start, phonemes[k].end) for k in sung])
    loud = np.ones(len(spans)) if sound is None else _relative(sound.of(spans))
    for accent in (
        accent.time for phrase in phrases(utterance) for accent in phrase.accents if accent.nuclear
    ):
        loud[(spans[:, 0] <= accent) & (accent < spans[:, 1])] *= prosody_facts()["accents"]["louder"]
    heard = list(phonemes)
    for k, factor in zip(sung, loud.tolist(), strict=True):
        one = phonemes[k]
        heard[k] = Phoneme(one.start, one.end, one.ipa, one.stress, one.volume * factor)
    return tuple(heard)


def _with_whole_pauses(utterance: Utterance, sound: Levels) -> tuple[Phoneme, ...]:
    """Return the phonemes, with the silence beside a pause in the pause."""
    phonemes = list(utterance.phonemes)
    pauses = [k for k in range(1, len(phonemes) - 1) if not phonemes[k].ipa]
    if not pauses:
        return utterance.phonemes
    begins = np.arange(int(utterance.duration / WINDOW)) * WINDOW
    levels = sound.of(np.stack([begins, begins + WINDOW], axis=1))
    heard = begins[levels > QUIET * quantile(levels, 0.9)]
    for k in pauses:
        before, pause, after = phonemes[k - 1 : k + 2]
        if before.ipa[:1] not in STOPS:
            last = heard[(heard >= before.start) & (heard < before.end)]
            end = max(last[-1] + WINDOW if len(last) else 0.0, before.start + LEAST)
            before = replace(before, end=min(before.end, end))
        if after.ipa[:1] not in STOPS:
            first = heard[(heard >= after.start) & (heard < after.end)]
            start = min(first[0] if len(first) else np.inf, after.end - LEAST)
            after = replace(after, start=max(after.start, start))
        phonemes[k - 1 : k + 2] = before, replace(pause, start=before.end, end=after.start), after
    return tuple(phonemes)


class Levels:
    """The levels of the sound of an utterance, summed once for any spans."""

    def __init__(self, utterance: Utterance) -> None:
        assert utterance.pcm is not None
        power = np.square(utterance.pcm[::STEP].astype(np.float32)).cumsum(dtype=np.float64)
        self._power = np.concatenate(([0.0], power))
        self._rate = utterance.sample_rate / STEP

    def of(self, spans: Float64) -> Float64:
        """Return the root mean square (m,) in each span (m, 2) of seconds."""
        first, last = np.rint(spans.T * self._rate).astype(int).clip(0, len(self._power) - 1)
        levels: Float64 = np.sqrt((self._power[last] - self._power[first]) / np.maximum(last - first, 1))
        return levels


def _relative(levels: Float64) -> Float64:
    """Return levels (m,) over their median, within the table's limits; 1 for silence."""
    usual = float(np.median(levels))
    limit = prosody_facts()["accents"]["range"]
    return np.clip(levels / usual, 1 / limit, limit) if usual > 0 else np.ones(len(levels))


def quantile(values: npt.NDArray[np.floating], part: float) -> float:
    """Return what `np.quantile` does, in a quarter of the time; its first call imports numpy.ma, too."""
    ordered = np.sort(values)
    place = (len(values) - 1) * part
    low, high = ordered[int(place)], ordered[min(int(place) + 1, len(values) - 1)]
    share = place - int(place)
    return float(low + (high - low) * share if share < 0.5 else high - (high - low) * (1 - share))
