"""The loudness of vowels, and the melody of an utterance: its loudness and pitch over time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from realizer.core.array_types import Bool, Float32, Float64
from realizer.speech.accents import phrases, prosody_facts
from realizer.speech.utterance import Phoneme, Utterance
from realizer.tables.phonemes import vowels

STEP = 8  # every so many samples are measured, which is enough for a mean
SHORT, SILENT = 0.01, 0.03  # s; of the loud parts, below which a window is silent
STOPS = "pbtdkɡgqʔ"  # they begin and end with silence
LEAST = 0.02  # s of a sound beside a pause


def with_loudness(utterance: Utterance) -> tuple[Phoneme, ...]:
    """Return its phonemes, with the requested volume times the loudness at which they are heard.

    The loudness is relative to the median of the vowels, and the last accent of a phrase, which is the most
    prominent one, is louder by the table's factor. Pauses include the silence that a voice counts to the
    sounds beside them.
    """
    sound = Levels(utterance) if utterance.pcm is not None and utterance.sample_rate else None
    phonemes = utterance.phonemes if sound is None else _with_whole_pauses(utterance, sound)
    vocal = np.array([phoneme.ipa[:1] in vowels() for phoneme in phonemes])
    if not vocal.any():
        return phonemes
    spans = np.array([(phoneme.start, phoneme.end) for phoneme in phonemes])
    loud = np.ones(len(spans)) if sound is None else _relative(sound.of(spans), vocal)
    for accent in (
        accent.time for phrase in phrases(utterance) for accent in phrase.accents if accent.nuclear
    ):
        at = vocal & (spans[:, 0] <= accent) & (accent < spans[:, 1])
        loud[at] *= prosody_facts()["accents"]["louder"]
    return tuple(
        Phoneme(one.start, one.end, one.ipa, one.stress, one.volume * factor) if one.ipa else one
        for one, factor in zip(phonemes, loud.tolist(), strict=True)
    )


def _with_whole_pauses(utterance: Utterance, sound: Levels) -> tuple[Phoneme, ...]:
    """Return the phonemes, with the silence beside a pause in the pause."""
    phonemes = list(utterance.phonemes)
    pauses = [k for k in range(1, len(phonemes) - 1) if not phonemes[k].ipa]
    if not pauses:
        return utterance.phonemes
    begins = np.arange(int(utterance.duration / SHORT)) * SHORT
    levels = sound.of(np.stack([begins, begins + SHORT], axis=1))
    heard = begins[levels > SILENT * quantile(levels, 0.9)]
    for k in pauses:
        before, pause, after = phonemes[k - 1 : k + 2]
        if before.ipa[:1] not in STOPS:
            last = heard[(heard >= before.start) & (heard < before.end)]
            end = max(last[-1] + SHORT if len(last) else 0.0, before.start + LEAST)
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


def _relative(levels: Float64, vocal: Bool) -> Float64:
    """Return levels (m,) over the median of the vocal ones, within the table's limits; 1 for silence."""
    usual = float(np.median(levels[vocal]))
    limit = prosody_facts()["accents"]["range"]
    return np.clip(levels / usual, 1 / limit, limit) if usual > 0 else np.ones(len(levels))


def quantile(values: npt.NDArray[np.floating], part: float) -> float:
    """Return what `np.quantile` does, in a quarter of the time; its first call imports numpy.ma, too."""
    ordered = np.sort(values)
    place = (len(values) - 1) * part
    low, high = ordered[int(place)], ordered[min(int(place) + 1, len(values) - 1)]
    share = place - int(place)
    return float(low + (high - low) * share if share < 0.5 else high - (high - low) * (1 - share))


RATE = 25.0  # values a second
CLOSING = 0.5  # s of silence after the last phrase
# Analysis of pitch, in samples of about `ANALYSED` Hz.
ANALYSED = 7000
WINDOW = 320
TRANSFORMED = 512  # at least a window and the longest delay
BLOCK = 40  # windows analysed at once, in the processor's cache: more take twice as long
LOWEST, HIGHEST = 65.0, 400.0  # Hz
VOICED = 0.35  # least autocorrelation of a voiced window, beside that of no delay
QUIET = 0.04  # a window this much quieter than the loud ones has no pitch
# Without sound: the melody of an accent, and the fall of the voice within a phrase. Ours.
ACCENT_WIDTH = 0.12  # s
ACCENT_RISE, NUCLEAR_RISE, FALL = 2.0, 3.5, 2.5  # semitones
OCTAVE = 12.0  # semitones


@dataclass(frozen=True, eq=False)
class Melody:
    """Loudness and pitch, `RATE` values a second from the start of the utterance to `CLOSING` after it."""

    loudness: Float64  # (n,) 0..1; 1 is the loud parts of the utterance
    pitch: Float64  # (n,) semitones above the utterance's median; interpolated where there is no voice


# Results are cached as long as the utterance is in use.
_known: WeakKeyDictionary[Utterance, Melody] = WeakKeyDictionary()


def melody(utterance: Utterance) -> Melody:
    """Return the melody: of the sound, or without sound the one that accents and phrases suggest."""
    found = _known.get(utterance)
    if found is None:
        has_sound = utterance.pcm is not None and utterance.sample_rate and utterance.pcm.any()
        found = _known[utterance] = (_heard if has_sound else _suggested)(utterance)
    return found


