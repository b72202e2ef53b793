"""emotion, mood: a word or a place on the wheel of emotions -> its archetypes' AUs, a while or for good."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from bml_schema import Emotion, Mood
from realizer.animation.channel import Channel
from realizer.animation.targets import Target, fap
from realizer.arrays import Float64
from realizer.behaviours import poses
from realizer.behaviours.kind import Fault, Kind, World
from realizer.behaviours.preferred import preferred
from realizer.emotion import emotion as profile_of
from realizer.emotion import known_words, place_of, shares, strength_of, wheel
from realizer.scheduling.timing import Timing
from realizer.tables.emotion_model import emotion_model
from realizer.tables.emotions import emotion_faces

__all__ = ["KINDS", "values_of", "values_of_affect"]

# Ours play as action units, so that speech and blinks find their place in them; the published ones as FAPs.
OWN, PUBLISHED = (None, "default", "own"), ("published", "raw")
PARAMETERS = {"intensity": "intensity", "amount": "intensity"}


def timing(node: Emotion, world: World) -> Timing:
    """As its archetype's face lexeme; between two, as much of each as shows."""
    parts = [
        (share, preferred("faceLexeme", emotion_faces()[name].lexeme))
        for name, share in _mix(node)[0].items()
    ]
    if not parts:
        return preferred("faceLexeme")
    wanted = {
        name: sum(share * getattr(part, name) for share, part in parts)
        for name in ("preferred", "least", "stiffness")
    }
    return replace(parts[0][1], **wanted)


def timing_of_mood(node: Mood, world: World) -> Timing:
    return preferred("mood")


def expand(node: Emotion, times: Float64, world: World) -> tuple[Channel, ...]:
    """There at attackPeak, held to relax, gone at end."""
    return poses.shown(values_of(node), times, node.id)


def expand_mood(node: Mood, times: Float64, world: World) -> tuple[Channel, ...]:
    """From start to end the new base face rises, and stays; the neutral one has no channels."""
    return poses.kept(values_of(node), times, node.id)


def check(node: Emotion | Mood, world: World) -> tuple[Fault, ...]:
    """An unknown word, and one without a face, are fatal, an unknown profile is not."""
    if node.name is not None and node.name.lower() not in known_words():
        return (poses.unknown("name", node.name, known_words()),)
    if node.profile not in (*OWN, *PUBLISHED):
        wanted = ", ".join(name for name in (*OWN, *PUBLISHED) if name)
        text = f"profile: wanted one of {wanted}, got {node.profile!r}; shown as usual"
        return (Fault("CUSTOM_ATTRIBUTE_NOT_SUPPORTED", text, fatal=False),)
    return ()


def claims_of_mood(node: Mood, world: World) -> frozenset[str]:
    """A face has one resting state."""
    return frozenset({"base face"})


def values_of(node: Emotion | Mood) -> dict[Target, float]:
    """Column -> what it shows: AUs 0..1, or FAPs of a published profile."""
    if node.profile in PUBLISHED:
        found = (
            wheel(node.angle, node.activation, node.profile)
            if node.angle is not None
            else profile_of(node.name or "", node.profile)
        )
        return {fap(number): node.intensity * value for number, value in found.midpoint().items()}
    return _shown(*_mix(node), node.intensity)


def values_of_affect(valence: float, arousal: float, intensity: float) -> dict[Target, float]:
    """Column -> what it shows at a place in the plane of valence and arousal, -1..1 each (Paul 2010, 8.2)."""
    parts = shares(math.degrees(math.atan2(arousal, valence)), "own", "affect")
    return _shown(parts, min(math.hypot(valence, arousal), 1.0), intensity)


def _shown(parts: Mapping[str, float], strength: float, intensity: float) -> dict[Target, float]:
    aus: dict[tuple[int, str], float] = {}
    for name, share in parts.items():
        for cell, value in emotion_faces()[name].aus.items():
            aus[cell] = aus.get(cell, 0.0) + share * strength * value
    return poses.columns(aus, intensity)


def _mix(node: Emotion | Mood) -> tuple[Mapping[str, float], float]:
    """{archetype: its share}, and how strongly they show: 1 as drawn; ({}, 0) for the neutral face.

    A place is as strong as its activation beside the rim's. A word is a kind of face, as strong as
    `strength_of` has it, and `intensity` how much of it shows.
    """
    if node.angle is not None:
        most = emotion_model().most
        return shares(node.angle), (most if node.activation is None else node.activation) / most
    place = place_of(node.name or "")
    if place is None:
        return {}, 0.0
    return shares(place.angle, "own", place.ring), strength_of(place)


KINDS = (
    Kind(Emotion, timing, expand, check, parameters=PARAMETERS),
    Kind(
        Mood,
        timing_of_mood,
        expand_mood,
        check,
        claims=claims_of_mood,
        parameters=PARAMETERS,
        region="face",
    ),
)
