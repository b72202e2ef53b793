"""Lip, jaw and tongue channels from phonemes: dominance functions and hard closures."""

from collections.abc import Sequence
from functools import cache, lru_cache
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from realizer.animation.axis import Target, fap, mask_channel
from realizer.animation.channel import Channel, Layer
from realizer.animation.lips.closures import BILABIAL, LABIODENTAL, closure_mask, lip_weight, pressure
from realizer.animation.lips.dominance import Track, dominances, key_times, track_of
from realizer.animation.lips.visemes import (
    ARTICULATORS,
    SHAPE_COLUMNS,
    coarticulation,
    mouth_faps,
    shape_table,
)
from realizer.core.array_types import Float64
from realizer.speech.utterance import Phoneme

OPENING = (*ARTICULATORS["jaw"], *ARTICULATORS["lips"])  # they open further in loud speech


class LipStyle(NamedTuple):
    """How far the jaw and the lips move: 0 mumbles, 1 is usual, 2 over-articulates; closures stay.

    Source: the two axes of Edwards et al. 2016, "JALI", ACM Trans. Graphics 35(4).
    """

    jaw: float = 1.0
    lips: float = 1.0


USUAL = LipStyle()


def lip_channels(
    phonemes: Sequence[Phoneme], start: float, room: float = 0.0, style: LipStyle = USUAL
) -> tuple[Channel, ...]:
    """Return channels of the speech layer that move the mouth, in FAPU, and of the mask "lips", 0..1.

    All values are 0 at the first and the last key. The gap between the inner lips (-FAP 4 - FAP 5, and at
    the sides) is at most 0 in every /p b m/ for longer than a frame at 25 fps; the lower lip reaches the
    teeth in /f v/. Keys have a rate of 100 Hz; speeds stay below those of `coarticulation.toml`.

    Args:
        phonemes: in order, seconds from the start of the utterance; "" is a pause.
        start: seconds at which the utterance starts on the block's clock.
        room: seconds before `start` in which the mouth may prepare for the first sound.
        style: how far jaw and lips move.

    Returns:
        Channels for FAPs 3-13, 16, 17, 44-47, 51-60 and the mask "lips"; () if there are only pauses.

    Source: Cohen & Massaro 1993, "Modeling coarticulation in synthetic visual speech".
    """
    facts = coarticulation()
    track = track_of(phonemes)
    if track is None:
        return ()
    times = key_times(phonemes, min(room, facts["pauses"]["attack"]))
    masked = lip_weight(track, times)
    # In a pause the lips are given back to expressions before they stop being parted.
    mouth = _mouth(track, times, style) * lip_weight(track, times, facts["pauses"]["closed"])
    _constrain(mouth, track, times, masked, facts)
    mouth[:, [0, -1]] = 0.0  # smoothing leaves traces of very short sounds
    moved = {mask_channel("lips"): masked}
    moved |= {fap(number): values for number, values in mouth_faps(mouth.T).items()}
    times = times + start  # one array, which all channels share
    return tuple(Channel(target, times, values, "linear", Layer.SPEECH) for target, values in moved.items())


def _mouth(track: Track, times: Float64, style: LipStyle) -> Float64:
    """Return the weighted mean of the sounds around each time, (11, n) float64; rows as `SHAPE_COLUMNS`."""
    target = track.target.T * track.size
    target[[SHAPE_COLUMNS.index(name) for name in OPENING]] *= track.effort
    if style != USUAL:
        _restyle(dict(zip(SHAPE_COLUMNS, target, strict=True)), style)
    mouth = np.empty((len(SHAPE_COLUMNS), len(times)))
    for near, parts, articulators in dominances(track, times):
        rows = _rows(articulators)
        mouth[rows] = np.einsum("kn,skn->sn", parts, target[rows].take(near, axis=1, mode="clip"))
    return mouth


def _restyle(target: dict[str, Float64], style: LipStyle) -> None:
    """Scale the movements of the jaw, which carries the lower lip, and the lips' own, in place."""
    facts = coarticulation()["style"]
    carried = facts["carried"] * target["jaw"]
    target["lower"] -= carried
    target["jaw"] *= style.jaw
    for name in ARTICULATORS["lips"]:
        target[name] *= style.lips
    for name in (*ARTICULATORS["rounding"], *ARTICULATORS["spread"]):
        target[name] *= min(style.lips, 1.0) + facts["further"] * max(style.lips - 1.0, 0.0)
    target["lower"] += style.jaw * carried


def _rows(articulators: Sequence[str]) -> slice:
    return slice(SHAPE_COLUMNS.index(articulators[0]), SHAPE_COLUMNS.index(articulators[-1]) + 1)


