"""Step 5, blending: channels sampled and laid over each other in layers, in any order."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable
from functools import cache

import numpy as np

from realizer import tables
from realizer.animation.axis import AU_NAMES, au, axis, mask_channel, region
from realizer.animation.channel import Channel, Layer
from realizer.animation.curves import Samples, in_order, sample, samples, weights
from realizer.animation.frames import AUFrames
from realizer.animation.idle.motion import Idle
from realizer.core.array_types import Float32, Float64, Index
from realizer.tables.cooccurrence import Rules

# What replaces what lies below, the upper one last.
OVER = (Layer.FAPS, Layer.DIRECT)
# What is worked out apart from the others, where it adds up.
APART = (Layer.BASE, Layer.GAZE)


def blend(
    channels: Iterable[Channel], times: Float64, rules: Rules | None = None, idle: Idle | None = None
) -> AUFrames:
    """What all channels show together.

    Column by column of the axis:

    - AUs: the strongest channel wins; rotations (combine = "sum" in the table) of all layers add up.
    - BASE states add up, so that one which is faded out while another rises passes smoothly into it; the
      part of a region that the GAZE layer has taken (its presence) is taken from them.
    - GAZE: where several gazes claim a region together more than once, each gets its share of it.
    - IDLE: the part of its motion and of its blinks that the presences "motion" and "blinks" have taken does
      not show. A blink comes whole or not at all, as it is when it begins.
    - FAPs add up; presences add up to at most 1.
    - FAPS, and above it DIRECT: as far as such a channel is there, it replaces all that lies below; of a FAP
      that is also what AUs ask of it (`AUFrames.overridden`). Several in one layer that are there more than
      once together each get their share.

    AUs are limited to 0..1 at the end.

    Args:
        channels: any number, any order; times on the same clock as `times`.
        times: (n,) seconds, any order.
        rules: which AUs a face can show together; None: all of them.
        idle: what the face does by itself between the first and the last of the times.
    """
    asked = np.asarray(times, np.float64)
    order = in_order(asked)
    times = asked if order is None else asked[order]
    alive = _visible(channels, times)
    # Only the columns that something moves are worked on; `place` says where each of them stands.
    moved = {channel.target.column for channel in alive}
    if idle is not None:
        moved |= {*idle.motion.columns, *_lids()}
    columns = sorted(moved)
    place = {column: i for i, column in enumerate(columns)}
    values, base, gaze = _layers(alive, idle, place, times)
    if gaze is not None:
        _share_regions(gaze, base, place)
        values += gaze
    if base is not None:
        # Base states and expressions: the stronger one shows; rotations add up.
        adds = np.array([_sums()[column] for column in columns])[:, None]
        values = np.where(adds, base + values, np.maximum(base, values))
    held = _override(values, alive, place, times)
    # The FAPs between AUs and presences have limits of their own.
    first, last = (bisect_left(columns, len(AU_NAMES()) + count) for count in (0, 68))
    for limited in (values[:first], values[last:]) if first < last else (values,):
        np.clip(limited, 0.0, 1.0, out=limited)
    frames = _by_column(values, columns, len(axis()), order)
    if held is None or not held[first:last].any():
        return AUFrames(asked, frames, rules, None, tuple(columns))
    faps = [column - len(AU_NAMES()) for column in columns[first:last]]
    return AUFrames(asked, frames, rules, _by_column(held[first:last], faps, 68, order), tuple(columns))


def _visible(channels: Iterable[Channel], times: Float64) -> list[Channel]:
    if not len(times):
        return []
    first, last = float(times[0]), float(times[-1])
    spans = ((channel, channel.span) for channel in channels)
    return [channel for channel, (begin, end) in spans if begin <= last and end >= first]


def _layers(
    channels: list[Channel], idle: Idle | None, place: dict[int, int], times: Float64
) -> tuple[Float64, Float64 | None, Float64 | None]:
    """(c, n) each of the columns in `place`: expressions, base states and gazes (None: there are none).

    Expressions are all that neither is one of the others nor replaces what lies below.
    """
    own = [channel for channel in channels if channel.layer not in OVER]
    layers = {Layer.EXPRESSION: 0}
    rows, adds, sums = [], [], _sums()
    for channel in own:
        column, layer = channel.target.column, channel.layer
        adds.append(layer is Layer.BASE or sums[column])
        apart = layer if adds[-1] and layer in APART else Layer.EXPRESSION
        rows.append(layers.setdefault(apart, len(layers)) * len(place) + place[column])
    whole = np.zeros((len(layers), len(place), len(times)))
    if idle is not None:
        _begin_idle(whole[0], idle, channels, place, times)
    if own:
        found = samples(own, times)
        values = _idle_share(found, own, channels, times)
        at = found.spread(np.array(rows) * len(times))
        at += found.frames
        adding = found.spread(np.array(adds))
        some, others = adding.nonzero()[0], (~adding).nonzero()[0]
        np.add.at(whole.reshape(-1), at[some], values[some])
        np.maximum.at(whole.reshape(-1), at[others], values[others])
    one, base, gaze = (
        whole[layers[layer]] if layer in layers else None for layer in (Layer.EXPRESSION, *APART)
    )
    assert one is not None
    return one, base, gaze


def _by_column(rows: Float64, columns: list[int], count: int, order: Index | None) -> Float32:
    """(n, count) float32 that has rows (m, n) as its columns, and n in the order they were asked for.

    In memory it lies column by column, as it is worked on.
    """
    whole = np.zeros((count, rows.shape[1]), np.float32)
    if order is None:
        whole[columns] = rows
    else:
        whole[np.array(columns)[:, None], order] = rows
    return whole.T


def _share_regions(gaze: Float64, base: Float64 | None, place: dict[int, int]) -> None:
    """Give each gaze its part of a region that several take, and take it from the base states, in place."""
    for name, aus in _regions().items():
        if (taken := place.get(axis()[name].column)) is None:
            continue
        share = gaze[taken].copy()
        part = [place[column] for column in (*aus, axis()[name].column) if column in place]
        if share.max() > 1.0:
            gaze[part] /= np.maximum(share, 1.0)
        if base is not None:
            base[part] *= 1.0 - np.minimum(share, 1.0)


def _begin_idle(
    values: Float64, idle: Idle, channels: list[Channel], place: dict[int, int], times: Float64
) -> None:
    """Write what the face does by itself, as far as `channels` let it, into rows that are still 0."""
    blinks = idle.blinks
    if fewer := [channel for channel in channels if channel.target.column == mask_channel("blinks").column]:
        blinks = blinks.reduced(1.0 - sample(fewer, blinks.onsets).sum(axis=0))
    values[[place[lid] for lid in _lids()]] = blinks.at(times)
    moved = idle.motion.at(times)
    if (still := _idle_weight(channels, times)) is not None:
        moved *= still
    values[[place[column] for column in idle.motion.columns]] = moved


def _idle_share(found: Samples, own: list[Channel], channels: list[Channel], times: Float64) -> Float64:
    """(e,) the values that were found, of the idle layer what its presence leaves."""
    idle = [channel.layer is Layer.IDLE for channel in own]
    if any(idle) and (still := _idle_weight(channels, times)) is not None:
        return found.values * np.where(found.spread(np.array(idle)), still[found.frames], 1.0)
    return found.values


def _idle_weight(channels: list[Channel], times: Float64) -> Float64 | None:
    """(n,) how much of idle motion the presence "motion" leaves; None: all of it."""
    column = mask_channel("motion").column
    taking = [channel for channel in channels if channel.target.column == column]
    return 1.0 - np.minimum(sample(taking, times).sum(axis=0), 1.0) if taking else None


def _override(
    values: Float64, channels: list[Channel], place: dict[int, int], times: Float64
) -> Float64 | None:
    """Lay the channels that replace what lies below over `values` (c, n), in place.

    Returns:
        (c, n) 0..1 how far it was replaced; None: nowhere.
    """
    held: Float64 | None = None
    for layer in OVER:
        if over := [channel for channel in channels if channel.layer is layer]:
            rows = [place[channel.target.column] for channel in over]
            there, shown = np.zeros_like(values), np.zeros_like(values)
            np.add.at(there, rows, weights(over, times))
            np.add.at(shown, rows, sample(over, times))
            shown /= np.maximum(there, 1.0)
            left = 1.0 - np.minimum(there, 1.0)
            values *= left
            values += shown
            held = 1.0 - left if held is None else 1.0 - (1.0 - held) * left
    return held


@cache
def _lids() -> tuple[int, ...]:
    """The columns that a blink closes."""
    return tuple(lid.column for lid in au(45))


@cache
def _sums() -> tuple[bool, ...]:
    """Of each column whether channels add up there."""
    known = tables.by_number()
    aus = [known[int(name.rstrip("LR"))].combine == "sum" for name in AU_NAMES()]
    return (*aus, *(True for _ in range(len(aus), len(axis()))))


@cache
def _regions() -> dict[str, list[int]]:
    """The presences that a gaze takes -> AU columns of that region."""
    regions: dict[str, list[int]] = {"eyes": [], "head": []}
    for name in AU_NAMES():
        if region(axis()[name]) in regions:
            regions[region(axis()[name])].append(axis()[name].column)
    return regions
