"""Conversion of a FAP file to entries of a timeline: expressions, and keyframes for the rest."""

import math
import re
from collections.abc import Iterable, Sequence

import numpy as np

from realizer.animation.axis import au_row
from realizer.animation.fap.fap_clip import FAPClip
from realizer.animation.fap.fap_reader import read_fap
from realizer.behaviours.fap_visemes import expand_compound
from realizer.core.array_types import Float64
from realizer.core.errors import RealizerError
from realizer.expressions.expression import Expression
from realizer.expressions.timeline import Entry
from realizer.expressions.timeline_file import MIN_SECONDS
from realizer.tables import HEAD_COLUMNS
from realizer_studio.corpus.face_map import explain, faps_of, features
from realizer_studio.corpus.finder import runs
from realizer_studio.corpus.recording import Recording

FPS = 25.0
MOST_FRAMES = 7500  # five minutes
MOST_NUMBERS = 100_000  # of keyframes; the page sends them with every question
MOST, LEAST_GAIN = (
    10,
    0.02,
)  # expressions at most; least share of the squared displacement that one more explains
LEAST = 0.06  # intensity of an entry
VALLEY = 0.6  # of the smaller of two peaks; a deeper valley between them separates two entries
REACHED = 0.9  # of its peak, between onset and offset of an entry


def is_fap(text: str) -> bool:
    """Return whether a text begins as a FAP file does: with a version, or the 68 bits of a mask."""
    lines = (line.split() for line in text.lstrip("\ufeff").splitlines())
    words: list[str] = next((words for words in lines if words and not words[0].startswith("#")), [])
    return len(words) > 1 and all(re.fullmatch(r"[\d.+-]+", word) for word in (words[0], words[-1]))


def fap_entries(
    text: str, library: Sequence[Expression]
) -> tuple[list[tuple[float, Entry]], list[tuple[float, Entry]], list[str]]:
    """Return start and entry of the expressions in a FAP file, of its keyframes, and notes.

    Expressions are chosen by matching pursuit, with intensities by non-negative least squares in
    millimetres of the face; each peak becomes an entry. A movement that expressions do not explain becomes
    keyframes, and so do head rotations and visemes, the latter as the FAPs of their mouths.

    Raises:
        RealizerError: no FAP file, or one without frames or of more than five minutes.
    """
    coded = read_fap(text)
    clip = expand_compound(coded)
    notes = list(clip.notes)
    if not len(clip.values):
        raise RealizerError("wanted frames of FAPs, a mask and values each, got none")
    if len(clip.values) / clip.fps * FPS > MOST_FRAMES:
        raise RealizerError(
            f"wanted FAPs of at most {MOST_FRAMES / FPS:.0f} s, got {len(clip.values) / clip.fps:.1f} s"
        )
    if coded.visemes[:, :3].any():
        notes.append("FAP 1: visemes are kept as the FAPs of their mouths")
    slow = clip.resampled(FPS)
    shapes = faps_of(np.stack([au_row(one.aus) for one in library])) * clip.mask
    faces, shapes = (features(Recording("", faps=faps)) for faps in (slow.values.astype(np.float64), shapes))
    chosen, weights = explain(faces, shapes, MOST, LEAST_GAIN)
    residual, total = (np.sum(rows**2, axis=1) for rows in (faces - weights @ shapes[chosen], faces))
    keyframes, columns = list[tuple[float, Entry]](), range(68)
    for first, last in runs(np.any(clip.values, axis=1)):
        low, high = (round(frame / clip.fps * FPS) for frame in (first, last))
        explained = residual[low : high + 1].sum() <= LEAST_GAIN * max(total[low : high + 1].sum(), 1e-12)
        if not explained:
            weights[low : high + 1] = 0
        if found := _keyframes(clip, first, last, columns[HEAD_COLUMNS] if explained else columns[2:]):
            keyframes.append(found)
    size = 0
    for number, (start, entry) in enumerate(keyframes):
        size += len(entry.keys) * (len(entry.faps) + 1)
        if size > MOST_NUMBERS:
            notes.append(f"keyframes from {start:.1f} s on: more than {MOST_NUMBERS} numbers")
            del keyframes[number:]
            break
    entries = [
        found for k, row in zip(chosen, weights.T, strict=True) for found in _entries(library[k].name, row)
    ]
    return entries, keyframes, notes


def _keyframes(clip: FAPClip, first: int, last: int, columns: Iterable[int]) -> tuple[float, Entry] | None:
    """Return the keyframes of a run with a frame of rest on each side, or None if these FAPs do not move."""
    moved = [column for column in columns if clip.values[first : last + 1, column].any()]
    if not moved:
        return None
    first, last = max(first - 1, 0), min(last + 1, len(clip.values) - 1)
    times, rows = np.arange(first, last + 1) / clip.fps, clip.values[first : last + 1, moved]
    # Entries begin and end at whole milliseconds, where the first and last frames are repeated.
    begin, end = math.floor(times[0] * 1000 + 1e-6) / 1000, math.ceil(times[-1] * 1000 - 1e-6) / 1000
    times = np.round(times - begin, 9)
    end = max(end, begin + MIN_SECONDS)
    before, after = int(times[0] > 0), int(end - begin - times[-1] > 1e-7)
    times = np.r_[[0.0] * before, times, [round(end - begin, 9)] * after]
    rows = np.r_[rows[:1].repeat(before, axis=0), rows, rows[-1:].repeat(after, axis=0)]
    keys = tuple((time, *row) for time, row in zip(times.tolist(), rows.tolist(), strict=True))
    faps = tuple(column + 1 for column in moved)
    return begin, Entry("keyframes", duration=keys[-1][0], faps=faps, keys=keys)


def _entries(name: str, weights: Float64) -> list[tuple[float, Entry]]:
    """Return start and entry of each peak of an expression's intensity (n,), 25 a second."""
    found = []
    for first, last in runs(weights > LEAST / 2):
        for begin, end in _peaks(weights[first : last + 1]):
            part = weights[first + begin : first + end]
            if part.max() < LEAST:
                continue
            full = np.flatnonzero(part >= REACHED * part.max())
            onset, offset = (max(float(n) / FPS, MIN_SECONDS) for n in (full[0] + 1, len(part) - full[-1]))
            length = max((len(part) + 1) / FPS, onset + offset)
            intensity = round(min(float(part.max()), 1.0), 2)
            start = max((first + begin - 1) / FPS, 0.0)
            found.append((start, Entry(name, intensity, round(length, 3), round(onset, 3), round(offset, 3))))
    return found


def _peaks(weights: Float64) -> list[tuple[int, int]]:
    """Return first frame and end of each peak, separated at the valleys."""
    cuts, top, low = [0], 0.0, 0  # the height of the peak so far, and its lowest frame since
    for k, weight in enumerate(weights.tolist()):
        if weights[low] < VALLEY * min(top, weight):
            cuts.append(low)
            top, low = weight, k
        elif weight >= top:
            top, low = weight, k
        elif weight < weights[low]:
            low = k
    return list(zip(cuts, [*cuts[1:], len(weights)], strict=True))
