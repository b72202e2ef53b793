"""Log-mel spectra of sound that arrives in pieces, and its running loudness and spectrum."""

from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from realizer import tables
from realizer.core.array_types import Float32, Float64, Int16

RATE = 16_000  # Hz; speech has all relevant frequencies below half of it
HOP, WINDOW, SPECTRUM = 160, 400, 512  # samples: 10 ms, 25 ms
SHAPE = np.hanning(WINDOW).astype(np.float32)
BLOCK = 2  # frames that are computed at once
BANDS, LOWEST, HIGHEST = 32, 80.0, 7600.0  # of the mel scale, Hz
QUIETEST = 1e-10  # power of a band; full scale is about 1
# The resampler: a sinc with a Hann window, tabulated in so many steps between two samples.
ZEROS, PHASES = 6, 64
# Natural logarithms of power. The loud level falls slowly, so that it follows the speaker.
FIRST_LEVEL, FALL = -9.0, 0.002  # a frame
ACTIVE = 7.0  # frames this much below the loud level are no speech
PRIOR, LONGEST = 50, 400  # frames that count for the mean spectrum: the usual one, and the last ones

viseme_facts = partial(tables.toml_table, "sound_visemes.toml")


class MelFrames(NamedTuple):
    """Frames, 100 a second; frame k is centred at k x 10 ms."""

    log: Float32  # (n, BANDS) logarithm of the power in each band
    level: Float32  # (n,) the loud level until that frame
    mean: Float32  # (n, BANDS) the mean of the speech until that frame, relative to the loud level


class MelStream:
    """Converts PCM, of `rate` Hz, to mel frames; how it is divided into pieces changes nothing."""

    def __init__(self, rate: int) -> None:
        self._rate = rate
        self._level, self._active = FIRST_LEVEL, PRIOR
        self._mean = np.array(viseme_facts()["mean"])
        taps = _taps(rate)
        self._pcm: Float32 = np.zeros(taps // 2, np.float32)  # at `rate`, from sample `_first` on
        self._first = -(taps // 2)
        self._count = 0  # samples at 16 kHz so far
        self._sound: Float32 = np.zeros(WINDOW // 2, np.float32)  # at 16 kHz, of frames that are to come

    def feed(self, pcm: Int16) -> MelFrames:
        """Return the frames that are complete with this piece."""
        self._pcm = np.append(self._pcm, pcm.astype(np.float32) / np.float32(32768))
        self._sound = np.append(self._sound, self._resample())
        blocks = max(0, (len(self._sound) - WINDOW + HOP) // (BLOCK * HOP))
        log = _log_mel(self._sound, blocks).reshape(-1, BANDS)
        self._sound = self._sound[blocks * BLOCK * HOP :]
        return MelFrames(log, *self._follow(log))

    def _resample(self) -> Float32:
        """Return the samples at 16 kHz for which all neighbours are known."""
        if self._rate == RATE:
            found, self._pcm = self._pcm, self._pcm[:0]
            return found
        taps, table = _taps(self._rate), _sincs(self._rate)
        known = self._first + len(self._pcm) - taps // 2 - 1  # the last place with all neighbours
        count = max(0, known * RATE // self._rate + 1 - self._count)
        if not count:
            return np.zeros(0, np.float32)
        at = np.arange(self._count, self._count + count) * self._rate
        place, phase = at // RATE, (at % RATE) * PHASES // RATE
        near = np.lib.stride_tricks.sliding_window_view(self._pcm, taps)
        parts: Float32 = (near[place - self._first - taps // 2 + 1] * table[phase]).sum(axis=1)
        self._count += count
        done = max(0, self._count * self._rate // RATE - taps // 2 - self._first)
        self._pcm, self._first = self._pcm[done:], self._first + done
        return parts

    def _follow(self, log: Float32) -> tuple[Float32, Float32]:
        """Return the loud level and the mean spectrum after each frame."""
        levels, means = np.empty(len(log), np.float32), np.empty_like(log)
        for k, power in enumerate(log.max(axis=1).tolist()):
            self._level = max(self._level - FALL, power)
            if power > self._level - ACTIVE:
                self._active = min(self._active + 1, LONGEST)
                self._mean += (log[k] - self._level - self._mean) / self._active
            levels[k], means[k] = self._level, self._mean
        return levels, means


def _log_mel(sound: Float32, blocks: int) -> Float32:
    """Return (blocks, BLOCK, BANDS); each block is computed alone, so that rounding is always the same."""
    at = (np.arange(blocks * BLOCK) * HOP).reshape(blocks, BLOCK, 1) + np.arange(WINDOW)
    frames = sound[at] * SHAPE
    power = np.abs(np.fft.rfft(frames, SPECTRUM)).astype(np.float32) ** 2
    mel: Float32 = np.log(np.maximum(power @ _bands(), np.float32(QUIETEST)))
    return mel


@lru_cache(1)
def _bands() -> Float32:
    """Return (spectrum / 2 + 1, BANDS) triangles, so that full scale is 1."""
    return np.asarray(mel_triangles(BANDS, LOWEST, HIGHEST) / (WINDOW / 4) ** 2, np.float32)


@lru_cache(2)
def mel_triangles(bands: int, lowest: float, highest: float) -> Float64:
    """Return (SPECTRUM / 2 + 1, bands) triangles, evenly spread on the mel scale; frequencies in Hz."""
    low, high = (1127 * np.log1p(edge / 700) for edge in (lowest, highest))
    edges = 700 * np.expm1(np.linspace(low, high, bands + 2) / 1127)
    places = np.fft.rfftfreq(SPECTRUM, 1 / RATE)[:, None]
    rise = (places - edges[:-2]) / np.diff(edges[:-1])
    fall = (edges[2:] - places) / np.diff(edges[1:])
    return np.asarray(np.maximum(0.0, np.minimum(rise, fall)), np.float64)


def _taps(rate: int) -> int:
    return 2 * int(np.ceil(ZEROS * max(1.0, rate / RATE)))


@lru_cache(8)
def _sincs(rate: int) -> Float32:
    """Return (PHASES, taps) the weights of the samples around a place between two samples."""
    taps, scale = _taps(rate), min(1.0, RATE / rate)
    distance = np.arange(taps) - taps // 2 + 1 - np.arange(PHASES)[:, None] / PHASES
    shape = scale * np.sinc(scale * distance) * np.cos(np.pi * distance / (taps + 2)) ** 2
    return np.asarray(shape / shape.sum(axis=1, keepdims=True), np.float32)
