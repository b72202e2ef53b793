"""Phonemes with their times in, lip, jaw and tongue channels out: dominance functions and hard closures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from realizer.animation.channel import Channel, Layer
from realizer.animation.targets import fap, presence
from realizer.animation.visemes import SHAPE, VISEMES, coarticulation, shape_table, sounds
from realizer.arrays import Bool, Float64
from realizer.speech.utterance import Phoneme

__all__ = ["lip_channels"]

CLASSES = {"jaw": ("jaw",), "lips": ("upper", "lower"), "shape": SHAPE[3:7], "tongue": SHAPE[7:]}
BILABIAL, LABIODENTAL = 1, 2  # visemes
STRESS = {0: "none", 1: "primary", 2: "secondary"}


@dataclass(frozen=True, eq=False)
class Track:
    """The sounds of an utterance in order, without the short pauses between them.

    Attributes:
        begin, end: (m,) float64 seconds.
        mix: (m, 15) float64, part of each viseme.
        vowel: (m,) whether it is a vowel.
        size: (m,) float64, how much of its shape it reaches.
        rest: (m,) whether it is a pause.
    """

    begin: Float64
    end: Float64
    mix: Float64
    vowel: Bool
    size: Float64
    rest: Bool


def lip_channels(phonemes: Sequence[Phoneme], start: float) -> tuple[Channel, ...]:
    """How the mouth says `phonemes`: channels of the speech layer, in FAPU, and the presence "lips" 0..1.

    All values are 0 at the first and the last key. The gap between the inner lips (-FAP 4 - FAP 5, and at
    the sides) is at most 0 in every /p b m/ for longer than a frame at 25 fps; the lower lip reaches the
    teeth in /f v/. Keys come at 100 Hz; speeds stay below those of `coarticulation.toml`.

    Args:
        phonemes: in order, seconds from the start of the utterance; "" is a pause.
        start: seconds, when the utterance starts on the block's clock.

    Returns:
        Channels for FAPs 3-13, 16, 17, 44-46, 51-60 and presence("lips"); () where nothing is said.

    Source: Cohen & Massaro 1993, "Modeling coarticulation in synthetic visual speech".
    """
    facts = coarticulation()
    track = _track(phonemes, facts)
    if track is None:
        return ()
    first, last = phonemes[0].start, max(phonemes[-1].end, phonemes[0].start + 2 / facts["rate"])
    times = np.linspace(first, last, int(np.ceil((last - first) * facts["rate"])) + 1)
    taken = _presence(track, times, facts)
    mouth = _dominance(track, times, facts) * taken[:, None]
    _constrain(mouth, track, times, taken, facts)
    mouth[[0, -1]] = 0.0  # a sound shorter than the smoothing leaves a trace
    return _channels(times + start, mouth, taken, facts["contour"])


def _track(phonemes: Sequence[Phoneme], facts: dict[str, Any]) -> Track | None:
    """None where nothing is said."""
    rows: list[tuple[float, float, tuple[tuple[int, float], ...], bool, float]] = []
    for phoneme in phonemes:
        parts = sounds(phoneme.ipa)
        if not parts:
            if not rows or rows[-1][2] != ((0, 1.0),):
                rows.append((phoneme.start, phoneme.end, ((0, 1.0),), False, 1.0))
            else:  # two pauses are one
                rows[-1] = (rows[-1][0], phoneme.end, *rows[-1][2:])
            continue
        at, length = phoneme.start, phoneme.end - phoneme.start
        for part in parts:
            size = facts["stress"][STRESS.get(phoneme.stress, "none")] if part.vowel else 1.0
            rows.append((at, at + part.share * length, part.mix, part.vowel, size))
            at += part.share * length
    silent = ((0, 1.0),)
    if all(row[2] in (silent, ()) for row in rows):
        return None
    # A short pause between sounds does not bring the mouth to rest; at the ends it always does.
    inner = range(1, len(rows) - 1)
    rows = [
        row
        for k, row in enumerate(rows)
        if not (k in inner and row[2] == silent and row[1] - row[0] < facts["pauses"]["absorbed"])
    ]
    begin, end = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
    middle = (end[:-1] + begin[1:]) / 2  # sounds touch, or reach to the middle of what was absorbed
    mix = np.zeros((len(rows), VISEMES))
    for k, row in enumerate(rows):
        for viseme, amount in row[2]:
            mix[k, viseme] = amount
    return Track(
        begin=np.concatenate((begin[:1], middle)),
        end=np.concatenate((middle, end[-1:])),
        mix=mix,
        vowel=np.array([row[3] for row in rows]),
        size=np.array([row[4] for row in rows]),
        rest=np.array([row[2] == silent for row in rows]),
    )


def _presence(track: Track, times: Float64, facts: dict[str, Any]) -> Float64:
    """(n,) 0..1: how far speech has the lips; 0 at the ends and in long pauses.

    Whole from the first sound that closes the lips to the last: an expression would part them.
    """
    pauses = facts["pauses"]
    ends = np.zeros(len(track.rest), bool)
    ends[[0, -1]] = True
    let_go = track.rest & (ends | (track.end - track.begin > pauses["released"]))
    middle = (track.begin + track.end) / 2
    closing = track.mix[:, list(facts["closure"]["visemes"])].sum(axis=1) > 0.5
    half = np.maximum(facts["closure"]["hold"], track.end - track.begin) / 2
    taken = np.zeros(len(times))
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
        taken = np.maximum(taken, np.minimum(up, down))
    return taken


def _smoothstep(x: Float64) -> Float64:
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3 - 2 * x)


def _dominance(track: Track, times: Float64, facts: dict[str, Any]) -> Float64:
    """(n, 10) float64: the weighted mean of the sounds around each time; columns `SHAPE`."""
    rule = facts["dominance"]
    shapes, weights = shape_table()
    length = np.maximum(track.end - track.begin, 1e-3)
    target = (track.mix @ shapes) * track.size[:, None]
    base = np.where(track.vowel, rule["base_vowel"], rule["base_consonant"])
    rate = base * (rule["length"] / length) ** rule["exponent"]
    strength = np.where(track.vowel, rule["strength_vowel"], rule["strength_consonant"])
    weight = (track.mix @ weights) * strength[:, None]
    # A pause is at rest over its whole length but its edges; a sound is strongest in its middle part.
    edge = np.where(track.rest, np.minimum(0.1, length / 3), length * (1 - rule["core"]) / 2)
    core_begin, core_end = track.begin + edge, track.end - edge

    # Sounds further away than `neighbours` add nothing that can be seen: a band, not a matrix.
    band = np.arange(-rule["neighbours"], rule["neighbours"] + 1)
    near = np.searchsorted(track.begin, times, "right")[:, None] - 1 + band
    there = (near >= 0) & (near < len(length))
    near = np.clip(near, 0, len(length) - 1)
    before = rate[near] * np.maximum(core_begin[near] - times[:, None], 0)
    after = rate[near] * np.maximum(times[:, None] - core_end[near], 0)

    mouth = np.empty((len(times), len(SHAPE)))
    for column, (name, members) in enumerate(CLASSES.items()):
        pace = facts["articulators"][name]
        d = np.exp(-(pace["before"] * before + pace["after"] * after)) * weight[near, column] * there
        whole = d.sum(1) + rule["rest"]
        for member in members:
            k = SHAPE.index(member)
            mouth[:, k] = (d * target[near, k]).sum(1) / whole
    return mouth


def _constrain(mouth: Float64, track: Track, times: Float64, taken: Float64, facts: dict[str, Any]) -> None:
    """Closures, speeds and smoothness, in place."""
    shapes, _ = shape_table()
    column = {name: k for k, name in enumerate(SHAPE)}
    pad = facts["articulators"]["lips"]["smooth"]
    closed, bitten = _held(track, times, facts["closure"], pad)
    upper, lower, jaw = mouth[:, column["upper"]], mouth[:, column["lower"]], mouth[:, column["jaw"]]
    speed = facts["speed"]["lips"]
    # The upper lip clears the teeth for f v: raised where it is lower, then lowered wherever p b m close.
    raised = shapes[LABIODENTAL, column["upper"]] * taken
    upper[:] = _reachable(upper, times, speed)
    upper[:] = -_reachable(-np.where(bitten, np.maximum(upper, raised), upper), times, speed)
    upper[[0, -1]] = 0.0
    for lip, name in ((upper, "upper"), (lower, "lower")):
        lip[:] = np.where(closed, np.minimum(lip, shapes[BILABIAL, column[name]] * taken), lip)
    lower[:] = np.where(
        bitten & ~closed, np.minimum(lower, shapes[LABIODENTAL, column["lower"]] * taken), lower
    )
    jaw[:] = np.where(closed | bitten, np.minimum(jaw, facts["closure"]["jaw"]), jaw)
    for name, members in CLASSES.items():
        limit = facts["speed"]["jaw" if name == "jaw" else "lips"]
        reach = facts["articulators"][name]["smooth"] * facts["rate"]
        block = slice(column[members[0]], column[members[-1]] + 1)
        mouth[:, block] = _smooth(_reachable(mouth[:, block], times[:, None], limit), reach)
    # Lips that press meet; they do not pass through each other.
    least = shapes[BILABIAL, column["upper"]] + shapes[BILABIAL, column["lower"]]
    lower[:] = np.maximum(lower, least - upper)


def _held(track: Track, times: Float64, closure: dict[str, Any], pad: float) -> tuple[Bool, Bool]:
    """(n,) each: whether a sound that closes the lips, or bites the lower one, holds them at each time.

    Two different ones that stand close together part as far as a frame allows, and share what is between.
    """
    which = np.flatnonzero(track.mix[:, [BILABIAL, LABIODENTAL]].max(axis=1) > 0.5)
    bites = track.mix[which, LABIODENTAL] > 0.5
    length = (track.end - track.begin)[which]
    middle = (track.begin + track.end)[which] / 2
    differ = np.flatnonzero(bites[1:] != bites[:-1])
    near = np.clip((closure["apart"] - np.diff(middle)[differ]) / 2, 0.0, closure["moved"])
    np.subtract.at(middle, differ, near)
    np.add.at(middle, differ + 1, near)
    half = np.maximum(closure["hold"], length - 2 * pad) / 2 + pad
    opens, closes = middle - half, middle + half
    for k in differ:
        if closes[k] > opens[k + 1]:
            # Lips that part need time, which the closure gives: pressed lips are closed for longer.
            border = (closes[k] + opens[k + 1]) / 2 + (1 if bites[k] else -1) * closure["gives"]
            closes[k], opens[k + 1] = max(border, opens[k]), min(border, closes[k + 1])
    held = np.zeros((2, len(times)), bool)
    for row, mine in zip(held, (~bites, bites), strict=True):
        begun = np.searchsorted(np.sort(opens[mine]), times, "right")
        row[:] = begun > np.searchsorted(np.sort(closes[mine]), times, "left")
    return held[0], held[1]


def _reachable(values: Float64, times: Float64, speed: float) -> Float64:
    """The greatest curves along axis 0 that stay below `values` and are nowhere steeper than `speed`."""
    climb = speed * times
    values = np.minimum.accumulate(values - climb) + climb
    falling: Float64 = np.minimum.accumulate((values + climb)[::-1])[::-1] - climb
    return falling


def _smooth(values: Float64, reach: float) -> Float64:
    """Mean along axis 0 under a bell that ends `reach` samples away; end values stay."""
    half = min(round(reach), len(values) - 1)
    if half < 1:
        return values
    bell = np.hanning(2 * half + 3)[1:-1]
    bell /= bell.sum()
    # Beyond its ends the curve is turned about its end point, so that the ends do not move.
    padded = np.concatenate(
        (2 * values[0] - values[half:0:-1], values, 2 * values[-1] - values[-2 : -half - 2 : -1])
    )
    smooth: Float64 = sum(weight * padded[k : k + len(values)] for k, weight in enumerate(bell))
    return smooth


def _channels(
    times: Float64, mouth: Float64, taken: Float64, contour: dict[str, float]
) -> tuple[Channel, ...]:
    part = {name: mouth[:, k] for k, name in enumerate(SHAPE)}
    # MPEG-4 counts upper lip FAPs downwards, lower lip FAPs upwards: an open mouth is negative in both.
    upper, lower = -part["upper"], -part["lower"]
    values: dict[tuple[int, ...], Float64] = {
        (3,): np.maximum(part["jaw"], 0.0),  # FAP 3 has one direction
        (4,): upper,
        (5,): lower,
        (8, 9): upper * contour["side"],
        (10, 11): lower * contour["side"],
        (51,): upper * contour["outer"],
        (52,): lower * contour["outer"],
        (55, 56): upper * contour["outer_side"],
        (57, 58): lower * contour["outer_side"],
        (6, 7, 53, 54): part["width"],
        (12, 13, 59, 60): part["corner"],
        (16,): part["push_lower"],
        (17,): part["push_upper"],
        (44,): part["tip"],
        (45,): part["thrust"],
        (46,): part["body"],
    }
    channels = [Channel(presence("lips"), times, taken, "linear", Layer.SPEECH)]
    for numbers, value in values.items():
        channels += [Channel(fap(number), times, value, "linear", Layer.SPEECH) for number in numbers]
    return tuple(channels)
