"""The loudness of vowels in the sound of an utterance, raised at the accents of its phrases."""

from __future__ import annotations

import numpy as np

from realizer.core.array_types import Float64
from realizer.speech.accents import phrases, prosody_facts
from realizer.speech.utterance import Phoneme, Utterance
from realizer.tables.phonemes import vowels

STEP = 8  # every so many samples are measured, which is enough for a mean


def with_loudness(utterance: Utterance) -> tuple[Phoneme, ...]:
    """Return its phonemes; vowels have the requested volume times the loudness at which they are heard.

    The loudness is relative to the median of the vowels, and the last accent of a phrase, which is the most
    prominent one, is louder by the table's factor.
    """
    phonemes = utterance.phonemes
    sung = [k for k, phoneme in enumerate(phonemes) if phoneme.ipa[:1] in vowels()]
    if not sung:
        return phonemes
    spans = np.array([(phonemes[k].start, phonemes[k].end) for k in sung])
    loud = _relative_levels(utterance, spans)
    for accent in (
        accent.time for phrase in phrases(utterance) for accent in phrase.accents if accent.nuclear
    ):
        loud[(spans[:, 0] <= accent) & (accent < spans[:, 1])] *= prosody_facts()["accents"]["louder"]
    heard = list(phonemes)
    for k, factor in zip(sung, loud.tolist(), strict=True):
        one = phonemes[k]
        heard[k] = Phoneme(one.start, one.end, one.ipa, one.stress, one.volume * factor)
    return tuple(heard)


def _relative_levels(utterance: Utterance, spans: Float64) -> Float64:
    """Return the root mean square (m,) of the sound in each span over their median; 1 without sound."""
    if utterance.pcm is None or not utterance.sample_rate:
        return np.ones(len(spans))
    power = np.square(utterance.pcm[::STEP].astype(np.float32)).cumsum(dtype=np.float64)
    power = np.concatenate(([0.0], power))
    first, last = np.rint(spans.T * utterance.sample_rate / STEP).astype(int).clip(0, len(power) - 1)
    levels = np.sqrt((power[last] - power[first]) / np.maximum(last - first, 1))
    usual = float(np.median(levels))
    limit = prosody_facts()["accents"]["range"]
    return np.clip(levels / usual, 1 / limit, limit) if usual > 0 else np.ones(len(spans))
