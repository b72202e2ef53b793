"""The idle animation of a face: blinks, motion of head and eyes, slow motion, as far as masks leave it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np

from realizer.animation.axis import IDLE_MASKS, mask_channel
from realizer.animation.channel import Channel
from realizer.animation.curves import sample
from realizer.animation.idle.blinks import (
    NOTHING,
    Blinks,
    GazeShift,
    Occasions,
    PhraseEnd,
    blinks_between,
    idle_facts,
)
from realizer.animation.idle.life import Life, face_columns, life_between
from realizer.animation.idle.motion import Motion, motion_between
from realizer.core.array_types import Float64, Index

SPAN = 4.0  # s: blinks are found for spans of this length
# AUs of brows and lids, of the nose, and of the mouth. Where a document shows one, the small movements of the
# same part rest, so that its amounts are exact.
AREAS = ({1, 2, 4, 5, 6, 7, 41, 42, 43, 44, 46}, {9, 38, 39}, {8, *range(10, 38)})
# Masks that replace the usual saccades by others.
LOOKS = ("listening", "thinking")


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
    start, end = first * SPAN, last * SPAN
    saccades = motion_between(start, end, seed).jumps if liveliness else np.zeros(0)
    occasions = Occasions(ends, saccades, shifts) if ends or liveliness else NOTHING
    return blinks_between(start, end, seed, occasions, liveliness)


@dataclass(frozen=True, eq=False)
class IdleLayer:
    """Idle animation in frames."""

    columns: tuple[int, ...]  # (m,) the columns of lids, head and eyes
    values: Float64  # (m, n) 0..1
    face: tuple[int, ...]  # (f,) the columns of small movements, which yield to others; none at liveliness 0
    small: Float64  # (f, n) 0..1, these movements

    @property
    def areas(self) -> Sequence[tuple[list[int], frozenset[int]]]:
        """The parts of the face: the rows of `small` there, and the columns of all AUs."""
        return _areas(self.face)


def idle_layer(idle: Idle, channels: Sequence[Channel], times: Float64) -> IdleLayer:
    """Return the idle animation that the masks among `channels` leave at times (n,)."""
    masks = _masks(channels)
    blinks = idle.blinks
    if fewer := masks["blinks"]:
        blinks = blinks.reduced(1.0 - sample(fewer, blinks.onsets).sum(axis=0))
    shut = blinks.at(times)
    moved, less = _looking(idle.motion, masks, times), _left(masks["motion"], times)
    face, small = tuple[int, ...](), np.zeros((0, len(times)))
    if idle.life is not None:
        face = idle.life.face
        turns, small = idle.life.at(times)
        if (part := _left(masks["life"], times)) is not None:
            turns *= part
            small *= part
        moved += turns
        if shut.any():
            traced, sides, amounts = _traces(face)
            small[traced] = np.maximum(small[traced], idle.liveliness * amounts * shut[sides])
    if less is not None:
        moved *= less
        small *= less
    return IdleLayer((*lids(), *idle.motion.columns), np.concatenate([shut, moved]), face, small)


def motion_left(channels: Sequence[Channel], times: Float64) -> Float64 | None:
    """Return the part (n,) of idle motion that the mask "motion" leaves, or None for all of it."""
    return _left(_masks(channels)["motion"], times)


@cache
def lids() -> tuple[int, ...]:
    return face_columns(45)


@cache
def _areas(columns: tuple[int, ...]) -> list[tuple[list[int], frozenset[int]]]:
    areas = [frozenset(column for number in area for column in face_columns(number)) for area in AREAS]
    return [([k for k, column in enumerate(columns) if column in area], area) for area in areas]


@cache
def _traces(columns: tuple[int, ...]) -> tuple[Index, Index, Float64]:
    """Return the rows of columns that move with a blink, their sides, and their parts (k, 1) of it."""
    units = [(face_columns(int(number)), amount) for number, amount in idle_facts()["trace"].items()]
    rows = [(columns.index(column), k, amount) for both, amount in units for k, column in enumerate(both)]
    traced, sides, amounts = zip(*rows, strict=True)
    return np.array(traced), np.array(sides), np.array(amounts)[:, None]


def _looking(motion: Motion, masks: dict[str, list[Channel]], times: Float64) -> Float64:
    """Return the motion of head and eyes; a document's gaze masks the saccades of listening and thinking."""
    looks = {name: sample(some, motion.jumps) for name in LOOKS if (some := masks[name])}
    patterns = {name: held for name, some in looks.items() if (held := some.sum(axis=0) > 0.5).any()}
    if not patterns:
        return motion.at(times)
    looked = motion.looking(patterns).at(times)
    if (free := _left(masks["eyes"], times)) is not None:
        looked += (motion.at(times) - looked) * (1.0 - free)
    return looked


def _left(masks: Sequence[Channel], times: Float64) -> Float64 | None:
    return 1.0 - np.minimum(sample(masks, times).sum(axis=0), 1.0) if masks else None


def _masks(channels: Sequence[Channel]) -> dict[str, list[Channel]]:
    names = _mask_names()
    masks: dict[str, list[Channel]] = {name: [] for name in names.values()}
    for channel in channels:
        if (name := names.get(channel.target.column)) is not None:
            masks[name].append(channel)
    return masks


@cache
def _mask_names() -> dict[int, str]:
    return {mask_channel(name).column: name for name in ("eyes", *IDLE_MASKS)}
