"""Channels and times -> AUFrames: layers laid over each other, whatever the order of the channels."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache

import numpy as np

from realizer import tables
from realizer.animation.channel import Channel, Layer
from realizer.animation.curves import sample, weights
from realizer.animation.frames import AUFrames
from realizer.animation.idle import Blink
from realizer.animation.targets import AU_NAMES, axis, presence, region
from realizer.arrays import Bool, Float64
from realizer.tables.cooccurrence import Rules

__all__ = ["blend"]

# What replaces what lies below, the upper one last.
OVER = (Layer.FAPS, Layer.DIRECT)


def blend(channels: Iterable[Channel], times: Float64, rules: Rules | None = None) -> AUFrames:
    """What all channels show together.

    Column by column of the axis:

    - AUs: the strongest channel wins; rotations (combine = "sum" in the table) of all layers add up.
    - BASE states add up, so that one which is faded out while another rises passes smoothly into it; the
      part of a region that the GAZE layer has taken (its presence) is taken from them.
    - GAZE: where several gazes claim a region together more than once, each gets its share of it.
    - IDLE: the part of its motion and of its blinks that base states have taken does not show. A blink comes
      whole or not at all, as it is when it begins.
    - FAPs add up; presences add up to at most 1.
    - FAPS, and above it DIRECT: as far as such a channel is there, it replaces all that lies below; of a FAP
      that is also what AUs ask of it (`AUFrames.held`). Several in one layer that are there more than once
      together each get their share.

    AUs are limited to 0..1 at the end.

    Args:
        channels: any number, any order; times on the same clock as `times`.
        times: (n,) seconds, any order.
        rules: which AUs a face can show together; None: all of them.
    """
    times = np.asarray(times, np.float64)
    alive = _alive(channels, times)
    # Only the columns that something moves are worked on; `place` says where each of them stands.
    columns = sorted({channel.target.column for channel in alive})
    place = {column: i for i, column in enumerate(columns)}
    sampled = sample(alive, times)
    _take_idle(sampled, alive)
    sums = _sums()[columns]
    shape = (len(columns), len(times))
    base, gaze, over = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for channel, row in zip(alive, sampled, strict=True):
        i = place[channel.target.column]
        if channel.layer in OVER:
            continue
        if channel.layer is Layer.BASE:
            base[i] += row
        elif channel.layer is Layer.GAZE and sums[i]:
            gaze[i] += row
        elif sums[i]:
            over[i] += row
        else:
            np.maximum(over[i], row, out=over[i])
    for name, aus in _regions().items():
        if (taken := place.get(axis()[name].column)) is not None:
            share = gaze[taken].copy()
            part = [place[column] for column in (*aus, axis()[name].column) if column in place]
            gaze[part] /= np.maximum(share, 1.0)
            base[part] *= 1.0 - np.minimum(share, 1.0)
    over += gaze
    # Base states and expressions: the stronger one shows; rotations add up.
    values = np.where(sums[:, None], base + over, np.maximum(base, over))
    held = np.zeros(shape)
    for layer in OVER:
        rows = [k for k, channel in enumerate(alive) if channel.layer is layer]
        _override(values, held, place, [alive[k] for k in rows], sampled[rows], times)
    # The FAPs between AUs and presences have limits of their own.
    faps = np.array([0 <= column - len(AU_NAMES()) < 68 for column in columns], bool)
    np.clip(values, 0.0, 1.0, out=values, where=~faps[:, None])
    frames = np.zeros((len(times), len(axis())), np.float32)
    frames[:, columns] = values.T
    if not held[faps].any():
        return AUFrames(times, frames, rules)
    of_faps = np.zeros((len(times), 68), np.float32)
    of_faps[:, np.array(columns)[faps] - len(AU_NAMES())] = held[faps].T
    return AUFrames(times, frames, rules, of_faps)


def _alive(channels: Iterable[Channel], times: Float64) -> list[Channel]:
    if not len(times):
        return []
    first, last = float(np.min(times)), float(np.max(times))
    alive = []
    for channel in channels:
        begin, end = channel.span
        if begin <= last and end >= first:
            alive.append(channel)
    return alive


def _take_idle(sampled: Float64, channels: list[Channel]) -> None:
    """Take from the idle channels what the presences "motion" and "blinks" say, in place, of their rows."""
    lids, moves = presence("blinks").column, presence("motion").column
    taking = [channel for channel in channels if channel.target.column == lids]
    motion = [i for i, channel in enumerate(channels) if channel.target.column == moves]
    if not taking and not motion:
        return
    blinks = [(i, channel) for i, channel in enumerate(channels) if isinstance(channel, Blink)]
    begins = np.array([blink.times[0] for _, blink in blinks])
    kept = 1.0 - np.minimum(sample(taking, begins).sum(axis=0), 1.0)
    for (i, blink), part in zip(blinks, kept, strict=True):
        sampled[i] *= part > blink.draw
    still = 1.0 - np.minimum(sampled[motion].sum(axis=0), 1.0)
    for i, channel in enumerate(channels):
        if channel.layer is Layer.IDLE and not isinstance(channel, Blink):
            sampled[i] *= still


def _override(
    values: Float64,
    held: Float64,
    place: dict[int, int],
    channels: list[Channel],
    sampled: Float64,
    times: Float64,
) -> None:
    """Lay the channels of a layer over `values` (columns that are moved, n), in place, and so `held`."""
    if not channels:
        return
    there, shown = np.zeros_like(values), np.zeros_like(values)
    for channel, value, weight in zip(channels, sampled, weights(channels, times), strict=True):
        i = place[channel.target.column]
        there[i] += weight
        shown[i] += value
    shown /= np.maximum(there, 1.0)
    left = 1.0 - np.minimum(there, 1.0)
    values *= left
    values += shown
    held[:] = 1.0 - (1.0 - held) * left


@cache
def _sums() -> Bool:
    """(n_targets,) True where channels add up."""
    sums = np.ones(len(axis()), bool)
    known = tables.by_number(tables.action_units())
    sums[: len(AU_NAMES())] = [known[int(name.rstrip("LR"))].combine == "sum" for name in AU_NAMES()]
    return sums


@cache
def _regions() -> dict[str, list[int]]:
    """The presences that a gaze takes -> AU columns of that region."""
    regions: dict[str, list[int]] = {"eyes": [], "head": []}
    for name in AU_NAMES():
        if region(axis()[name]) in regions:
            regions[region(axis()[name])].append(axis()[name].column)
    return regions