def _constrain(mouth: Float64, track: Track, times: Float64, masked: Float64, facts: dict[str, Any]) -> None:
    """Apply closures, limits of speed and smoothing, in place."""
    shapes, _ = shape_table()
    column = {name: k for k, name in enumerate(SHAPE_COLUMNS)}
    closed, bitten = closure_mask(track, times)
    upper, lower, jaw = mouth[column["upper"]], mouth[column["lower"]], mouth[column["jaw"]]
    speed = facts["speed"]["lips"]
    firm = pressure(track, times) * masked
    # The upper lip uncovers the teeth for f v: it is raised there, and then lowered where p b m close.
    raised = shapes[LABIODENTAL, column["upper"]] * firm
    upper[:] = _limit_speed(upper, times, speed)
    upper[:] = -_limit_speed(-np.where(bitten, np.maximum(upper, raised), upper), times, speed)
    upper[[0, -1]] = 0.0
    for lip, name in ((upper, "upper"), (lower, "lower")):
        lip[:] = np.where(closed, np.minimum(lip, shapes[BILABIAL, column[name]] * firm), lip)
    bite = np.minimum(lower, shapes[LABIODENTAL, column["lower"]] * firm)
    lower[:] = np.where(bitten & ~closed, bite, lower)
    jaw[:] = np.where(closed | bitten, np.minimum(jaw, facts["closure"]["jaw"]), jaw)
    for name, articulators in ARTICULATORS.items():
        limit = facts["speed"]["jaw" if name == "jaw" else "lips"]
        reach = facts["articulators"][name]["smooth"] * facts["rate"]
        rows = _rows(articulators)
        mouth[rows] = _smooth(_limit_speed(mouth[rows], times, limit), reach)
    # Pressed lips meet, but do not pass through each other.
    least = shapes[BILABIAL, column["upper"]] + shapes[BILABIAL, column["lower"]]
    lower[:] = np.maximum(lower, least - upper)


def _limit_speed(values: Float64, times: Float64, speed: float) -> Float64:
    """Return the greatest curves along the last axis, not above `values` and not steeper than `speed`."""
    climb = speed * times
    values = np.minimum.accumulate(values - climb, axis=-1) + climb
    falling: Float64 = np.minimum.accumulate((values + climb)[..., ::-1], axis=-1)[..., ::-1] - climb
    return falling


def _smooth(values: Float64, reach: float) -> Float64:
    """Smooth (k, n) along its last axis with a bell of `reach` samples each way; end values stay."""
    half = min(round(reach), values.shape[1] - 1)
    if half < 1:
        return values
    # The curve is extended by point reflection, so that its ends do not move.
    first, last = values[:, :1], values[:, -1:]
    before, after = values[:, half:0:-1], values[:, -2 : -half - 2 : -1]
    padded = np.hstack((2 * first - before, values, 2 * last - after))
    return np.array([np.correlate(row, _bell(half), "valid") for row in padded])


@lru_cache(maxsize=16)
def _bell(half: int) -> Float64:
    """Return (2 half + 1,) weights that add up to 1 and nearly reach 0 at both ends."""
    bell = np.hanning(2 * half + 3)[1:-1]
    weights: Float64 = bell / bell.sum()
    return weights


# FAPs that open the mouth, and the sign that they have then.
OPENING_FAPS = {3: 1.0} | dict.fromkeys((4, 5, *range(8, 12), 51, 52, *range(55, 59)), -1.0)

# Channel -> factor and result. Windows of frames ask for the same ones again and again. No value is its own
# key, or the entry would stay for good.
_known: WeakKeyDictionary[Channel, tuple[float, Channel]] = WeakKeyDictionary()


def opened(channels: tuple[Channel, ...], factor: float) -> tuple[Channel, ...]:
    """Return the channels of a speech whose lips and jaw open by a factor; closures and bites stay."""
    return channels if factor == 1.0 else tuple(_opened(channel, factor) for channel in channels)


def _opened(channel: Channel, factor: float) -> Channel:
    sign = _signs().get(channel.target)
    if sign is None:
        return channel
    known = _known.get(channel)
    if known is None or known[0] != factor:
        # Where it opens the mouth, the scaled value is the outer one if the factor is above 1; elsewhere not.
        choice = np.maximum if (factor > 1.0) == (sign > 0) else np.minimum
        values = choice(channel.values, factor * channel.values)
        known = _known[channel] = factor, channel.changed({"values": values})
    return known[1]


@cache
def _signs() -> dict[Target, float]:
    return {fap(number): sign for number, sign in OPENING_FAPS.items()}
