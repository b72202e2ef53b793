"""gaze, gazeShift: the eyes turn first, the head follows, and the eyes turn back meanwhile."""

import math
from typing import NamedTuple

import numpy as np

from bml_schema import Gaze, GazeShift
from realizer import tables
from realizer.animation.axis import au, mask_channel
from realizer.animation.channel import Channel, Layer
from realizer.behaviours.gaze_targets import Turn, angles, check_target, facts, limited, limits, turn
from realizer.behaviours.kind import BehaviourKind, PlanningContext, claiming, timing_from_table
from realizer.core.array_types import Float64
from realizer.scheduling.timing import Timing

DIAGONAL = 2**-0.5
# offsetDirection -> parts of the offset in yaw (left is positive) and pitch (up is positive).
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

REST: Turn = (0.0, 0.0)
# Mask of the base state of eyes and head at the keys of a gaze: start, eyes on target, ready, relax, eyes
# back, end.
EYES_MASK = np.array([0.0, 1.0, 1.0, 1.0, 0.0, 0.0])
HEAD_MASK = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 0.0])


class GazeAngles(NamedTuple):
    """The angles of a gaze."""

    eyes: Turn  # final angles of the eyes relative to the head
    head: Turn  # final angles of the head
    first: Turn  # angles of the eyes before the head follows
    away: Turn  # angles of the eyes when they have turned back and the head has not
    inward: float  # degrees by which each eye turns inwards


def split_angle(node: Gaze | GazeShift, context: PlanningContext) -> GazeAngles:
    """Divide the angle of a target between eyes and head.

    The part of the head depends on the influence, and is small for small angles. The eyes turn by the rest up
    to their limit, and the head by what remains.
    """
    yaw, pitch, inward = angles(node.target, context)
    left, up = DIRECTIONS[node.offset_direction]
    # The head turns to the nearer side of a target behind it.
    yaw = (yaw + node.offset_angle * left + 180.0) % 360.0 - 180.0
    pitch = max(-90.0, min(90.0, pitch + node.offset_angle * up))
    shares = facts()["influence"]
    part = shares.get((node.influence or "default").upper(), shares["default"])["head"]
    max_eyes, max_head = limits("eyes"), limits("head") if part > 0 else REST
    size = math.hypot(yaw, pitch)
    wanted = _of_head(yaw, part, size, max_eyes[0]), _of_head(pitch, part, size, max_eyes[1])
    head = limited(wanted, max_head)
    return GazeAngles(
        eyes=limited((yaw - head[0], pitch - head[1]), max_eyes),
        head=head,
        first=limited((yaw, pitch), max_eyes),
        away=limited((-head[0], -head[1]), max_eyes),
        inward=inward,
    )


def _of_head(angle: float, part: float, size: float, eyes: float) -> float:
    """Return the angle by which the head turns: its part, and the rest beyond the limit of the eyes."""
    head = angle * part * size / (size + facts()["head"]["small"])
    return angle - math.copysign(eyes, angle) if abs(angle - head) > eyes else head


def timing(node: Gaze | GazeShift, context: PlanningContext) -> Timing:
    return timing_from_table("gaze" if isinstance(node, Gaze) else "gazeShift", node.influence or "")


def expand(node: Gaze, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels that reach the target at ready and leave it at relax.

    They mask the base gaze of eyes and head; with the influence EYES, of the eyes only.
    """
    start, ready, relax, end = times.tolist()
    to = split_angle(node, context)
    reached, back = start + _lead(ready - start), relax + _lead(end - relax)
    keys = np.array([start, reached, ready, relax, back, end])
    eyes = [REST, to.first, to.eyes, to.eyes, to.away, REST]
    head = [REST, REST, to.head, to.head, to.head, REST]
    masks = {"eyes": EYES_MASK}
    if (node.influence or "").upper() != "EYES":
        masks["head"] = HEAD_MASK
    return (
        *turn("eyes", keys, eyes, layer=Layer.GAZE, source=node.id),
        *turn("head", keys, head, layer=Layer.GAZE, source=node.id),
        *_converge(keys, to.inward, Layer.GAZE, node.id),
        *(
            Channel(mask_channel(region), keys, values, layer=Layer.GAZE, source=node.id)
            for region, values in masks.items()
        ),
    )


def expand_shift(node: GazeShift, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels that reach the target at end, and stay."""
    start, end = times.tolist()
    to = split_angle(node, context)
    keys = np.array([start, start + _lead(end - start), end])
    return (
        *turn("eyes", keys, [REST, to.first, to.eyes], layer=Layer.BASE, holds=True, source=node.id),
        *turn("head", keys, [REST, REST, to.head], layer=Layer.BASE, holds=True, source=node.id),
        *_converge(keys, to.inward, Layer.BASE, node.id, holds=True),
    )


def _lead(length: float) -> float:
    """Return the seconds by which the eyes precede the head in a turn of this length, at most half of it."""
    return min(float(facts()["eyes"]["lead"]), length / 2)


def _converge(
    times: Float64, inward: float, layer: Layer, source: str, holds: bool = False
) -> tuple[Channel, ...]:
    """Return channels of AU66, by which both eyes turn inwards, at the first keys of a gaze or at all."""
    if not inward:
        return ()
    values = min(inward / tables.by_number()[66].degrees, 1.0) * EYES_MASK[: len(times)]
    return (Channel(au(66)[0], times, values, layer=layer, keeps_last=holds, source=source),)


# A temporary gaze does not claim the base gaze.
KINDS = (
    BehaviourKind(Gaze, timing, expand, check_target, claims=claiming("gaze")),
    BehaviourKind(GazeShift, timing, expand_shift, check_target, claims=claiming("base gaze"), region="eyes"),
)
