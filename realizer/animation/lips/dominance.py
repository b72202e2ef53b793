"""Dominance functions of phonemes: the influence of each sound over time.

Source: Cohen & Massaro 1993, "Modeling coarticulation in synthetic visual speech".
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from realizer.animation.lips.visemes import (
    ARTICULATORS,
    PAUSE,
    VISEME_COUNT,
    Mix,
    coarticulation,
    own_shapes,
    shape_table,
    sounds,
)
from realizer.core.array_types import Bool, Float64, Index
from realizer.speech.utterance import Phoneme

STRESS = {0: "none", 1: "primary", 2: "secondary"}


@dataclass(frozen=True, eq=False)
class Track:
    """The sounds of an utterance in order, without the short pauses between them."""

    # begin, end: (m,) float64 seconds
    begin: Float64
    end: Float64
    mix: Float64  # (m, 15) float64, part of each viseme
    target: Float64  # (m, 11) float64 FAPU, the shape of the mouth, with columns as `SHAPE_COLUMNS`
    weight: Float64  # (m, 6) float64, its priority for each of `ARTICULATORS`
    vowel: Bool  # (m,) whether it is a vowel
    size: Float64  # (m,) float64, the part of its shape that it reaches
    effort: Float64  # (m,) float64, factor for the opening of jaw and lips, usually 1
    pressure: Float64  # (m,) float64 0..1, how firmly the lips meet, if it closes them
    rest: Bool  # (m,) whether it is a pause


class _Row(NamedTuple):
    begin: float
    end: float
    mix: Mix
    shape: Mix
    vowel: bool = False
    size: float = 1.0
    effort: float = 1.0
    pressure: float = 1.0


SILENT = ((0, 1.0),)


def track_of(phonemes: Sequence[Phoneme]) -> Track | None:
    """Return the sounds of phonemes (in order, "" is a pause), or None if there are only pauses."""
    rows = _rows(phonemes)
    if all(row.mix in (SILENT, ()) for row in rows):
        return None
    inner = range(1, len(rows) - 1)
    absorbed = coarticulation()["pauses"]["absorbed"]
    rows = [
        row
        for k, row in enumerate(rows)
        if not (k in inner and row.mix == SILENT and row.end - row.begin < absorbed)
    ]
    # The mouth is at rest at the ends, and its lips are parted in pauses between sounds.
    parted = ((own_shapes()[PAUSE], 1.0),)
    rows[1:-1] = [row._replace(shape=parted) if row.mix == SILENT else row for row in rows[1:-1]]
    begin, end = np.array([row.begin for row in rows]), np.array([row.end for row in rows])
    middle = (end[:-1] + begin[1:]) / 2  # sounds touch, or extend to the middle of a short pause
    facts = np.array([_facts(row.mix, row.shape) for row in rows])
    mix, target, weight = np.split(facts, (VISEME_COUNT, -len(ARTICULATORS)), axis=1)
    size = np.array([row.size for row in rows])
    vowel = np.array([row.vowel for row in rows])
    return Track(
        begin=np.concatenate((begin[:1], middle)),
        end=np.concatenate((middle, end[-1:])),
        mix=mix,
        target=target,
        weight=weight,
        vowel=vowel,
        size=size,
        effort=np.array([row.effort for row in rows]),
        pressure=np.array([row.pressure for row in rows]) * _next(size, vowel),
        rest=np.array([row.mix == SILENT for row in rows]),
    )


def _rows(phonemes: Sequence[Phoneme]) -> list[_Row]:
    pressure, loudness = coarticulation()["pressure"], coarticulation()["loudness"]
    follows = loudness["consonant"]
    rows: list[_Row] = []
    for phoneme in phonemes:
        parts = sounds(phoneme.ipa)
        if not parts:
            if rows and rows[-1].mix == SILENT:
                rows[-1] = rows[-1]._replace(end=phoneme.end)
            else:
                rows.append(_Row(phoneme.start, phoneme.end, SILENT, SILENT))
            continue
        at, length = phoneme.start, phoneme.end - phoneme.start
        firm = pressure["sounds"].get(phoneme.ipa[:1], pressure["other"])
        for part in parts:
            until = at + part.share * length
            # Loud vowels open further, silent stops less.
            if part.vowel:
                size, effort = _size(phoneme, until - at), _effort(phoneme.volume, loudness["vowel"])
                rows.append(_Row(at, until, part.mix, part.shape, True, size, effort))
            elif part.mix and part.mix[0][0] in follows["visemes"]:
                effort = _effort(phoneme.volume, follows)
                rows.append(_Row(at, until, part.mix, part.shape, effort=effort))
            else:
                rows.append(_Row(at, until, part.mix, part.shape, pressure=firm))
            at = until
    return rows


def _effort(volume: float, limits: dict[str, Any]) -> float:
    effort: float = max(volume, 0.0) ** limits["exponent"]
    return float(min(max(effort, limits["least"]), limits["most"]))


@lru_cache(maxsize=2048)
def _facts(mix: Mix, shape: Mix) -> Float64:
    """Return (15 + 11 + 6,) the visemes, target and weights of a sound."""
    visemes, (targets, weights) = np.zeros(VISEME_COUNT), shape_table()
    for number, part in mix:
        visemes[number] = part
    parts = np.zeros(len(targets))
    for number, part in shape:
        parts[number] = part
    return np.concatenate((visemes, parts @ targets, parts @ weights))


def _next(size: Float64, vowel: Bool) -> Float64:
    """Return (m,) the size of the vowel after each sound, or of the last one."""
    at = np.flatnonzero(vowel)
    if not len(at):
        return size
    following = np.searchsorted(at, np.arange(len(size))).clip(0, len(at) - 1)
    found: Float64 = size[at[following]]
    return found


def _size(phoneme: Phoneme, length: float) -> float:
    """Return the part of its shape that a vowel of that length reaches; the rest decays exponentially.

    Source: Lindblom 1963, "Spectrographic study of vowel reduction", for formants; here for the mouth.
    """
    short = coarticulation()["undershoot"]
    stress = coarticulation()["stress"][STRESS.get(phoneme.stress, "none")]
    return float(stress * (1 - short["lost"] * math.exp(-length / short["decay"])))


def key_times(phonemes: Sequence[Phoneme], lead: float = 0.0) -> Float64:
    """Return seconds from `lead` before the first phoneme to the last, at the table's rate; at least two."""
    rate = coarticulation()["rate"]
    first, last = phonemes[0].start - lead, max(phonemes[-1].end, phonemes[0].start + 2 / rate)
    return np.linspace(first, last, int(np.ceil((last - first) * rate)) + 1)


