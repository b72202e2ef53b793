"""Lip closures: times at which sounds close the lips or bite the lower one."""

import numpy as np

from realizer.animation.lips.dominance import Track
from realizer.animation.lips.visemes import coarticulation
from realizer.core.array_types import Bool, Float64

BILABIAL, LABIODENTAL = 1, 2  # visemes


def lip_weight(track: Track, times: Float64, longest: float | None = None) -> Float64:
    """Return how far speech masks the lips, (n,) 0..1; 0 at the ends and in pauses above `longest` seconds.

    It is 1 from the first sound that closes the lips to the last, because an expression would part them.
    """
    facts = coarticulation()
    pauses = facts["pauses"]
    longest = pauses["released"] if longest is None else longest
    ends = np.zeros(len(track.rest), bool)
    ends[[0, -1]] = True
    let_go = track.rest & (ends | (track.end - track.begin > longest))
    middle = (track.begin + track.end) / 2
    closing = track.mix[:, list(facts["closure"]["visemes"])].sum(axis=1) > 0.5
    half = np.maximum(facts["closure"]["hold"], track.end - track.begin) / 2
    masked = np.zeros(len(times))
    for run in np.split(np.arange(len(let_go)), np.flatnonzero(np.diff(let_go)) + 1):
        if let_go[run[0]]:
            continue
        rise = max(times[0], track.begin[run[0]] - pauses["attack"])
        fall = min(times[-1], track.end[run[-1]] + pauses["release"])
        attack, release = (min(pauses[name], (fall - rise) / 2) for name in ("attack", "release"))
        shut = run[closing[run]]
        if len(shut):
            before = middle[shut[0]] - half[shut[0]] - rise
            after = fall - middle[shut[-1]] - half[shut[-1]]
            attack = max(min(attack, before), pauses["least"])
            release = max(min(release, after), pauses["least"])
        up, down = _smoothstep((times - rise) / attack), _smoothstep((fall - times) / release)
        masked = np.maximum(masked, np.minimum(up, down))
    return masked


def _smoothstep(x: Float64) -> Float64:
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3 - 2 * x)


def closure_mask(track: Track, times: Float64) -> tuple[Bool, Bool]:
    """Return whether the lips are closed, and whether the lower lip is bitten, at each time, (n,) each.

    Closures of different kinds that are close to each other are moved apart, so that a frame separates them.
    """
    closure, pad = coarticulation()["closure"], coarticulation()["articulators"]["lips"]["smooth"]
    which = np.flatnonzero(track.mix[:, [BILABIAL, LABIODENTAL]].max(axis=1) > 0.5)
    bites = track.mix[which, LABIODENTAL] > 0.5
    length = (track.end - track.begin)[which]
    middle = (track.begin + track.end)[which] / 2
    differ = np.flatnonzero(bites[1:] != bites[:-1])
    near = np.clip((closure["apart"] - np.diff(middle)[differ]) / 2, 0.0, closure["moved"])
    np.subtract.at(middle, differ, near)
    np.add.at(middle, differ + 1, near)
    half = np.maximum(closure["hold"], (length - 2 * pad) * _firmness(track)[which]) / 2 + pad
    opens, closes = middle - half, middle + half
    for k in differ:
        if closes[k] > opens[k + 1]:
            # Parting takes time from the closure, which lasts longer because the lips are pressed.
            border = (closes[k] + opens[k + 1]) / 2 + (1 if bites[k] else -1) * closure["gives"]
            closes[k], opens[k + 1] = max(border, opens[k]), min(border, closes[k + 1])
    holds = np.zeros((2, len(times)), bool)
    for row, kind in zip(holds, (~bites, bites), strict=True):
        begun = np.searchsorted(np.sort(opens[kind]), times, "right")
        row[:] = begun > np.searchsorted(np.sort(closes[kind]), times, "left")
    return holds[0], holds[1]


def pressure(track: Track, times: Float64) -> Float64:
    """Return how firmly the lips meet, or the lower one is bitten, at each time, (n,) 0..1.

    Each closure has its own pressure, by its sound and the vowel after it, and is firmest in its middle.
    """
    which = np.flatnonzero(track.mix[:, [BILABIAL, LABIODENTAL]].max(axis=1) > 0.5)
    if not len(which):
        return np.ones(len(times))
    bend, hold = coarticulation()["pressure"]["bend"], coarticulation()["closure"]["hold"]
    middle = (track.begin + track.end)[which] / 2
    near = np.searchsorted((middle[1:] + middle[:-1]) / 2, times)
    half = np.maximum(hold, (track.end - track.begin)[which])[near] / 2
    away = np.minimum(np.abs(times - middle[near]) / half, 1.0)
    firm: Float64 = _firmness(track)[which][near] * (1 - bend * away**2)
    return firm


def _firmness(track: Track) -> Float64:
    """Return (m,) the pressure of each sound, not below the table's least."""
    facts = coarticulation()["pressure"]
    found: Float64 = facts["least"] + (1 - facts["least"]) * track.pressure.clip(0.0, 1.0)
    return found
