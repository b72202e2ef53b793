"""gaze, gazeShift: the eyes lead to the target, the head follows, the eyes turn back by as much."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bml_schema import Gaze, GazeShift
from realizer import tables
from realizer.animation.channel import Channel, Layer
from realizer.animation.targets import au, presence
from realizer.arrays import Float64
from realizer.behaviours.kind import Fault, Kind, World
from realizer.behaviours.preferred import preferred
from realizer.behaviours.scene import angles, facts, limits, target_faults, turn
from realizer.scheduling.timing import Timing

__all__ = ["KINDS"]

# offsetDirection -> part of the offset that is yaw (left positive) and pitch (up positive).
DIAGONAL = 2**-0.5
DIRECTIONS = {
    "RIGHT": (-1.0, 0.0),
    "LEFT": (1.0, 0.0),
    "UP": (0.0, 1.0),
    "DOWN": (0.0, -1.0),
    "UPRIGHT": (-DIAGONAL, DIAGONAL),
    "UPLEFT": (DIAGONAL, DIAGONAL),
    "DOWNRIGHT": (-DIAGONAL, -DIAGONAL),
    "DOWNLEFT": (DIAGONAL, -DIAGONAL),
}


@dataclass(frozen=True, eq=False)
class Aim:
    """Where a gaze ends.

    Attributes:
        eyes: (2,) degrees, yaw and pitch of the eyes in the head.
        head: (2,) degrees.
        first: (2,) degrees, as far as the eyes get before the head follows.
        away: (2,) degrees, where the eyes are when they have turned back and the head has not yet.
        inward: degrees that each eye turns in.
    """

    eyes: Float64
    head: Float64
    first: Float64
    away: Float64
    inward: float


def aim(node: Gaze | GazeShift, world: World) -> Aim:
    """How eyes and head share the angle: the head its part by influence, but little of a small angle; the
    eyes the rest as far as they turn, and the head again what is left.
    """
    yaw, pitch, inward = angles(node.target, world)
    offset = node.offset_angle * np.array(DIRECTIONS[node.offset_direction])
    angle = np.array([yaw, pitch]) + offset
    # Behind is behind on the nearer side.
    angle = np.array([(angle[0] + 180.0) % 360.0 - 180.0, np.clip(angle[1], -90.0, 90.0)])
    shares = facts()["influence"]
    part = shares.get((node.influence or "default").upper(), shares["default"])["head"]
    eyes_most, head_most = limits("eyes"), limits("head") * (part > 0)
    size = float(np.hypot(*angle))
    head = angle * part * size / (size + facts()["head"]["small"])
    head = np.where(np.abs(angle - head) > eyes_most, angle - np.sign(angle) * eyes_most, head)
    head = np.clip(head, -head_most, head_most)
    return Aim(
        eyes=np.clip(angle - head, -eyes_most, eyes_most),
        head=head,
        first=np.clip(angle, -eyes_most, eyes_most),
        away=np.clip(-head, -eyes_most, eyes_most),
        inward=inward,
    )


def timing(node: Gaze, world: World) -> Timing:
    return preferred("gaze", node.influence or "")


def timing_of_shift(node: GazeShift, world: World) -> Timing:
    return preferred("gazeShift", node.influence or "")


def expand(node: Gaze, times: Float64, world: World) -> tuple[Channel, ...]:
    """There from start to ready, held to relax, back at end. While it lasts it takes eyes and head from the
    base gaze; EYES takes the eyes only.
    """
    start, ready, relax, end = times
    to = aim(node, world)
    there, back = start + _lead(ready - start), relax + _lead(end - relax)
    rest = np.zeros(2)
    keys = np.array([start, there, ready, relax, back, end])
    eyes = np.stack([rest, to.first, to.eyes, to.eyes, to.away, rest])
    head = np.stack([rest, rest, to.head, to.head, to.head, rest])
    moving = [
        *turn("eyes", keys, eyes, layer=Layer.GAZE, source=node.id),
        *turn("head", keys, head, layer=Layer.GAZE, source=node.id),
        *_converge(keys, np.array([0, 1, 1, 1, 0, 0]) * to.inward, Layer.GAZE, node.id),
    ]
    taken = {"eyes": (0, 1, 1, 1, 0, 0)}
    if (node.influence or "").upper() != "EYES":
        taken["head"] = (0, 0, 1, 1, 1, 0)
    for region, values in taken.items():
        moving.append(
            Channel(presence(region), keys, np.array(values, np.float64), layer=Layer.GAZE, source=node.id)
        )
    return tuple(moving)


def expand_shift(node: GazeShift, times: Float64, world: World) -> tuple[Channel, ...]:
    """There from start to end, and from then on."""
    start, end = times
    to = aim(node, world)
    keys = np.array([start, start + _lead(end - start), end])
    rest = np.zeros(2)
    return (
        *turn(
            "eyes", keys, np.stack([rest, to.first, to.eyes]), layer=Layer.BASE, holds=True, source=node.id
        ),
        *turn("head", keys, np.stack([rest, rest, to.head]), layer=Layer.BASE, holds=True, source=node.id),
        *_converge(keys, np.array([0, 1, 1]) * to.inward, Layer.BASE, node.id, holds=True),
    )


def check(node: Gaze | GazeShift, world: World) -> tuple[Fault, ...]:
    return target_faults(node.target, world)


def _lead(length: float) -> float:
    """Seconds by which the eyes lead in a turn of this length: at most half of it."""
    return min(float(facts()["eyes"]["lead"]), length / 2)


def _converge(
    times: Float64, inward: Float64, layer: Layer, source: str, holds: bool = False
) -> tuple[Channel, ...]:
    """AU66 for eyes that turn in by so many degrees each."""
    if not inward.any():
        return ()
    most = tables.by_number(tables.action_units())[66].degrees
    values = np.minimum(inward / most, 1.0)
    return (Channel(au(66)[0], times, values, layer=layer, holds=holds, source=source),)


def claims(node: Gaze, world: World) -> frozenset[str]:
    """Every influence takes the eyes: one cannot look at two things."""
    return frozenset({"gaze"})


def claims_of_shift(node: GazeShift, world: World) -> frozenset[str]:
    """A base state can change to one other at a time; a temporary gaze does not mind."""
    return frozenset({"base gaze"})


KINDS = (
    Kind(Gaze, timing, expand, check, claims=claims),
    Kind(GazeShift, timing_of_shift, expand_shift, check, claims=claims_of_shift, region="eyes"),
)