def dominances(track: Track, times: Float64) -> Iterator[tuple[Index, Float64, tuple[str, ...]]]:
    """Yield the dominance of the sounds around each time for each of `ARTICULATORS`.

    A row has the sounds, (k, n); their parts, (k, n), which add up to a little less than 1, as the rest
    belongs to the neutral mouth; the columns of `SHAPE_COLUMNS` that the articulator moves.
    """
    facts = coarticulation()
    rule = facts["dominance"]
    length = np.maximum(track.end - track.begin, 1e-3)
    base = np.where(track.vowel, rule["base_vowel"], rule["base_consonant"])
    rate = base * (rule["length"] / length) ** rule["exponent"]
    strength = np.where(track.vowel, rule["strength_vowel"], rule["strength_consonant"])
    weight = track.weight.T * strength
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

    for own, (name, members) in zip(weight, ARTICULATORS.items(), strict=True):
        pace = facts["articulators"][name]
        d = np.exp(-pace["before"] * before - pace["after"] * after)
        d *= _at(own, near)
        d /= d.sum(axis=0) + rule["rest"]
        yield near, d, members


def _at(values: Float64, near: Index) -> Float64:
    """Return `values[..., near]` for valid indices, in half the time."""
    return values.take(near, axis=-1, mode="clip")
