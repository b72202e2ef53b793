"""Validation of recordings, and resampling to 16 kHz."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from realizer.core.array_types import Float32
from realizer.speech.align.alignment import AlignError
from realizer.speech.align.features import resampled

RATES = (1000, 384_000)  # Hz
CHANNELS = 64
LEAST, MOST = 0.05, 1800.0  # s
SILENCE = 2e-4  # of the full scale: noise in the last bits


def mono(pcm: npt.ArrayLike, rate: float) -> Float32:
    """Convert (n,) or (n, channels) int16, int32 or floats to (n,) float32 in -1..1.

    Raises:
        AlignError: if the samples or the rate are invalid.
    """
    samples = np.asarray(pcm)
    if not (np.isfinite(rate) and RATES[0] <= rate <= RATES[1] and float(rate).is_integer()):
        raise AlignError(f"rate: wanted a whole number of {RATES[0]}..{RATES[1]} Hz, got {rate}")
    if samples.ndim not in (1, 2) or (samples.ndim == 2 and not 1 <= samples.shape[1] <= CHANNELS):
        raise AlignError(f"recording: wanted (n,) or (n, channels) samples, got the shape {samples.shape}")
    if samples.dtype not in (np.int16, np.int32, np.float32, np.float64):
        raise AlignError(f"recording: wanted int16, int32 or floats in -1..1, got {samples.dtype}")
    seconds = len(samples) / rate
    if not LEAST <= seconds <= MOST:
        raise AlignError(f"recording: wanted {LEAST:g}..{MOST:g} s of sound, got {seconds:g} s")
    scale = {"int16": 2.0**15, "int32": 2.0**31}.get(samples.dtype.name, 1.0)
    sound: Float32 = (samples / scale).astype(np.float32)
    if sound.ndim == 2:
        sound = sound.mean(axis=1, dtype=np.float32)
    if not np.isfinite(sound).all():
        raise AlignError("recording: wanted finite samples, got some that are not")
    return np.clip(sound, -1.0, 1.0)


def to_aligner(sound: Float32, rate: int) -> Float32:
    """Resample to 16 kHz.

    Raises:
        AlignError: if the sound is silent.
    """
    if float(np.abs(sound).max()) < SILENCE:
        raise AlignError("recording: wanted speech, got silence")
    return resampled(sound, rate)
