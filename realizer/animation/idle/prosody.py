"""Motion that accompanies speech: of the head, nods and raised brows on accents, glances, ends of phrases.

It depends on the seed, the utterances and their start times, but not on the requested frames.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np

from realizer import tables
from realizer.animation.axis import AU_NAMES, au, axis, region
from realizer.animation.channel import Channel, Layer
from realizer.animation.idle.blinks import PhraseEnd
from realizer.animation.idle.rng import uniform
from realizer.animation.idle.speaking_head import SOURCE, head_channels, style_of, turn_channels
from realizer.core.array_types import Float64
from realizer.speech.accents import Phrase, phrases, prosody_facts
from realizer.speech.utterance import Utterance

# s after the end of a block, in which it may still affect visible blinks.
AFTERMATH = 2.0

# Signed angles: AUs of (negative, positive). When the head turns down, the eyes turn up by as much.
PITCH, EYES_PITCH, EYES_YAW = (54, 53), (64, 63), (62, 61)
BROWS = {1, 2, 4}
BROW_FAPS = range(31, 39)


class SpeechSpan(NamedTuple):
    """An utterance that starts at `start` and is cut off at `until`; seconds on the session clock.

    `face` has the channels of its block, which show what it is said with.
    """

    start: float
    until: float
    utterance: Utterance
    face: tuple[Channel, ...] = ()


class KnownMotion(NamedTuple):
    """A channel of a document or a client, and the time (session clock) at which it became known."""

    known: float
    channel: Channel


@dataclass(frozen=True, eq=False)
class Gesture:
    """A movement of "head", "eyes" or "brows"."""

    region: str
    channels: tuple[Channel, ...]

    @property
    def begin(self) -> float:
        return float(self.channels[0].times[0])

    @property
    def end(self) -> float:
        return float(self.channels[0].times[-1])


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
    has begun, it is faded out. The continuous motion of the head gives way and comes back.

    Args:
        talks: what the character says.
        start, end: seconds on the session clock.
        seed: of the character.
        known_motions: all other channels of the character.
    """
    shown: list[Channel] = []
    fade = prosody_facts()["yield"]["fade"]
    claims: list[tuple[str, float, float, float]] | None = None
    for talk in talks:
        if talk.start > end or min(talk.start + talk.utterance.duration, talk.until) + AFTERMATH < start:
            continue
        if claims is None:  # computed only when needed: characters are silent most of the time
            claims = list(_claims(known_motions))
        head = (claim[1:] for claim in claims if claim[0] == "head")
        style = style_of(talk.face, talk.start + 0.5)
        shown += head_channels(talk.utterance, talk.start, talk.until, seed, style, head)
        for gesture in _gestures(phrases(talk.utterance), talk.start, seed):
            if gesture.end < start or gesture.begin > end or gesture.begin >= talk.until:
                continue
            leaves = talk.until
            for part, known, first, last in claims:
                if part == gesture.region and first < gesture.end and last > gesture.begin:
                    leaves = min(leaves, known)
            if gesture.begin < leaves:
                shown += [
                    c if leaves >= gesture.end else c.faded(leaves, leaves + fade) for c in gesture.channels
                ]
    return shown


def _claims(known_motions: Iterable[KnownMotion]) -> Iterator[tuple[str, float, float, float]]:
    """Yield part of the face, time at which it is known, first and last second of motions."""
    for known, channel in known_motions:
        part = _parts().get(channel.target.column)
        # Nods, like sway, are added to the base direction of the head.
        if part is None or (part == "head" and channel.layer is Layer.BASE) or not channel.values.any():
            continue
        yield part, known, *channel.span


@cache
def _parts() -> dict[int, str]:
    """Return the part of the face, "head", "eyes" or "brows", of the columns that prosody may move."""
    parts = {}
    numbers = {row.name: row.fap for row in tables.faps()}
    for name, target in axis().items():
        is_au = target.column < len(AU_NAMES())
        if region(target) in ("head", "eyes"):
            parts[target.column] = region(target)
        elif (is_au and int(name.rstrip("LR")) in BROWS) or numbers.get(name) in BROW_FAPS:
            parts[target.column] = "brows"
    return parts


@lru_cache(maxsize=64)
def _gestures(all_phrases: tuple[Phrase, ...], start: float, seed: int) -> tuple[Gesture, ...]:
    """Return all movements that may accompany an utterance that starts at `start`."""
    return (*_accents(all_phrases, start, seed), *_looks_aside(all_phrases, start, seed))


def _accents(all_phrases: tuple[Phrase, ...], start: float, seed: int) -> Iterator[Gesture]:
    nod, brows = prosody_facts()["nod"], prosody_facts()["brows"]
    nods, raises, sizes = _draws(seed, 400, start, sum(len(phrase.accents) for phrase in all_phrases))
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


def _nod(time: float, degrees: float) -> Gesture:
    nod = prosody_facts()["nod"]
    keys = np.array([time - nod["attack"], time, time + nod["relax"]])
    down = np.array([0.0, -degrees, 0.0])
    return Gesture("head", (*turn_channels(PITCH, keys, down), *turn_channels(EYES_PITCH, keys, -down)))


def _raise(time: float, most: float) -> Gesture:
    brows = prosody_facts()["brows"]
    top = time + brows["hold"]
    keys = np.array([time - brows["attack"], time, top, top + brows["relax"]])
    values = np.array([0.0, most, most, 0.0])
    lifts = (target for number in (1, 2) for target in au(number))
    return Gesture("brows", tuple(Channel(t, keys, values, layer=Layer.IDLE, source=SOURCE) for t in lifts))


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
