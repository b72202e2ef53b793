"""Dominance functions of phonemes: the influence of each sound over time.

Source: Cohen & Massaro 1993, "Modeling coarticulation in synthetic visual speech".
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from realizer.animation.lips.visemes import SHAPE_COLUMNS, VISEME_COUNT, coarticulation, shape_table, sounds
from realizer.core.array_types import Bool, Float64, Index
from realizer.speech.utterance import Phoneme

CLASSES = {
    "jaw": ("jaw",),
    "lips": ("upper", "lower"),
    "shape": SHAPE_COLUMNS[3:7],
    "tongue": SHAPE_COLUMNS[7:],
}
STRESS = {0: "none", 1: "primary", 2: "secondary"}


@dataclass(frozen=True, eq=False)
class Track:
    """The sounds of an utterance in order, without the short pauses between them.

    Attributes:
        begin, end: (m,) float64 seconds.
        mix: (m, 15) float64, part of each viseme.
        vowel: (m,) whether it is a vowel.
        size: (m,) float64, the part of its shape that it reaches.
        effort: (m,) float64, factor for the opening of jaw and lips, usually 1.
        rest: (m,) whether it is a pause.
    """

    begin: Float64
    end: Float64
    mix: Float64
    vowel: Bool
    size: Float64
    effort: Float64
    rest: Bool


class _Row(NamedTuple):
    begin: float
    end: float
    mix: tuple[tuple[int, float], ...]
    vowel: bool = False
    size: float = 1.0
    effort: float = 1.0


SILENT = ((0, 1.0),)


def track_of(phonemes: Sequence[Phoneme]) -> Track | None:
    """Return the sounds of phonemes (in order, "" is a pause), or None if there are only pauses."""
    facts = coarticulation()
    rows: list[_Row] = []
    for phoneme in phonemes:
        parts = sounds(phoneme.ipa)
        if not parts:
            if rows and rows[-1].mix == SILENT:  # two pauses are one
                rows[-1] = rows[-1]._replace(end=phoneme.end)
            else:
                rows.append(_Row(phoneme.start, phoneme.end, SILENT))
            continue
        at, length = phoneme.start, phoneme.end - phoneme.start
        for part in parts:
            until = at + part.share * length
            if part.vowel:
                rows.append(_Row(at, until, part.mix, True, _size(phoneme, until - at), _effort(phoneme)))
            else:
                rows.append(_Row(at, until, part.mix))
            at = until
    if all(row.mix in (SILENT, ()) for row in rows):
        return None
    # The mouth does not come to rest in a short pause between sounds, but always does at the ends.
    inner = range(1, len(rows) - 1)
    absorbed = facts["pauses"]["absorbed"]
    rows = [
        row
        for k, row in enumerate(rows)
        if not (k in inner and row.mix == SILENT and row.end - row.begin < absorbed)
    ]
    begin, end = np.array([row.begin for row in rows]), np.array([row.end for row in rows])
    middle = (end[:-1] + begin[1:]) / 2  # sounds touch, or extend to the middle of a short pause
    mix = np.zeros((len(rows), VISEME_COUNT))
    for k, row in enumerate(rows):
        for viseme, amount in row.mix:
            mix[k, viseme] = amount
    return Track(
        begin=np.concatenate((begin[:1], middle)),
        end=np.concatenate((middle, end[-1:])),
        mix=mix,
        vowel=np.array([row.vowel for row in rows]),
        size=np.array([row.size for row in rows]),
        effort=np.array([row.effort for row in rows]),
        rest=np.array([row.mix == SILENT for row in rows]),
    )


def _size(phoneme: Phoneme, length: float) -> float:
    """Return the part of its shape that a vowel of that length reaches; the rest decays exponentially.

    Source: Lindblom 1963, "Spectrographic study of vowel reduction", for formants; here for the mouth.
    """
    short = coarticulation()["undershoot"]
    stress = coarticulation()["stress"][STRESS.get(phoneme.stress, "none")]
    return float(stress * (1 - short["lost"] * math.exp(-length / short["decay"])))


def _effort(phoneme: Phoneme) -> float:
    """Return the factor by which a vowel opens further because it is loud."""
    facts = coarticulation()["loudness"]
    return float(min(max(max(phoneme.volume, 0.0) ** facts["exponent"], facts["least"]), facts["most"]))


def key_times(phonemes: Sequence[Phoneme], lead: float = 0.0) -> Float64:
    """Return seconds from `lead` before the first phoneme to the last, at the table's rate; at least two."""
    rate = coarticulation()["rate"]
    first, last = phonemes[0].start - lead, max(phonemes[-1].end, phonemes[0].start + 2 / rate)
    return np.linspace(first, last, int(np.ceil((last - first) * rate)) + 1)


def dominances(track: Track, times: Float64) -> Iterator[tuple[Index, Float64, tuple[str, ...]]]:
    """Yield the dominance of the sounds around each time for each class of articulators.

    Yields:
        The sounds, (k, n); their parts, (k, n), which add up to a little less than 1, as the rest belongs to
        the neutral mouth; the columns of `SHAPE_COLUMNS` that the class moves.
    """
    facts = coarticulation()
    rule = facts["dominance"]
    length = np.maximum(track.end - track.begin, 1e-3)
    base = np.where(track.vowel, rule["base_vowel"], rule["base_consonant"])
    rate = base * (rule["length"] / length) ** rule["exponent"]
    strength = np.where(track.vowel, rule["strength_vowel"], rule["strength_consonant"])
    weight = (track.mix @ shape_table()[1]).T * strength
    # A pause is at rest except at its edges; a sound is strongest in its middle part.
    edge = np.where(track.rest, np.minimum(0.1, length / 3), length * (1 - rule["core"]) / 2)
    core_begin, core_end = track.begin + edge, track.end - edge

    # Sounds further away than `neighbours` have no visible influence, so a band replaces the full matrix.
    # Times are the last axis, along which numpy is fast.
    band = np.arange(-rule["neighbours"], rule["neighbours"] + 1)[:, None]
    near = np.searchsorted(track.begin, times, "right") - 1 + band
    beyond = (near < 0) | (near >= len(length))
    near = near.clip(0, len(length) - 1)
    fall = _at(rate, near)
    before = fall * np.maximum(_at(core_begin, near) - times, 0)
    after = fall * np.maximum(times - _at(core_end, near), 0)
    before[beyond] = np.inf

    for own, (name, members) in zip(weight, CLASSES.items(), strict=True):
        pace = facts["articulators"][name]
        d = np.exp(-pace["before"] * before - pace["after"] * after)
        d *= _at(own, near)
        d /= d.sum(axis=0) + rule["rest"]
        yield near, d, members


def _at(values: Float64, near: Index) -> Float64:
    """Return `values[..., near]` for valid indices, in half the time."""
    return values.take(near, axis=-1, mode="clip")
