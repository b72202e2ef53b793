"""Profiles between archetypes: continuous over the wheel, or by the published rules."""

import math
from bisect import bisect_right
from functools import lru_cache
from typing import NamedTuple

from realizer.emotions.archetypes import archetypes
from realizer.emotions.profile import Profile, split_number
from realizer.tables.emotions import emotion_model
from realizer.tables.emotions import ring as places


class Anchor(NamedTuple):
    """An archetype on the wheel: its profile, activation above 0, and angle in degrees."""

    profile: Profile
    activation: float
    angle: float


def between(one: Anchor, two: Anchor, angle: float, activation: float, name: str = "") -> Profile:
    """Return the profile of an emotion between two archetypes, by the published rules (4.2, rules 1 to 6).

    The nearer archetype has the larger weight, as in the example of the paper (eq. 13); eq. 5 and 6 have the
    weights exchanged. The result is not continuous in the angle; that of `wheel` is.

    Args:
        one, two: archetypes in the direction of rising angles, across 0 if necessary.
        angle: degrees, from one to two.
        activation: activation of the intermediate emotion.

    Raises:
        ValueError: an angle that is not between them, or an invalid activation.
    """
    _check(one.activation, activation)
    _check(two.activation, activation)
    width = (two.angle - one.angle) % 360.0
    share = ((angle - one.angle) % 360.0) / width if width else math.inf  # weight of `two`
    if not share <= 1.0:
        raise ValueError(f"angle: wanted one from {one.angle:g} to {two.angle:g} degrees, got {angle:g}")
    first = one.profile.scaled(activation / one.activation).ranges
    second = two.profile.scaled(activation / two.activation).ranges
    ranges: dict[int, tuple[float, float]] = {}
    for fap in sorted({*first, *second}):  # rule 1
        if fap not in first or fap not in second:  # rule 4: averaged with the neutral face
            low, high = first[fap] if fap in first else second[fap]
            ranges[fap] = low / 2, high / 2
        elif sum(first[fap]) * sum(second[fap]) >= 0:  # rule 2: the same direction
            # Interpolating middles and lengths is the same as interpolating both ends.
            low, high = ((1 - share) * a + share * b for a, b in zip(first[fap], second[fap], strict=True))
            ranges[fap] = low, high
        else:  # rule 3: the intersection, which is mostly empty
            low, high = max(first[fap][0], second[fap][0]), min(first[fap][1], second[fap][1])
            if low <= high:
                ranges[fap] = low, high
    return Profile(name or f"between {one.profile.name} and {two.profile.name}", one.profile.source, ranges)


def _check(own: float, activation: float) -> None:
    if not (math.isfinite(own) and own > 0 and math.isfinite(activation) and activation >= 0):
        raise ValueError(
            f"activation: wanted 0 or more, and an archetype's above 0, got {activation} and {own}"
        )


NEUTRAL = "neutral"


def wheel(
    angle: float, activation: float | None = None, profiles: str = "own", ring: str = "paul"
) -> Profile:
    """Return the profile at a place on the wheel: a blend of the two nearest archetypes.

    The ranges of each archetype are multiplied by its weight and by the ratio of the activations, and added.
    Unlike the published rules (`between`), this is continuous: they take half of a FAP that only
    one archetype moves, and intersect contradicting ranges.

    Args:
        angle: degrees, modulo 360.
        activation: from 0 (neutral) to 7 (the rim); None: that of the archetypes.
        profiles: a set of `archetypes`; "own" has archetypes at the rim, others those of the paper.
        ring: "paul", with trust at 0 and fear at 45; "plutchik", with the angles of Plutchik's words; or
            "affect", with the angles of (valence, arousal).

    Raises:
        ValueError: an invalid angle or activation, or an unknown ring or set.

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
    """Return the strength of our own archetypes at an activation: 0 in the middle, 1 at the rim, or for None.

    Raises ValueError for an activation outside the wheel.
    """
    most = emotion_model().most
    if activation is None:
        return 1.0
    if not 0 <= activation <= most:
        raise ValueError(f"activation: wanted 0..{most:g}, got {activation:g}")
    return activation / most


def blend_weights(angle: float, profiles: str = "own", ring: str = "paul") -> dict[str, float]:
    """Return archetype -> weight of the one or two archetypes at an angle; weights add up to 1."""
    pairs = neighbours(angle, profiles, ring)
    return {split_number(anchor.profile.name)[0]: share for anchor, share in pairs if share}


def affect(valence: float, arousal: float, profiles: str = "own") -> Profile:
    """Return the profile at a place in the plane of valence and arousal (the extension of Paul 2010, 8.2).

    Plutchik's angles do not correspond to valence, so archetypes are placed by Whissell's evaluation and
    activation of their words. The strength is proportional to the distance from the middle, up to 1.

    Args:
        valence, arousal: -1..1; (0, 0) is the neutral face.

    Raises:
        ValueError: numbers outside that range.
    """
    angle, away = place_of_affect(valence, arousal)
    return wheel(angle, None, profiles, "affect").scaled(away)


def place_of_affect(valence: float, arousal: float) -> tuple[float, float]:
    """Return angle on the ring "affect" in degrees and distance from the middle 0..1; raises ValueError."""
    for name, value in (("valence", valence), ("arousal", arousal)):
        if not -1 <= value <= 1:
            raise ValueError(f"{name}: wanted -1..1, got {value:g}")
    return math.degrees(math.atan2(arousal, valence)), min(math.hypot(valence, arousal), 1.0)


def neighbours(angle: float, profiles: str, ring: str) -> tuple[tuple[Anchor, float], tuple[Anchor, float]]:
    """Return the archetype at or before an angle and the one after it, with their weights."""
    if not math.isfinite(angle):
        raise ValueError(f"angle: wanted a number of degrees, got {angle}")
    anchors, angles = _anchors(profiles, ring)
    angle %= 360.0  # first, since a difference of huge angles would be inexact
    after = bisect_right(angles, angle) % len(anchors)
    low, high = anchors[after - 1], anchors[after]
    share = ((angle - low.angle) % 360.0) / ((high.angle - low.angle) % 360.0)
    return (low, 1.0 - share), (high, share)


@lru_cache(maxsize=64)
def _anchors(profiles: str, ring: str) -> tuple[tuple[Anchor, ...], tuple[float, ...]]:
    """Return the emotions of a ring that have a profile in the set, by angle, and their angles."""
    model, known = emotion_model(), archetypes(profiles)
    if not places(ring):
        raise ValueError(f"ring: wanted paul, plutchik or affect, got {ring!r}")
    anchors = []
    for place in places(ring).values():
        if place.kind == "rest":
            anchors.append(Anchor(Profile(NEUTRAL, profiles, {}), model.most, place.angle))
        elif place.name in known:
            profile = next(iter(known[place.name].values()))
            own = model.most if profiles == "own" or place.activation is None else place.activation
            anchors.append(Anchor(profile, own, place.angle))
    if not anchors:
        raise ValueError(f"profiles: wanted those of emotions on the wheel, got {profiles}")
    # A profile file may leave out half of the wheel: its middle is neutral.
    for one, two in zip(anchors, [*anchors[1:], anchors[0]], strict=True):
        arc = (two.angle - one.angle) % 360.0 or 360.0
        if arc > 180.0:
            middle = Anchor(Profile(NEUTRAL, profiles, {}), model.most, (one.angle + arc / 2) % 360.0)
            anchors = sorted([*anchors, middle], key=lambda anchor: anchor.angle)
    return tuple(anchors), tuple(anchor.angle for anchor in anchors)
