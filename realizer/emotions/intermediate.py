"""Profiles between archetypes (Raouzaiou et al. 2002, section 4)."""

import math
from typing import NamedTuple

from realizer.emotions.profile import Profile


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