def _end(utterance: Utterance) -> float:
    """Return the end of the last phrase. A closing silence, which may be cut off later, changes nothing."""
    return found[-1].end if (found := phrases(utterance)) else 0.0


def _count(utterance: Utterance) -> int:
    return int((_end(utterance) + CLOSING) * RATE) + 1


def _heard(utterance: Utterance) -> Melody:
    assert utterance.pcm is not None
    step = max(1, round(utterance.sample_rate / ANALYSED))
    rate = utterance.sample_rate / step
    count = round(_end(utterance) * rate)
    pcm = utterance.pcm[: count * step]
    parts = np.zeros(count * step, np.float32)
    parts[: len(pcm)] = pcm
    samples = parts.reshape(-1, step) @ np.full(step, 1.0 / step, np.float32)
    count = _count(utterance)
    begins = (np.arange(count) * rate / RATE).astype(int)
    padded = np.zeros(WINDOW // 2 + max(len(samples), int(begins[-1]) + WINDOW // 2), np.float32)
    padded[WINDOW // 2 :][: len(samples)] = samples
    blocks = (begins[k : k + BLOCK] for k in range(0, count, BLOCK))
    found = [_analysed(padded[at[:, None] + np.arange(WINDOW)], rate) for at in blocks]
    power, period, likeness = (np.concatenate(column) for column in zip(*found, strict=True))
    loud = quantile(power, 0.9) or 1.0
    is_voiced = (likeness > VOICED) & (power > QUIET * loud)
    return Melody(_smoothed(np.minimum(power / loud, 1.0)), _pitch(rate / period, is_voiced))


def _analysed(windows: Float32, rate: float) -> tuple[Float32, Float64, Float64]:
    """Return the power, the period in samples and the autocorrelation there, (n,) each, of windows (n, k)."""
    windows *= _bell()
    power = np.sqrt(np.einsum("ij,ij->i", windows, windows) / WINDOW)
    # Autocorrelation by the Fourier transform, divided by that of the window (Boersma 1993).
    least, most = int(rate / HIGHEST), min(int(rate / LOWEST), WINDOW // 2 - 2)
    correlation = _autocorrelation(windows)[:, : most + 1]
    correlation /= np.maximum(correlation[:, :1], 1e-9) * _own()[: most + 1]
    # Of almost equal maxima the shortest delay counts: longer ones are its multiples.
    inside = correlation[:, least:most] - 0.1 * np.arange(least, most) / most
    delay = least + inside.argmax(axis=1)
    before, at, after = (correlation[np.arange(len(windows)), delay + k] for k in (-1, 0, 1))
    bend = np.minimum(before - 2 * at + after, -1e-9)
    period = delay + np.clip((before - after) / (2 * bend), -0.5, 0.5)  # of the parabola through the three
    return power, period, at


def _autocorrelation(windows: npt.NDArray[np.floating]) -> Float64:
    spectrum = np.fft.rfft(np.asarray(windows, np.float64), TRANSFORMED)  # of float32 it takes twice as long
    found: Float64 = np.fft.irfft(spectrum.real**2 + spectrum.imag**2)
    return found


@cache
def _bell() -> Float32:
    return np.hanning(WINDOW).astype(np.float32)


@cache
def _own() -> Float64:
    """Return the autocorrelation of the window itself, beside that of no delay."""
    own = _autocorrelation(np.hanning(WINDOW))
    own /= own[0]
    return own


def _pitch(hertz: Float64, is_voiced: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Float64:
    """Return semitones above the median; octaves that the analysis has mistaken are corrected."""
    at = np.flatnonzero(is_voiced)
    if len(at) < 3:
        return np.zeros(len(hertz))
    semitones = OCTAVE * np.log2(hertz[at])
    semitones -= np.median(semitones)
    semitones -= OCTAVE * np.round(semitones / (1.5 * OCTAVE))
    return _smoothed(np.interp(np.arange(len(hertz)), at, np.clip(semitones, -OCTAVE, OCTAVE)))


def _suggested(utterance: Utterance) -> Melody:
    times = np.arange(_count(utterance)) / RATE
    loudness, pitch = np.zeros(len(times)), np.zeros(len(times))
    for phrase in phrases(utterance):
        inside = (times >= phrase.start) & (times <= phrase.end)
        loudness[inside] = 0.5
        pitch[inside] -= FALL * (times[inside] - phrase.start) / max(phrase.end - phrase.start, 0.1)
        for accent in phrase.accents:
            bump = np.exp(-(((times - accent.time) / ACCENT_WIDTH) ** 2))
            loudness += 0.5 * bump * inside
            pitch += (NUCLEAR_RISE if accent.nuclear else ACCENT_RISE) * bump
    return Melody(_smoothed(np.minimum(loudness, 1.0)), _smoothed(pitch))


def _smoothed(values: Float64) -> Float64:
    """Return the values after a short low-pass filter without delay, about 4 Hz."""
    padded = values[np.arange(-2, len(values) + 2).clip(0, len(values) - 1)]
    smooth: Float64 = np.convolve(padded, [0.1, 0.2, 0.4, 0.2, 0.1], "valid")
    return smooth
