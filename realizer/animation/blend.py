"""Step 5 of the pipeline: sampling channels and blending their layers."""

from bisect import bisect_left
from collections.abc import Iterable
from functools import cache

import numpy as np

from realizer import tables
from realizer.animation.axis import AU_NAMES, axis, region
from realizer.animation.channel import Channel, Layer
from realizer.animation.curves import Samples, sample, samples, weights
from realizer.animation.frames import AUFrames
from realizer.animation.idle.idle_face import Idle, idle_layer, lids, motion_left
from realizer.core import work
from realizer.core.array_types import Float32, Float64
from realizer.tables.cooccurrence import Rules

# Layers that replace those below them, bottom up.
REPLACING = (Layer.FAPS, Layer.DIRECT)
# Layers that are summed separately before they join the others.
SEPARATE = (Layer.BASE, Layer.GAZE)

# Small movements of an idle face yield to what is shown in the same part of the face, all at this intensity.
YIELDS = 0.02

# Channels that are sampled at once; others have their turn after so many.
TOGETHER = 256


def blend(
    channels: Iterable[Channel], times: Float64, rules: Rules | None = None, idle: Idle | None = None
) -> AUFrames:
    """Sample channels and blend them into frames.

    In each column of the axis:

    - AUs: the strongest channel wins; rotations (combine = "sum" in the table) of all layers add up.
    - BASE states add up, so that one that fades out crossfades with one that rises. They are reduced where
      the GAZE layer masks their region.
    - GAZE: where the masks of several gazes exceed 1 in a region, they share it in proportion.
    - IDLE: the masks "motion" and "blinks" reduce it. A blink is shown whole or not at all, decided at its
      onset.
    - FAPs add up; mask channels add up to at most 1.
    - FAPS, and above it DIRECT: such a channel replaces all layers below it by its weight, and for FAPs also
      what AUs contribute (`AUFrames.overridden`). Channels of one layer whose weights exceed 1 share it.

    AUs are limited to 0..1 at the end.

    Args:
        channels: in any order; on the clock of `times`.
        times: (n,) seconds, not falling.
        rules: co-occurrence rules; None for none.
        idle: the idle motion of the face between the first and the last of the times.
    """
    times = np.asarray(times, np.float64)
    visible = _visible(channels, times)
    work.count(len(visible))
    # Only columns that move are computed; `place` holds the row of each of them.
    moved = {channel.target.column for channel in visible}
    if idle is not None:
        moved |= {*idle.motion.columns, *lids(), *(() if idle.life is None else idle.life.face)}
    columns = sorted(moved)
    place = {column: i for i, column in enumerate(columns)}
    values, base, gaze = _layers(visible, idle, place, times)
    if gaze is not None:
        _share_regions(gaze, base, place)
        values += gaze
    if base is not None:
        # Of base states and expressions the stronger is shown; rotations add up.
        adds = np.array([_sums()[column] for column in columns])[:, None]
        values = np.where(adds, base + values, np.maximum(base, values))
    overridden = _override(values, visible, place, times)
    # FAPs, between AUs and mask channels, have limits of their own.
    first, last = (bisect_left(columns, len(AU_NAMES()) + count) for count in (0, 68))
    for limited in (values[:first], values[last:]) if first < last else (values,):
        np.clip(limited, 0.0, 1.0, out=limited)
    replaced = None
    if overridden is not None and overridden[first:last].any():
        faps = [column - len(AU_NAMES()) for column in columns[first:last]]
        replaced = _by_column(overridden[first:last], faps, 68)
    return AUFrames(times, _by_column(values, columns, len(axis())), rules, replaced)


def _visible(channels: Iterable[Channel], times: Float64) -> list[Channel]:
    if not len(times):
        return []
    first, last = float(times[0]), float(times[-1])
    spans = ((channel, channel.span) for channel in work.counted(channels, 3))
    return [channel for channel, (begin, end) in spans if begin <= last and end >= first]


