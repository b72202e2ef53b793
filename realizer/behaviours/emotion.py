"""emotion, mood: an emotion word or place on the wheel as action units, for a while or until changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from bml_schema import Emotion, Mood
from realizer.animation.axis import Target, fap
from realizer.animation.channel import Channel
from realizer.behaviours import pose_channels
from realizer.behaviours.expressive_channels import express
from realizer.behaviours.kind import BehaviourKind, Fault, PlanningContext, claiming
from realizer.behaviours.table_timing import table_timing, timing_from_table
from realizer.core.array_types import Float64
from realizer.emotions.wheel import affect, blend_weights, place_of_affect, strength_at, wheel
from realizer.emotions.words import UnknownWordError, known_words, place_of, strength_of
from realizer.emotions.words import emotion as profile_of
from realizer.scheduling.timing import Timing
from realizer.tables.emotion_model import emotion_model
from realizer.tables.emotions import emotion_faces

# Our profiles play as action units, so that speech and blinks combine with them; published ones as FAPs.
OWN, PUBLISHED = (None, "default", "own"), ("published", "raw")
PARAMETERS = {"intensity": "intensity", "amount": "intensity"}


class EmotionRequest(NamedTuple):
    """The emotion of an element: a lower-case word of one of the sets, or a place."""

    name: str | None
    profiles: str
    angle: float | None
    activation: float | None
    valence: float | None
    arousal: float | None

    @classmethod
    def of(cls, node: Emotion | Mood) -> EmotionRequest:
        profiles = node.profile if node.profile is not None and node.profile in PUBLISHED else "own"
        name = None if node.name is None else " ".join(node.name.split()).lower()
        return cls(name, profiles, node.angle, node.activation, node.valence, node.arousal)


def timing(node: Emotion, context: PlanningContext) -> Timing:
    """Return the timing of the archetype's face lexeme; between two archetypes their weighted mean."""
    return _timing(EmotionRequest.of(node))


@lru_cache(maxsize=1000)
def _timing(feeling: EmotionRequest) -> Timing:
    parts = [
        (share, timing_from_table("faceLexeme", emotion_faces()[name].lexeme))
        for name, share in _mix(feeling)[0].items()
    ]
    if not parts:
        return timing_from_table("faceLexeme")
    wanted = {
        name: sum(share * getattr(part, name) for share, part in parts)
        for name in ("preferred", "least", "stiffness")
    }
    return replace(parts[0][1], **wanted)


def expand(node: Emotion, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels with the emotion from attackPeak to relax."""
    channels = pose_channels.hold(values_of(node), times, node.id)
    return channels if node.profile in PUBLISHED else express(channels, context)


def expand_mood(node: Mood, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels that rise to the new base face and stay; the neutral face has none."""
    return pose_channels.keep_base(values_of(node), times, node.id)


def check(node: Emotion | Mood, context: PlanningContext) -> tuple[Fault, ...]:
    """Return faults: an unknown word, or one without a face, is fatal, an unknown profile is not."""
    if node.name is not None:
        try:
            request = EmotionRequest.of(node)
            profile_of(request.name or "", request.profiles)
        except UnknownWordError as wrong:
            if node.name[-1:].isdecimal():
                return (Fault("CANNOT_CREATE_BEHAVIOR", str(wrong).replace("emotion: ", "name: ", 1)),)
            return (pose_channels.unknown_word("name", node.name, known_words()),)
        except ValueError as wrong:
            return (Fault("CANNOT_CREATE_BEHAVIOR", f"name: {wrong}"),)
    if node.profile not in (*OWN, *PUBLISHED):
        wanted = ", ".join(name for name in (*OWN, *PUBLISHED) if name)
        text = f"profile: wanted one of {wanted}, got {node.profile!r}; shown as usual"
        return (Fault("CUSTOM_ATTRIBUTE_NOT_SUPPORTED", text, fatal=False),)
    return ()


def values_of(node: Emotion | Mood) -> dict[Target, float]:
    """Return column -> value: AUs 0..1, or FAPs of a published profile; random within its ranges with a seed.

    Raises:
        ValueError: a place off the wheel, or off the plane of valence and arousal.
    """
    if node.profile in PUBLISHED:
        if node.angle is not None:
            profile = wheel(node.angle, node.activation, node.profile)
        elif node.valence is not None and node.arousal is not None:
            profile = affect(node.valence, node.arousal, node.profile)
        else:
            profile = profile_of(node.name or "", node.profile)
        frame = profile.frame() if node.seed is None else profile.draw(node.seed)
        return {fap(number): node.intensity * float(frame[number - 1]) for number in profile.ranges}
    aus = _aus(EmotionRequest.of(node))
    return pose_channels.columns(aus if node.seed is None else _varied(aus, node.seed), node.intensity)


def _varied(aus: Mapping[tuple[int, str], float], seed: int) -> dict[tuple[int, str], float]:
    """Scale each action unit randomly within the spread of our profiles, both sides equally."""
    numbers = sorted({number for number, _ in aus})
    spread = emotion_model().spread
    factors = dict(
        zip(numbers, np.random.default_rng(seed).uniform(1 - spread, 1 + spread, len(numbers)), strict=True)
    )
    return {cell: value * float(factors[cell[0]]) for cell, value in aus.items()}


@lru_cache(maxsize=1000)
def _aus(feeling: EmotionRequest) -> Mapping[tuple[int, str], float]:
    """Return (AU, side) -> 0..1 at intensity 1, for an emotion without a published profile."""
    parts, strength = _mix(feeling)
    aus: dict[tuple[int, str], float] = {}
    for name, share in parts.items():
        for cell, value in emotion_faces()[name].aus.items():
            aus[cell] = aus.get(cell, 0.0) + share * strength * value
    return MappingProxyType(aus)


def _mix(feeling: EmotionRequest) -> tuple[Mapping[str, float], float]:
    """Return {archetype: weight} and their strength, where 1 is full; ({}, 0) for the neutral face.

    The strength of a place is its activation relative to the rim's, or its distance from the middle of
    valence and arousal. The strength of a word is `strength_of`; `intensity` scales both.
    """
    if feeling.angle is not None:
        return blend_weights(feeling.angle), strength_at(feeling.activation)
    if feeling.valence is not None and feeling.arousal is not None:
        angle, away = place_of_affect(feeling.valence, feeling.arousal)
        parts = blend_weights(angle, "own", "affect")
        return {name: share for name, share in parts.items() if name in emotion_faces()}, away
    place = place_of(feeling.name or "", feeling.profiles)
    if place is None:
        return {}, 0.0
    return blend_weights(place.angle, "own", place.ring), strength_of(place)


KINDS = (
    BehaviourKind(Emotion, timing, expand, check, parameters=PARAMETERS),
    BehaviourKind(
        Mood,
        table_timing("mood"),
        expand_mood,
        check,
        claims=claiming("base face"),
        parameters=PARAMETERS,
        region="face",
    ),
)
