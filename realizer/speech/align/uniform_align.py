"""The fallback aligner, which spreads words evenly over the time with speech."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from realizer.core.array_types import Float32, Float64
from realizer.speech.align import features
from realizer.speech.align.alignment import Alignment, moved
from realizer.speech.utterance import Utterance

HOP = 160  # samples
INSTALL = "no aligner, words are spread evenly: pip install 'bml-realizer[speech,align]'"


def uniform_align(sound: Float32, duration: float, reference: Utterance) -> Alignment:
    """Spread the words of the reference over the audible parts of the recording; the confidence is 0."""
    loud = features.loudness(features.energies(sound, HOP))
    _, talks = features.voice_activity(loud)
    passed = np.append(0.0, np.cumsum(talks)) / max(int(talks.sum()), 1)
    passed += np.arange(len(passed)) * 1e-12  # strictly rising, so that it has an inverse
    times = np.minimum(np.arange(len(passed)) * HOP / features.RATE, duration)
    first, last = reference.words[0].start, reference.words[-1].end

    def spread(pairs: Float64) -> Float64:
        return np.interp(np.clip((pairs - first) / max(last - first, 1e-6), 1e-6, 1.0), passed, times)

    words = spread(np.array([(w.start, w.end) for w in reference.words]))
    phonemes = spread(np.array([(p.start, p.end) for p in reference.phonemes]))
    words_told = moved("even", reference, duration, words, phonemes, [0.0] * len(words), 0.0)
    return replace(words_told, warnings=(INSTALL,))
