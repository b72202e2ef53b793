"""emotion, mood: a word or a place on the wheel of emotions -> its archetypes' AUs, a while or for good."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from bml_schema import Emotion, Mood
from realizer.animation.channel import Channel
from realizer.arrays import Float64
from realizer.behaviours import poses
from realizer.behaviours.kind import Fault, Kind, World
from realizer.behaviours.preferred import preferred
from realizer.scheduling.timing import Timing
from realizer.tables.emotions import archetypes, words
from realizer.tables.lexemes import face_lexemes

__all__ = ["KINDS"]

# The usual way of showing each emotion; there are no others yet.
PROFILES = (None, "default")
PARAMETERS = {"intensity": "intensity", "amount": "intensity"}


def timing(node: Emotion, world: World) -> Timing:
    """As its archetype's face lexeme; between two, as much of each as shows."""
    parts = [(share, preferred("faceLexeme", name)) for name, (share, _) in _mix(node).items()]
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
    return poses.shown(poses.columns(_aus(node), node.intensity), times, node.id)


def expand_mood(node: Mood, times: Float64, world: World) -> tuple[Channel, ...]:
    """From start to end the new base face rises, and stays; the neutral one has no channels."""
    return poses.kept(poses.columns(_aus(node), node.intensity), times, node.id)


def check(node: Emotion | Mood, world: World) -> tuple[Fault, ...]:
    """An unknown word is fatal, an unknown profile is not."""
    if node.name is not None and node.name.upper() not in words():
        return (poses.unknown("name", node.name, words()),)
    if node.profile not in PROFILES:
        text = f"profile: wanted default, got {node.profile!r}; shown as usual"
        return (Fault("CUSTOM_ATTRIBUTE_NOT_SUPPORTED", text, fatal=False),)
    return ()


def claims_of_mood(node: Mood, world: World) -> frozenset[str]:
    """A face has one resting state."""
    return frozenset({"base face"})


def _aus(node: Emotion | Mood) -> dict[tuple[int, str], float]:
    """(AU, side) -> intensity at intensity 1."""
    aus: dict[tuple[int, str], float] = {}
    for name, (_, strength) in _mix(node).items():
        for cell, intensity in face_lexemes()[name].aus.items():
            aus[cell] = aus.get(cell, 0.0) + strength * intensity
    return aus


def _mix(node: Emotion | Mood) -> Mapping[str, tuple[float, float]]:
    """Archetype -> (its share, how strongly it shows); {} for the neutral face."""
    if node.angle is not None:
        return wheel(node.angle, node.activation)
    word = words()[(node.name or "").upper()]
    if word.angle is not None:
        return wheel(word.angle, word.activation)
    own = next((archetype for archetype in archetypes() if archetype.name == word.like), None)
    if own is None:
        return {}
    return {own.name: (1.0, (word.activation or own.activation) / own.activation)}


def wheel(angle: float, activation: float | None = None) -> dict[str, tuple[float, float]]:
    """What shows at a place on the wheel: the two archetypes beside it, the nearer the more.

    Each is as strong as its share, times the place's activation over its own (Raouzaiou et al. 2002, 4.2,
    with the nearer one weighing more). It is continuous in angle and activation: where the published rule
    halves what only one of the two shows, it counts by its share here.

    Args:
        angle: degrees, any turn.
        activation: 1..7; None for that of the place, which lies between its neighbours' as the angle does.

    Returns:
        {archetype: (share, strength)}; the shares add up to 1.
    """
    ring = archetypes()
    angle %= 360.0
    after = next((i for i, archetype in enumerate(ring) if archetype.angle > angle), 0)
    low, high = ring[after - 1], ring[after]
    share = ((angle - low.angle) % 360.0) / ((high.angle - low.angle) % 360.0)
    if activation is None:
        activation = (1.0 - share) * low.activation + share * high.activation
    shares = {low.name: (1.0 - share, low), high.name: (share, high)}
    return {name: (part, part * activation / own.activation) for name, (part, own) in shares.items() if part}


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
