"""Expressions that the frames of a FAP file show, as entries of a timeline."""

import re
from collections.abc import Sequence

import numpy as np

from realizer.animation.axis import au_row
from realizer.animation.fap.fap_reader import read_fap
from realizer.core.array_types import Float64
from realizer.core.errors import RealizerError
from realizer.corpus.find import runs
from realizer.corpus.learn import faps_of, features
from realizer.corpus.matching_pursuit import explain
from realizer.corpus.recording import Recording
from realizer.expressions.expression import Expression
from realizer.expressions.timeline import Entry
from realizer.expressions.timeline_file import MIN_SECONDS
from realizer.tables import HEAD_COLUMNS

FPS = 25.0
MOST_FRAMES = 7500  # five minutes
MOST, WORTH = 10, 0.02  # expressions, and the least share of all squared movement that one more explains
LEAST = 0.06  # intensity of an entry
VALLEY = 0.6  # of the smaller of two peaks; what falls below between them is two entries
WHOLE = 0.9  # of its peak, from which an entry counts as reached


def is_fap(text: str) -> bool:
    """Return whether a text begins as a FAP file does: with a version, or the 68 bits of a mask."""
    lines = (line.split() for line in text.lstrip("\ufeff").splitlines())
    words: list[str] = next((words for words in lines if words and not words[0].startswith("#")), [])
    return len(words) > 1 and all(re.fullmatch(r"[\d.+-]+", word) for word in (words[0], words[-1]))


def fap_entries(text: str, library: Sequence[Expression]) -> tuple[list[tuple[float, Entry]], list[str]]:
    """Return start and entry of each expression that a FAP file shows, and what they do not.

    Expressions are chosen one after the other, each the one that explains most of what is left, with
    intensities by non-negative least squares in millimetres of the face; a peak of one becomes an entry.

    Raises:
        RealizerError: no FAP file, or one without frames or of more than five minutes.
    """
    clip = read_fap(text)
    left = list(clip.notes)
    if not len(clip.values):
        raise RealizerError("wanted frames of FAPs, a mask and values each, got none")
    if len(clip.values) / clip.fps * FPS > MOST_FRAMES:
        raise RealizerError(
            f"wanted FAPs of at most {MOST_FRAMES / FPS:.0f} s, got {len(clip.values) / clip.fps:.1f} s"
        )
    clip = clip.resampled(FPS)
    if clip.visemes[:, :3].any():
        left.append("FAP 1: a timeline holds expressions, got visemes")
    if clip.values[:, HEAD_COLUMNS].any():
        left.append("FAP 48 to 50: a timeline holds expressions, got turns of the head")
    shown = faps_of(np.stack([au_row(one.aus) for one in library])) * clip.mask
    faces, shown = (features(Recording("", faps=faps)) for faps in (clip.values.astype(np.float64), shown))
    chosen, weights = explain(faces, shown, MOST, WORTH)
    entries = [
        found for k, row in zip(chosen, weights.T, strict=True) for found in _entries(library[k].name, row)
    ]
    rest = faces - weights @ shown[chosen]
    if (share := float(np.sum(rest**2)) / max(float(np.sum(faces**2)), 1e-12)) > WORTH:
        where = int(np.argmax(np.sum(rest**2, axis=1)))
        most = int(np.argmax(np.abs(rest[where]))) + 1
        left.append(f"{share:.0%} of the movement, most at {where / FPS:.1f} s in FAP {most}")
    return entries, left


def _entries(name: str, weights: Float64) -> list[tuple[float, Entry]]:
    """Return start and entry of each peak of an expression's intensity (n,), 25 a second."""
    found = []
    for first, last in runs(weights > LEAST / 2):
        for begin, end in _peaks(weights[first : last + 1]):
            part = weights[first + begin : first + end]
            if part.max() < LEAST:
                continue
            full = np.flatnonzero(part >= WHOLE * part.max())
            onset, offset = (max(float(n) / FPS, MIN_SECONDS) for n in (full[0] + 1, len(part) - full[-1]))
            length = max((len(part) + 1) / FPS, onset + offset)
            intensity = round(min(float(part.max()), 1.0), 2)
            start = max((first + begin - 1) / FPS, 0.0)
            found.append((start, Entry(name, intensity, round(length, 3), round(onset, 3), round(offset, 3))))
    return found


def _peaks(weights: Float64) -> list[tuple[int, int]]:
    """Return first frame and end of each peak, cut at the valleys between them."""
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
