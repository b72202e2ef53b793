"""Validation of recordings, and their features by frame: cepstra, loudness and voice activity."""

from functools import cache
from math import gcd

import numpy as np
import numpy.typing as npt

from realizer.core.array_types import Bool, Float32, Float64
from realizer.speech.sound_visemes.mel_stream import RATE as RATE
from realizer.speech.sound_visemes.mel_stream import SPECTRUM, WINDOW, mel_triangles
from realizer.speech.utterance import RATES
from realizer_studio.align.alignment import AlignError

BANDS, LOWEST, HIGHEST = 26, 100.0, 7000.0  # of the mel scale, Hz
KEPT = 13  # cepstra; higher ones depend on the pitch
EMPHASIS = 0.97
# Of the mean energy of a band: added to energies, so that noise in empty bands has no effect.
FLOOR = 0.01
SLOPE = 2  # frames to each side, for the slopes of cepstra
AT_ONCE = 4000  # frames; limits the memory for spectra
# Percentiles of loudness for silence and speech, and the part of the range between them that is not silence.
QUIET, LOUD, HEARD = 5, 95, 0.1
MIN_RANGE, MAX_RANGE = 1.0, 5.0  # powers of ten; steady noise has no range, digital silence too much
CHANNELS = 64
LEAST, MOST = 0.05, 1800.0  # s
SILENCE = 2e-4  # of the full scale: noise in the last bits


def resampled(pcm: Float32, rate: int) -> Float32:
    """Resample (n,) float32 at `rate` Hz to (m,) float32 at 16 kHz."""
    from scipy.signal import resample_poly

    shared = gcd(rate, RATE)
    if rate == RATE:
        return pcm
    return np.asarray(resample_poly(pcm, RATE // shared, rate // shared), np.float32)


def energies(sound: Float32, hop: float) -> Float64:
    """Return the energy (n, bands) in the bands of the mel scale; frame k is centred at k x hop.

    The sound is (m,) at 16 kHz, -1..1; `hop`, in samples, need not be whole.
    """
    flat = np.append(sound[:1], sound[1:] - np.float32(EMPHASIS) * sound[:-1])
    at = np.rint(np.arange(int(len(sound) / hop) + 1) * hop).astype(np.intp)
    padded = np.pad(flat, (WINDOW // 2, WINDOW))
    frames = np.lib.stride_tricks.sliding_window_view(padded, WINDOW)
    shape, bands = np.hamming(WINDOW).astype(np.float32), mel_triangles(BANDS, LOWEST, HIGHEST)
    parts = [
        np.abs(np.fft.rfft(frames[at[k : k + AT_ONCE]] * shape, SPECTRUM)) ** 2 @ bands
        for k in range(0, len(at), AT_ONCE)
    ]
    return np.concatenate(parts)


def cepstra(energy: Float64) -> Float64:
    """Return cepstra (n, 26) of energies (n, bands), with their slopes.

    Source: Davis and Mermelstein 1980 for the cepstra; Furui 1986 for their slopes.
    """
    log = np.log(energy + FLOOR * energy.mean() + 1e-12)
    plain = log @ _cosines()
    return np.hstack([plain, _slopes(plain)])


def loudness(energy: Float64) -> Float64:
    """Return the loudness (n,), in powers of ten, of energies (n, bands)."""
    return np.asarray(np.log10(energy.sum(axis=1) + 1e-9), np.float64)


def voice_activity(loud: Float64) -> tuple[Float64, Bool]:
    """Return the loudness (n,) of frames between silence (0) and speech (1), and which are not silent."""
    low, high = np.percentile(loud, (QUIET, LOUD))
    low = max(low, high - MAX_RANGE)
    part = (loud - low) / max(high - low, MIN_RANGE)
    return part, part > HEARD


def normalised(features: Float64, of: Bool) -> Float64:
    """Scale columns to mean 0 and deviation 1 over the frames `of`; removes effects of room and loudness."""
    chosen = features[of] if of.any() else features
    return np.asarray((features - chosen.mean(axis=0)) / (chosen.std(axis=0) + 1e-6), np.float64)


def _slopes(values: Float64) -> Float64:
    """Return the slope (n, k) of the line through each value and its neighbours."""
    padded = np.pad(values, ((SLOPE, SLOPE), (0, 0)), mode="edge")
    count = len(values)
    steps = range(1, SLOPE + 1)
    rise = sum(k * (padded[SLOPE + k :][:count] - padded[SLOPE - k :][:count]) for k in steps)
    return np.asarray(rise / (2.0 * sum(k * k for k in steps)), np.float64)


@cache
def _cosines() -> Float64:
    angles = np.pi / BANDS * (np.arange(BANDS)[:, None] + 0.5) * np.arange(KEPT)
    return np.asarray(np.cos(angles) * np.sqrt(2 / BANDS), np.float64)


def mono(pcm: npt.ArrayLike, rate: float) -> Float32:
    """Convert (n,) or (n, channels) int16, int32 or floats to (n,) float32 in -1..1, or raise AlignError."""
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
    """Resample to 16 kHz; raise AlignError if the sound is silent."""
    if float(np.abs(sound).max()) < SILENCE:
        raise AlignError("recording: wanted speech, got silence")
    return resampled(sound, rate)