def _layers(
    channels: list[Channel], idle: Idle | None, place: dict[int, int], times: Float64
) -> tuple[Float64, Float64 | None, Float64 | None]:
    """Return the columns in `place`, (c, n) each, of expressions, base states and gazes, or None for these.

    Expressions include all other layers, except those that replace the ones below.
    """
    own = [channel for channel in channels if channel.layer not in REPLACING]
    layers = {Layer.EXPRESSION: 0}
    rows, adds, sums = [], [], _sums()
    for channel in work.counted(own, 3):
        column, layer = channel.target.column, channel.layer
        adds.append(layer is Layer.BASE or sums[column])
        apart = layer if adds[-1] and layer in SEPARATE else Layer.EXPRESSION
        rows.append(layers.setdefault(apart, len(layers)) * len(place) + place[column])
    whole = np.zeros((len(layers), len(place), len(times)))
    alone = None if idle is None else idle_layer(idle, channels, times)
    if alone is not None:
        whole[0, [place[column] for column in alone.columns]] = alone.values
    for first in range(0, len(own), TOGETHER):
        part = slice(first, first + TOGETHER)
        work.count(10 * len(own[part]))
        found = samples(own[part], times)
        values = _idle_share(found, own[part], channels, times)
        at = found.spread(np.array(rows[part]) * len(times))
        at += found.frames
        adding = found.spread(np.array(adds[part]))
        summed, strongest = adding.nonzero()[0], (~adding).nonzero()[0]
        np.add.at(whole.reshape(-1), at[summed], values[summed])
        np.maximum.at(whole.reshape(-1), at[strongest], values[strongest])
    if alone is not None and alone.face:
        driven = {channel.target.column for channel in own}
        for own_rows, columns in alone.areas:
            if shown := [place[column] for column in columns & driven]:
                alone.small[own_rows] *= 1.0 - np.minimum(whole[:, shown].max(axis=(0, 1)) / YIELDS, 1.0)
        face = [place[column] for column in alone.face]
        whole[0, face] = np.maximum(whole[0, face], alone.small)
    one, base, gaze = (
        whole[layers[layer]] if layer in layers else None for layer in (Layer.EXPRESSION, *SEPARATE)
    )
    assert one is not None
    return one, base, gaze


def _by_column(rows: Float64, columns: list[int], count: int) -> Float32:
    """Return frames (n, count) float32 with `rows` (m, n) as their columns, stored column by column."""
    whole = np.zeros((count, rows.shape[1]), np.float32)
    whole[columns] = rows
    return whole.T


def _share_regions(gaze: Float64, base: Float64 | None, place: dict[int, int]) -> None:
    """Share each region among its gazes, and mask the base states there, in place."""
    for name, aus in _regions().items():
        if (taken := place.get(axis()[name].column)) is None:
            continue
        share = gaze[taken].copy()
        part = [place[column] for column in (*aus, axis()[name].column) if column in place]
        if share.max() > 1.0:
            gaze[part] /= np.maximum(share, 1.0)
        if base is not None:
            base[part] *= 1.0 - np.minimum(share, 1.0)


def _idle_share(found: Samples, own: list[Channel], channels: list[Channel], times: Float64) -> Float64:
    """Return the sampled values (e,), with the mask "motion" applied to the idle layer."""
    idle = [channel.layer is Layer.IDLE for channel in own]
    if any(idle) and (still := motion_left(channels, times)) is not None:
        return found.values * np.where(found.spread(np.array(idle)), still[found.frames], 1.0)
    return found.values


def _override(
    values: Float64, channels: list[Channel], place: dict[int, int], times: Float64
) -> Float64 | None:
    """Blend the channels of the layers FAPS and DIRECT over `values` (c, n), in place.

    Return (c, n) 0..1 how far each value was replaced, or None if nowhere.
    """
    work.count(len(channels))
    overridden: Float64 | None = None
    for layer in REPLACING:
        if over := [channel for channel in channels if channel.layer is layer]:
            rows = [place[channel.target.column] for channel in over]
            weight, shown = np.zeros_like(values), np.zeros_like(values)
            np.add.at(weight, rows, weights(over, times))
            np.add.at(shown, rows, sample(over, times))
            shown /= np.maximum(weight, 1.0)
            left = 1.0 - np.minimum(weight, 1.0)
            values *= left
            values += shown
            overridden = 1.0 - left if overridden is None else 1.0 - (1.0 - overridden) * left
    return overridden


@cache
def _sums() -> tuple[bool, ...]:
    known = tables.by_number()
    aus = [known[int(name.rstrip("LR"))].combine == "sum" for name in AU_NAMES()]
    return (*aus, *(True for _ in range(len(aus), len(axis()))))


@cache
def _regions() -> dict[str, list[int]]:
    """Return the AU columns of "eyes" and "head", the regions that a gaze masks."""
    regions: dict[str, list[int]] = {"eyes": [], "head": []}
    for name in AU_NAMES():
        if region(axis()[name]) in regions:
            regions[region(axis()[name])].append(axis()[name].column)
    return regions
