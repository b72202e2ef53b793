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
from realizer.behaviours.kind import (
    BehaviourKind,
    Fault,
    PlanningContext,
    claiming,
    table_timing,
    timing_from_table,
)
from realizer.behaviours.media import MediaError, media_file
from realizer.behaviours.pose_channels import express
from realizer.core.array_types import Float64
from realizer.emotions.archetypes import archetypes, is_profile_file, split_set
from realizer.emotions.chosen import emotion_and_shares
from realizer.emotions.wheel import blend_weights, place_of_affect, strength_at
from realizer.emotions.words import UnknownWordError, known_words, place_of, strength_of
from realizer.emotions.words import emotion as profile_of
from realizer.scheduling.timing import Timing
from realizer.tables.emotions import emotion_faces, emotion_model

# Our profiles play as action units, so that speech and blinks combine with them; others as FAPs.
OWN, PUBLISHED = (None, "default", "own"), ("published", "raw")
NO_MEDIA = PlanningContext()
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
    def of(cls, node: Emotion | Mood, profiles: str) -> EmotionRequest:
        name = None if node.name is None else " ".join(node.name.split()).lower()
        return cls(name, profiles, node.angle, node.activation, node.valence, node.arousal)


def timing(node: Emotion, context: PlanningContext) -> Timing:
    """Return the timing of the archetype's face lexeme; between two archetypes their weighted mean."""
    return _timing(EmotionRequest.of(node, _set_of(node, context)))


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
    channels = pose_channels.hold(values_of(node, context), times, node.id)
    return express(channels, context) if _set_of(node, context) == "own" else channels


def expand_mood(node: Mood, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels that rise to the new base face and stay; the neutral face has none."""
    return pose_channels.keep_base(values_of(node, context), times, node.id)


def check(node: Emotion | Mood, context: PlanningContext) -> tuple[Fault, ...]:
    """Return faults: an unknown word, or one without a face, is fatal, an unknown profile is not."""
    try:
        profiles = _set_of(node, context)
        archetypes(profiles)
    except (MediaError, ValueError) as wrong:
        return (
            Fault("CANNOT_CREATE_BEHAVIOR", f"profile: {wrong}".replace("profile: profiles: ", "profile: ")),
        )
    if node.name is not None:
        try:
            (place_of if profiles == "own" else profile_of)(node.name, profiles)
        except UnknownWordError as wrong:
            if node.name[-1:].isdecimal():
                return (Fault("CANNOT_CREATE_BEHAVIOR", str(wrong).replace("emotion: ", "name: ", 1)),)
            return (pose_channels.unknown_word("name", node.name, known_words()),)
        except ValueError as wrong:
            return (Fault("CANNOT_CREATE_BEHAVIOR", f"name: {wrong}"),)
    if profiles == "own" and node.profile not in OWN:
        wanted = ", ".join(name for name in (*OWN, *PUBLISHED) if name)
        text = f"profile: wanted one of {wanted}, got {node.profile!r}; shown as usual"
        return (Fault("CUSTOM_ATTRIBUTE_NOT_SUPPORTED", text, fatal=False),)
    return ()


def values_of(node: Emotion | Mood, context: PlanningContext = NO_MEDIA) -> dict[Target, float]:
    """Return column -> value: AUs 0..1, or FAPs of another set's profile; random with a seed.

    Raises:
        ValueError: a place off the wheel, or off the plane of valence and arousal.
        MediaError: a profile file that is not in the media folder.
    """
    profiles = _set_of(node, context)
    if profiles != "own":
        affect = node.valence, node.arousal
        profile, _ = emotion_and_shares(node.name, node.angle, node.activation, affect, profiles)
        frame = profile.frame() if node.seed is None else profile.draw(node.seed)
        return {fap(number): node.intensity * float(frame[number - 1]) for number in profile.ranges}
    aus = _aus(EmotionRequest.of(node, profiles))
    return pose_channels.columns(aus if node.seed is None else _varied(aus, node.seed), node.intensity)


def _set_of(node: Emotion | Mood, context: PlanningContext) -> str:
    """Return the set of profiles that an element names; a profile file is one of the media folder."""
    name, chosen = split_set(node.profile or "own")
    if is_profile_file(name):
        name = str(media_file(name, context))
    elif name not in PUBLISHED:
        return "own"
    return ", ".join([name, *(f"{emotion} {number}" for emotion, number in chosen.items())])


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
    try:
        place = place_of(feeling.name or "", feeling.profiles)
    except UnknownWordError:  # an emotion of a profile file that is not on the wheel
        place = None
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
