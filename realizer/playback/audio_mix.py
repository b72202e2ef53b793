"""The mix of the utterances that play, cut off and faded as heard, at any sample rate."""

from __future__ import annotations

import numpy as np

from realizer.animation.curves import gain_at
from realizer.core.array_types import Float32, Int16
from realizer.playback.active_block import ScheduledSpeech

# Cut-off speech fades this long, so that it does not click, and is over in 50 ms with a packet cut in two.
CUT = 0.04  # s


def render_utterance(speaking: ScheduledSpeech, rate: int) -> Float32:
    """(n,) float32: the sound of an utterance at a rate, cut off and faded where it was stopped.

    Films and streams are made from it alike. The utterance must have sound.
    """
    utterance = speaking.utterance
    assert utterance.pcm is not None
    pcm = resample(utterance.pcm, utterance.sample_rate, rate)
    if speaking.until < speaking.start + utterance.duration:
        kept = max(0, round((speaking.until + CUT - speaking.start) * rate))
        pcm = pcm[:kept].copy()
        ramp = min(len(pcm), round(CUT * rate))
        pcm[len(pcm) - ramp :] *= np.linspace(1, 0, ramp, dtype=np.float32)
    if speaking.gains:
        times = speaking.start + np.arange(len(pcm)) / rate
        pcm = (pcm * gain_at(speaking.gains, times)).astype(np.float32)
    return pcm


def resample(pcm: Int16, rate: int, wanted: int) -> Float32:
    """PCM at another rate, (n,) float32; linear, after a box filter where the rate falls."""
    samples: Float32 = pcm.astype(np.float32)
    if rate == wanted:
        return samples
    if wanted < rate:
        width = max(1, round(rate / wanted))
        samples = np.convolve(samples, np.full(width, 1 / width, np.float32), "same")
    count = round(len(pcm) * wanted / rate)
    at = np.arange(count) * (rate / wanted)
    out: Float32 = np.interp(at, np.arange(len(samples)), samples).astype(np.float32)
    return out
