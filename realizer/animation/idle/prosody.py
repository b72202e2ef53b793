"""Motion that accompanies speech: of the head, nods and raised brows on accents, glances, breaths.

It depends on the seed, the utterances and their start times, but not on the requested frames.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from realizer import tables
from realizer.animation.axis import AU_NAMES, au, axis, region
from realizer.animation.channel import Channel, Layer
from realizer.animation.idle.blinks import PhraseEnd
from realizer.animation.idle.rng import uniform
from realizer.animation.idle.speaking_head import SOURCE, head_channels, turn_channels
from realizer.animation.speaking_style import NEUTRAL, Style
from realizer.core.array_types import Float64
from realizer.speech.accents import Phrase, phrases, prosody_facts
from realizer.speech.melody import RATE, Melody, melody
from realizer.speech.utterance import Utterance

# s after the end of a block, in which it may still affect visible blinks.
AFTERMATH = 2.0

# Signed angles: AUs of (negative, positive). When the head turns down, the eyes turn up by as much.
PITCH, EYES_PITCH, EYES_YAW = (54, 53), (64, 63), (62, 61)
# Where a document shows one of these AUs or FAPs, gestures of the part give way; in a frown, raised brows get
# smaller.
PARTS = {
    "brows": ({1, 2}, range(31, 39)),
    "frown": ({4}, ()),
    "nose": ({38, 39}, range(61, 63)),
    "mouth": ({8, *range(10, 38)}, (*range(3, 19), *range(51, 61))),
}


class SpeechSpan(NamedTuple):
    """An utterance that starts at `start` and is cut off at `until`; seconds on the session clock.

    `style` returns how its block and the base states of the character change it.
    """

    start: float
    until: float
    utterance: Utterance
    style: Callable[[], Style] = lambda: NEUTRAL


class KnownMotion(NamedTuple):
    """A channel of a document or a client, and the time (session clock) at which it became known."""

    known: float
    channel: Channel


@dataclass(frozen=True, eq=False)
class Gesture:
    """A movement of "head", "eyes" or one of `PARTS`."""

    region: str
    channels: tuple[Channel, ...]

    @property
    def begin(self) -> float:
        return float(self.channels[0].times[0])

    @property
    def end(self) -> float:
        return float(self.channels[0].times[-1])

    def scaled(self, factor: float) -> Gesture:
        return replace(self, channels=tuple(c.changed({"values": factor * c.values}) for c in self.channels))


def phrase_ends(talks: Iterable[SpeechSpan]) -> tuple[PhraseEnd, ...]:
    """Return the ends of phrases in order of time, also those shortly after a cut, which may move blinks."""
    reach = prosody_facts()["blinks"]["reach"]
    ends = [
        PhraseEnd(talk.start, talk.start + phrase.end)
        for talk in talks
        for phrase in phrases(talk.utterance)
        if talk.start + phrase.end <= talk.until + reach
    ]
    return tuple(sorted(ends, key=lambda end: end.at))


def prosody_channels(
    talks: Iterable[SpeechSpan],
    start: float,
    end: float,
    seed: int,
    known_motions: Iterable[KnownMotion] = (),
) -> list[Channel]:
    """Return the channels, visible in start..end, of the head, nods, brow raises and glances during speech.

    They are in the idle layer, so that a document that reduces idle motion reduces them too. A movement is
    dropped if a document moves the same part of the face during it; if that becomes known after the movement
    has begun, it is faded out. The continuous motion of the head gives way and comes back. `known_motions`
    are all other channels of the character, `seed` is its; times are seconds on the session clock.
    """
    shown: list[Channel] = []
    fade = prosody_facts()["yield"]["fade"]
    claims: dict[str, list[KnownMotion]] | None = None
    for talk in talks:
        if talk.start > end or min(talk.start + talk.utterance.duration, talk.until) + AFTERMATH < start:
            continue
        if claims is None:  # computed only when needed: characters are silent most of the time
            claims = _claims(known_motions)
        head = [(known, *channel.span) for known, channel in claims.get("head", ()) if channel.values.any()]
        style = talk.style()
        shown += head_channels(talk.utterance, talk.start, talk.until, seed, style, head)
        last_sound = talk.utterance.phonemes[-1].end if talk.utterance.phonemes else talk.utterance.duration
        heard = phrases(talk.utterance), melody(talk.utterance)
        for gesture in _gestures(*heard, last_sound, talk.start, seed):
            if gesture.end < start or gesture.begin > end or gesture.begin >= talk.until:
                continue
            if gesture.region == "head" and style.size != 1.0:
                gesture = gesture.scaled(style.size)
            leaves = min((talk.until, *_moving(claims, gesture.region, gesture)))
            if gesture.region == "brows":
                for known in _moving(claims, "frown", gesture):
                    if known <= gesture.begin:
                        gesture = gesture.scaled(prosody_facts()["brows"]["frown"])
            if gesture.begin < leaves:
                shown += [
                    c if leaves >= gesture.end else c.faded(leaves, leaves + fade) for c in gesture.channels
                ]
    return shown


def _claims(known_motions: Iterable[KnownMotion]) -> dict[str, list[KnownMotion]]:
    claims: dict[str, list[KnownMotion]] = {}
    for motion in known_motions:
        part = _parts().get(motion.channel.target.column)
        # Nods, like sway, are added to the base direction of the head.
        if part is not None and not (part == "head" and motion.channel.layer is Layer.BASE):
            claims.setdefault(part, []).append(motion)
    return claims


def _moving(claims: Mapping[str, list[KnownMotion]], part: str, gesture: Gesture) -> Iterator[float]:
    """Yield the times at which motions of a part, which overlap the gesture in time, became known."""
    begin, end = gesture.begin, gesture.end
    for known, channel in claims.get(part, ()):
        first, last = channel.span
        if first < end and last > begin and channel.values.any():
            yield known


@cache
def _parts() -> dict[int, str]:
    """Return the part of the face, "head", "eyes" or one of `PARTS`, of the columns that prosody may move."""
    parts = {}
    numbers = {row.name: row.fap for row in tables.faps()}
    for name, target in axis().items():
        if region(target) in ("head", "eyes"):
            parts[target.column] = region(target)
            continue
        unit = int(name.rstrip("LR")) if target.column < len(AU_NAMES()) else None
        for part, (units, faps) in PARTS.items():
            if unit in units or numbers.get(name) in faps:
                parts[target.column] = part
    return parts


@lru_cache(maxsize=64)
def _gestures(
    all_phrases: tuple[Phrase, ...], heard: Melody, last_sound: float, start: float, seed: int
) -> tuple[Gesture, ...]:
    return (
        *_accents(all_phrases, heard, start, seed),
        *_looks_aside(all_phrases, start, seed),
        *_breaths(all_phrases, start),
        *_moistening(all_phrases, last_sound, start, seed),
    )


def _accents(all_phrases: tuple[Phrase, ...], heard: Melody, start: float, seed: int) -> Iterator[Gesture]:
    nod, brows = prosody_facts()["nod"], prosody_facts()["brows"]
    times = [accent.time for phrase in all_phrases for accent in phrase.accents]
    nods, raises, sizes = _draws(seed, 400, start, len(times))
    # Half of the size follows the loudness of the accent.
    sizes = (sizes + np.interp(times, np.arange(len(heard.loudness)) / RATE, heard.loudness)) / 2
    k = 0
    nodded = raised = -np.inf
    for phrase in all_phrases:
        for accent in phrase.accents:
            chance = "nuclear" if accent.nuclear else "others"
            # Accents that are too near to the start peak later, because nothing moves before the speech.
            time = start + max(accent.time, nod["attack"])
            # The nuclear accent, the last of its phrase, has priority; it always has a nod or raised brows.
            left = np.inf if accent.nuclear else phrase.accents[-1].time - accent.time
            may_nod = min(left, time - nodded) >= nod["apart"]
            may_raise = min(left, time - raised) >= brows["apart"]
            nods_now = may_nod and (nods[k] < nod[chance] or (accent.nuclear and not may_raise))
            raises_now = may_raise and (raises[k] < brows[chance] or (accent.nuclear and not nods_now))
            if nods_now:
                nodded = time
                yield _nod(time, _size(nod, sizes[k], accent.nuclear))
            if raises_now:
                raised = time
                yield _raise(time, _size(brows, sizes[k], accent.nuclear))
            k += 1


def _size(facts: Mapping[str, float], draw: float, nuclear: bool) -> float:
    part = facts["least"] + (1.0 - facts["least"]) * draw
    return facts["most"] * part * (1.0 if nuclear else facts["other"])


def _breaths(all_phrases: tuple[Phrase, ...], start: float) -> Iterator[Gesture]:
    """Yield the flare of the nostrils as the speaker inhales in pauses that are long enough."""
    breath = prosody_facts()["breath"]
    for before, after in pairwise(all_phrases):
        if (length := after.start - before.end) >= breath["pause"]:
            inhales = min(length, breath["longest"])
            yield _shown(
                "nose", 38, start + after.start - inhales * np.array([1.0, 0.4, 0.0]), breath["most"]
            )


def _moistening(
    all_phrases: tuple[Phrase, ...], last_sound: float, start: float, seed: int
) -> Iterator[Gesture]:
    """Yield the lips that are drawn in after a long turn."""
    lips = prosody_facts()["moistening"]
    chance, size, late = (draw[0] for draw in _draws(seed, 460, start, 1))
    if (
        all_phrases
        and all_phrases[-1].end - all_phrases[0].start >= lips["least"]
        and chance < lips["chance"]
    ):
        begin = start + last_sound + lips["delay"] * (0.5 + 0.5 * late)
        keys = begin + np.cumsum([0.0, lips["attack"], lips["hold"], lips["relax"]])
        yield _shown("mouth", 28, keys, lips["most"] * (0.6 + 0.4 * size))


def _shown(part: str, number: int, keys: Float64, most: float) -> Gesture:
    """Return an AU that rises from the first key to the second and falls to the last from the one before."""
    values = np.array([0.0, *[most] * (len(keys) - 2), 0.0])
    channels = (Channel(t, keys, values, layer=Layer.IDLE, source=SOURCE) for t in au(number))
    return Gesture(part, tuple(channels))


def _nod(time: float, degrees: float) -> Gesture:
    nod = prosody_facts()["nod"]
    keys = np.array([time - nod["attack"], time, time + nod["relax"]])
    down = np.array([0.0, -degrees, 0.0])
    return Gesture("head", (*turn_channels(PITCH, keys, down), *turn_channels(EYES_PITCH, keys, -down)))


def _raise(time: float, most: float) -> Gesture:
    brows = prosody_facts()["brows"]
    top = time + brows["hold"]
    keys = np.array([time - brows["attack"], time, top, top + brows["relax"]])
    lifts = (channel for number in (1, 2) for channel in _shown("brows", number, keys, most).channels)
    return Gesture("brows", tuple(lifts))


def _looks_aside(all_phrases: tuple[Phrase, ...], start: float, seed: int) -> Iterator[Gesture]:
    aside = prosody_facts()["aside"]
    if not all_phrases or all_phrases[-1].end - all_phrases[0].start < aside["least"]:
        return
    chances, lengths, late, yaws, pitches = _draws(seed, 450, start, len(all_phrases), kinds=5)
    for k, phrase in enumerate(all_phrases):
        length = phrase.end - phrase.start
        if length < aside["phrase"] or chances[k] >= aside["chance"]:
            continue
        most = min(aside["longest"], aside["share"] * length)
        away = min(most, aside["shortest"] + lengths[k] * max(0.0, most - aside["shortest"]))
        # A glance begins in the first part of the phrase and returns before its end.
        begin = start + phrase.start + late[k] * 0.5 * (length - away)
        # Glances go mainly to one side, never straight up or down.
        yaw = np.interp(abs(2.0 * yaws[k] - 1.0), (0.0, 1.0), aside["yaw"]) * np.sign(yaws[k] - 0.5)
        pitch = np.interp(pitches[k], (0.0, 1.0), aside["pitch"])
        keys = begin + np.array([0.0, aside["saccade"], away, away + aside["saccade"]])
        curve = np.array([0.0, 1.0, 1.0, 0.0])
        yield Gesture(
            "eyes",
            (*turn_channels(EYES_YAW, keys, yaw * curve), *turn_channels(EYES_PITCH, keys, pitch * curve)),
        )


def _draws(seed: int, kind: int, start: float, count: int, kinds: int = 3) -> list[Float64]:
    """Return `count` random numbers for each of `kinds`, which depend on when an utterance starts.

    The first ones stay the same when text is appended or its timing changes.
    """
    k = round(start * 1000.0) * 65536 + np.arange(count, dtype=np.int64)
    return list(uniform(seed, range(kind, kind + kinds), k))
