"""The idle animation of a face: blinks, motion of head and eyes, and slow motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from realizer.animation.idle.blinks import NOTHING, Blinks, GazeShift, Occasions, PhraseEnd, blinks_between
from realizer.animation.idle.life import Life, life_between
from realizer.animation.idle.motion import Motion, motion_between

SPAN = 4.0  # s: blinks are found for spans of this length


@dataclass(frozen=True, eq=False)
class Idle:
    """The idle animation of a face in a span of time; `life` is None at `liveliness` 0."""

    blinks: Blinks
    motion: Motion
    life: Life | None = None
    liveliness: float = 0.0


def idle_face(
    start: float,
    end: float,
    seed: int,
    ends: Sequence[PhraseEnd] = (),
    *,
    liveliness: float = 0.0,
    shifts: Sequence[GazeShift] = (),
) -> Idle:
    """Return the idle animation, and possibly blinks before and after it.

    Args:
        start, end: seconds on the session clock, both included.
        seed: of the character.
        ends: the ends of its phrases, in order of time; a blink near one is moved there.
        liveliness: 0..1; 0 for blinks of equal shape, sway and saccades alone.
        shifts: gaze shifts of documents.
    """
    first, last = math.floor(start / SPAN), math.floor(end / SPAN) + 1
    blinks = _blinks(first, last, seed, tuple(ends), liveliness, tuple(shifts))
    life = life_between(start, end, seed, liveliness) if liveliness else None
    return Idle(blinks, motion_between(start, end, seed), life, liveliness)


@lru_cache(maxsize=256)
def _blinks(
    first: int,
    last: int,
    seed: int,
    ends: tuple[PhraseEnd, ...],
    liveliness: float,
    shifts: tuple[GazeShift, ...],
) -> Blinks:
    """Return the blinks of some spans, for neighbouring windows."""
    start, end = first * SPAN, last * SPAN
    saccades = motion_between(start, end, seed).jumps if liveliness else np.zeros(0)
    occasions = Occasions(ends, saccades, shifts) if ends or liveliness else NOTHING
    return blinks_between(start, end, seed, occasions, liveliness)
