"""Rendering of utterances as samples at any rate, cut off and faded as heard."""

from __future__ import annotations

import numpy as np

from realizer.animation.curves import gain_at
from realizer.core.array_types import Float32, Int16
from realizer.playback.scheduled_speech import ScheduledSpeech

# Duration of the fade of cut-off speech, which avoids a click; with half a packet it is over in 50 ms.
CUT = 0.04  # s


def render_utterance(speaking: ScheduledSpeech, rate: int) -> Float32:
    """Return (n,) float32 samples of an utterance with sound, cut off and faded if it was stopped.

    Films and streams both use it.
    """
    utterance = speaking.utterance
    assert utterance.pcm is not None
    pcm = resample(utterance.pcm, utterance.sample_rate, rate)
    if speaking.until < speaking.start + utterance.duration:
        length = max(0, round((speaking.until + CUT - speaking.start) * rate))
        pcm = pcm[:length].copy()
        ramp = min(len(pcm), round(CUT * rate))
        pcm[len(pcm) - ramp :] *= np.linspace(1, 0, ramp, dtype=np.float32)
    if speaking.gains:
        times = speaking.start + np.arange(len(pcm)) / rate
        pcm = (pcm * gain_at(speaking.gains, times)).astype(np.float32)
    return pcm


def resample(pcm: Int16, rate: int, wanted: int) -> Float32:
    """Return PCM at another rate, (n,) float32: linear interpolation, box-filtered if the rate falls."""
    samples: Float32 = pcm.astype(np.float32)
    if rate == wanted or not len(pcm):
        return samples
    if wanted < rate:
        width = max(1, round(rate / wanted))
        samples = np.convolve(samples, np.full(width, 1 / width, np.float32), "same")
    count = round(len(pcm) * wanted / rate)
    at = np.arange(count) * (rate / wanted)
    out: Float32 = np.interp(at, np.arange(len(samples)), samples).astype(np.float32)
    return out
