"""Continuous profiles over the emotion wheel, or over valence and arousal."""

from __future__ import annotations

import math
from bisect import bisect_right
from functools import cache

from realizer.emotions.archetypes import archetypes
from realizer.emotions.intermediate import Anchor
from realizer.emotions.profile import Profile
from realizer.tables.emotion_model import emotion_model
from realizer.tables.wheel_words import ring as places

NEUTRAL = "neutral"


def wheel(
    angle: float, activation: float | None = None, profiles: str = "own", ring: str = "paul"
) -> Profile:
    """Return the profile at a place on the wheel: a mix of the archetypes on both sides, by nearness.

    Each range is that of an archetype times the activation over the archetype's own, and times its share;
    a FAP that only one of them moves counts by its share too, and those in which the two contradict each
    other are added up. The published rules (`intermediate.between`) have a constant half for the first and
    an intersection for the second, which make the face jump at the archetypes and beside them.

    Args:
        angle: degrees, any turn: -700 is 20.
        activation: 0, the middle, which is neutral, to 7, the rim; None as for the archetypes.
        profiles: "own", whose archetypes are at the rim, "published" or "raw", at their activations.
        ring: "paul", with trust at 0, fear at 45 and so on, "plutchik", with the angles of Plutchik's words,
            or "affect", by the angle of (valence, arousal).

    Raises:
        ValueError: an angle that is no number, an activation off the wheel, another ring or set.

    Source: Paul 2010, chapter 6; Raouzaiou et al. 2002, 4.
    """
    strength_at(activation)
    ranges: dict[int, tuple[float, float]] = {}
    parts = []
    for anchor, share in neighbours(angle, profiles, ring):
        if not share:
            continue
        parts.append(anchor.profile.name)
        weight = share if activation is None else share * activation / anchor.activation
        for fap, (low, high) in anchor.profile.ranges.items():
            a, b = ranges.get(fap, (0.0, 0.0))
            ranges[fap] = a + weight * low, b + weight * high
    return Profile(" and ".join(parts), profiles, ranges)


def strength_at(activation: float | None) -> float:
    """Return the strength of our own archetypes at an activation: 0 in the middle, 1 at the rim (None).

    Raises:
        ValueError: an activation off the wheel.
    """
    most = emotion_model().most
    if activation is None:
        return 1.0
    if not 0 <= activation <= most:
        raise ValueError(f"activation: wanted 0..{most:g}, got {activation:g}")
    return activation / most


def blend_weights(angle: float, profiles: str = "own", ring: str = "paul") -> dict[str, float]:
    """Archetype -> how much of it shows at that angle; the one or two shares add up to 1."""
    pairs = neighbours(angle, profiles, ring)
    return {_plain(anchor.profile.name): share for anchor, share in pairs if share}


def affect(valence: float, arousal: float, profiles: str = "own") -> Profile:
    """Return the profile at a place in the plane of valence and arousal (the extension of Paul 2010, 8.2).

    There is no one-to-one relation between valence and the angle of Plutchik's wheel, so this has a ring of
    its own: each archetype stands where Whissell's evaluation and activation of its word put it, and shows
    the more the farther a place is from the middle; beyond the circle it is as at its rim.

    Args:
        valence, arousal: -1..1; 0 and 0 is the neutral face.

    Raises:
        ValueError: not numbers in that range.
    """
    angle, away = place_of_affect(valence, arousal)
    return wheel(angle, None, profiles, "affect").scaled(away)


def place_of_affect(valence: float, arousal: float) -> tuple[float, float]:
    """Degrees on the ring "affect", and how far from the middle: 0..1.

    Raises:
        ValueError: not numbers in -1..1.
    """
    for name, value in (("valence", valence), ("arousal", arousal)):
        if not -1 <= value <= 1:
            raise ValueError(f"{name}: wanted -1..1, got {value:g}")
    return math.degrees(math.atan2(arousal, valence)), min(math.hypot(valence, arousal), 1.0)


def neighbours(angle: float, profiles: str, ring: str) -> tuple[tuple[Anchor, float], tuple[Anchor, float]]:
    """The archetype at or before an angle and the one after it, each with its share."""
    if not math.isfinite(angle):
        raise ValueError(f"angle: wanted a number of degrees, got {angle}")
    anchors, angles = _anchors(profiles, ring)
    angle %= 360.0  # before anything is taken from it: of a huge angle, a few degrees would be lost
    after = bisect_right(angles, angle) % len(anchors)
    low, high = anchors[after - 1], anchors[after]
    share = ((angle - low.angle) % 360.0) / ((high.angle - low.angle) % 360.0)
    return (low, 1.0 - share), (high, share)


def _plain(name: str) -> str:
    """The name of a profile without its number."""
    return name.rpartition(" ")[0] or name


@cache
def _anchors(profiles: str, ring: str) -> tuple[tuple[Anchor, ...], tuple[float, ...]]:
    """Return the emotions of a ring that have a profile in the set, by rising angle, and the angles."""
    model, known = emotion_model(), archetypes(profiles)
    if not places(ring):
        raise ValueError(f"ring: wanted paul, plutchik or affect, got {ring!r}")
    anchors = []
    for place in places(ring).values():
        if place.kind == "rest":
            anchors.append(Anchor(Profile(NEUTRAL, profiles, {}), model.most, place.angle))
        elif place.name in known:
            numbered = known[place.name]
            profile = numbered[0] if profiles == "own" else numbered[model.chosen[place.name]]
            own = model.most if profiles == "own" or place.activation is None else place.activation
            anchors.append(Anchor(profile, own, place.angle))
    return tuple(anchors), tuple(anchor.angle for anchor in anchors)
