"""The continuous motion of the head during speech, which follows the melody of the voice."""

from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache

import numpy as np

from realizer import tables
from realizer.animation.axis import au
from realizer.animation.channel import Channel, Gain, Layer
from realizer.animation.curves import smooth
from realizer.animation.idle.life import TURNS
from realizer.animation.idle.rng import uniform
from realizer.animation.speaking_style import NEUTRAL, Style
from realizer.core.array_types import Float64
from realizer.speech.accents import Phrase, phrases, prosody_facts
from realizer.speech.melody import RATE, Melody, melody
from realizer.speech.utterance import Utterance

SOURCE = "prosody"
# Kinds of random numbers: yaw, pitch and roll of poses.
KINDS = range(481, 484)
PARTS = 8  # of the curve from one pose to the next


def head_channels(
    utterance: Utterance,
    start: float,
    until: float,
    seed: int,
    style: Style = NEUTRAL,
    claims: Iterable[tuple[float, float, float]] = (),
) -> list[Channel]:
    """Return channels of the head, and of the eyes that stay on their target, during an utterance.

    Args:
        start, until: when the speech starts and is cut off, seconds on the session clock.
        seed: of the character.
        claims: (known, first, last) of movements of the head that a document asks for: the time at which
            each became known, and the times between which it moves. The motion gives way to them.
    """
    times, angles = _angles(melody(utterance), phrases(utterance), start, seed, style)
    if not len(times):
        return []
    give = prosody_facts()["yield"]["fade"]
    gains = tuple(_gains(claims, give, float(times[0]), float(times[-1])))
    channels = [
        channel.changed({"curve": "linear", "gains": gains})
        for both, degrees in zip(TURNS.values(), angles, strict=True)
        for sides in both
        for channel in turn_channels(sides, times, degrees)
    ]
    return [channel.faded(until, until + give) for channel in channels] if until < times[-1] else channels


def turn_channels(sides: Sequence[int], times: Float64, degrees: Float64) -> Iterator[Channel]:
    """Yield the channels of signed degrees (n,) at key times (n,), by AUs of (negative, positive)."""
    for number, sign in zip(sides, (-1.0, 1.0), strict=False):
        values = np.maximum(sign * degrees, 0.0) / tables.by_number()[number].degrees
        if values.any():
            yield Channel(au(number)[0], times, values, layer=Layer.IDLE, source=SOURCE)


def _gains(
    claims: Iterable[tuple[float, float, float]], give: float, begin: float, end: float
) -> Iterator[Gain]:
    """Yield gains that fade the motion out during claims; overlapping ones count as one."""
    spans: list[list[float]] = []
    for known, first, last in sorted(claims, key=lambda claim: claim[1]):
        if last <= begin or first >= end:
            continue
        if spans and max(known, first - give) <= spans[-1][1] + give:
            spans[-1][1] = max(spans[-1][1], last)
        else:
            spans.append([max(known, first - give), last])
    for first, last in spans:
        yield Gain(first, first + give, 0.0)
        if last < end:
            yield Gain(max(last, first + give), max(last, first + give) + give, 1.0)


@lru_cache(maxsize=64)
def _angles(
    heard: Melody, all_phrases: tuple[Phrase, ...], start: float, seed: int, style: Style
) -> tuple[Float64, Float64]:
    """Return times (n,) on the session clock, and yaw, pitch and roll (3, n) in degrees."""
    if not all_phrases:
        return np.zeros(0), np.zeros((3, 0))
    facts = prosody_facts()["head"]
    begin, end = all_phrases[0].start, all_phrases[-1].end
    count = int((end + facts["settle"] / 2 - begin) * RATE) + 2
    at = begin + np.arange(count) / RATE  # seconds from the start of the utterance
    place = np.arange(len(heard.pitch)) / RATE
    pitch = np.interp(at, place, heard.pitch)
    loudness = np.interp(at, place, heard.loudness)
    semitones = _averaged(np.clip(pitch, -facts["semitones"], facts["semitones"]), 0.5)
    angles = _poses(loudness, start, seed, style)
    angles[1] += facts["melody"] * semitones - facts["beat"] * (loudness - _averaged(loudness, 1.0))
    angles *= style.size
    # It settles before the end of the speech, and while the voice is silent in between.
    envelope = smooth(np.clip((at - begin) / facts["begin"], 0.0, 1.0))
    envelope *= smooth(np.clip((at[-1] - at) / facts["settle"], 0.0, 1.0))
    angles[1] += style.pitch
    angles *= envelope
    angles[2] += _tilt(at, pitch, all_phrases[-1], uniform(seed, KINDS[0], np.array([-1]))[0] < 0.5)
    return start + at, angles


def _averaged(values: Float64, seconds: float) -> Float64:
    around = round(seconds * RATE / 2)
    weights = np.full(2 * around + 1, 1.0 / (2 * around + 1))
    padded = values[np.arange(-around, len(values) + around).clip(0, len(values) - 1)]
    averaged: Float64 = np.convolve(padded, weights, "valid")
    return averaged


def _poses(loudness: Float64, start: float, seed: int, style: Style) -> Float64:
    """Return the motion from pose to pose, (3, n) degrees, which is the faster the louder the voice is.

    It passes through the poses without a stop, on the curve of Catmull & Rom 1974.
    """
    facts = prosody_facts()["head"]
    pace = facts["rest"] + (1.0 - facts["rest"]) * loudness / facts["loudness"]
    passed = np.cumsum(facts["speed"] * style.pace * pace) / RATE  # degrees
    most = np.array([facts["yaw"], facts["pitch"], facts["roll"]])[:, None]
    # From pose to pose it is 0.8 times as far on average.
    numbers = np.arange(6 + int(2 * passed[-1] / np.linalg.norm(most)))
    poses = most * (2.0 * np.array(uniform(seed, KINDS, round(start * 1000.0) * 65536 + numbers)) - 1.0)
    before, this, following, after = (poses[:, k : len(numbers) - 3 + k, None] for k in range(4))
    u = np.arange(PARTS) / PARTS
    curve = this + 0.5 * u * (
        following
        - before
        + u * (2 * before - 5 * this + 4 * following - after)
        + u**2 * (3 * (this - following) + after - before)
    )
    curve = curve.reshape(3, -1)
    way = np.append(0.0, np.linalg.norm(np.diff(curve), axis=0)).cumsum()
    return np.array([np.interp(passed, way, turn) for turn in curve])


def _tilt(at: Float64, pitch: Float64, last: Phrase, left: bool) -> Float64:
    """Return the tilt (n,) in degrees at the end of a question, whose pitch rises."""
    facts = prosody_facts()["head"]
    closing = pitch[(at > last.end - 0.5) & (at <= last.end)]
    if len(closing) < 3 or closing[-1] - closing.min() < facts["rise"]:
        return np.zeros(len(at))
    begin = max(last.start, last.end - 0.8)
    rise = smooth(np.clip((at - begin) / (last.end - begin), 0.0, 1.0))
    rise *= smooth(np.clip((at[-1] - at) / (facts["settle"] / 2), 0.0, 1.0))
    tilt: Float64 = (1.0 if left else -1.0) * facts["question"] * rise
    return tilt
