"""gaze, gazeShift: the eyes lead, the head follows, and the eyes turn back by as much."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bml_schema import Gaze, GazeShift
from realizer import tables
from realizer.animation.axis import au, mask_channel
from realizer.animation.channel import Channel, Layer
from realizer.behaviours.gaze_targets import Turn, angles, facts, limited, limits, target_faults, turn
from realizer.behaviours.kind import BehaviourKind, Fault, PlanningContext
from realizer.behaviours.table_timing import timing_from_table
from realizer.core.array_types import Float64
from realizer.scheduling.timing import Timing

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


REST: Turn = (0.0, 0.0)
# How far a gaze takes eyes and head, at its keys: start, the eyes there, ready, relax, the eyes back, end.
EYES_TAKEN = np.array([0.0, 1.0, 1.0, 1.0, 0.0, 0.0])
HEAD_TAKEN = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 0.0])


class GazeAngles(NamedTuple):
    """Where a gaze ends.

    Attributes:
        eyes: in the head.
        head: by as much it turns.
        first: as far as the eyes get before the head follows.
        away: where the eyes are when they have turned back and the head has not yet.
        inward: degrees that each eye turns in.
    """

    eyes: Turn
    head: Turn
    first: Turn
    away: Turn
    inward: float


def split_angle(node: Gaze | GazeShift, context: PlanningContext) -> GazeAngles:
    """How eyes and head share the angle: the head its part by influence, but little of a small angle; the
    eyes the rest as far as they turn, and the head again what is left.
    """
    yaw, pitch, inward = angles(node.target, context)
    left, up = DIRECTIONS[node.offset_direction]
    # Behind is behind on the nearer side.
    yaw = (yaw + node.offset_angle * left + 180.0) % 360.0 - 180.0
    pitch = max(-90.0, min(90.0, pitch + node.offset_angle * up))
    shares = facts()["influence"]
    part = shares.get((node.influence or "default").upper(), shares["default"])["head"]
    eyes_most, head_most = limits("eyes"), limits("head") if part > 0 else REST
    size = math.hypot(yaw, pitch)
    asked = _of_head(yaw, part, size, eyes_most[0]), _of_head(pitch, part, size, eyes_most[1])
    head = limited(asked, head_most)
    return GazeAngles(
        eyes=limited((yaw - head[0], pitch - head[1]), eyes_most),
        head=head,
        first=limited((yaw, pitch), eyes_most),
        away=limited((-head[0], -head[1]), eyes_most),
        inward=inward,
    )


def _of_head(angle: float, part: float, size: float, eyes: float) -> float:
    """What the head turns of an angle: its part, and what is left where the eyes turn no farther."""
    head = angle * part * size / (size + facts()["head"]["small"])
    return angle - math.copysign(eyes, angle) if abs(angle - head) > eyes else head


def timing(node: Gaze, context: PlanningContext) -> Timing:
    return timing_from_table("gaze", node.influence or "")


def timing_of_shift(node: GazeShift, context: PlanningContext) -> Timing:
    return timing_from_table("gazeShift", node.influence or "")


def expand(node: Gaze, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """There from start to ready, held to relax, back at end. While it lasts it takes eyes and head from the
    base gaze; EYES takes the eyes only.
    """
    start, ready, relax, end = times.tolist()
    to = split_angle(node, context)
    there, back = start + _lead(ready - start), relax + _lead(end - relax)
    keys = np.array([start, there, ready, relax, back, end])
    eyes = [REST, to.first, to.eyes, to.eyes, to.away, REST]
    head = [REST, REST, to.head, to.head, to.head, REST]
    taken = {"eyes": EYES_TAKEN}
    if (node.influence or "").upper() != "EYES":
        taken["head"] = HEAD_TAKEN
    return (
        *turn("eyes", keys, eyes, layer=Layer.GAZE, source=node.id),
        *turn("head", keys, head, layer=Layer.GAZE, source=node.id),
        *_converge(keys, to.inward, Layer.GAZE, node.id),
        *(
            Channel(mask_channel(region), keys, values, layer=Layer.GAZE, source=node.id)
            for region, values in taken.items()
        ),
    )


def expand_shift(node: GazeShift, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """There from start to end, and from then on."""
    start, end = times.tolist()
    to = split_angle(node, context)
    keys = np.array([start, start + _lead(end - start), end])
    return (
        *turn("eyes", keys, [REST, to.first, to.eyes], layer=Layer.BASE, holds=True, source=node.id),
        *turn("head", keys, [REST, REST, to.head], layer=Layer.BASE, holds=True, source=node.id),
        *_converge(keys, to.inward, Layer.BASE, node.id, holds=True),
    )


def check(node: Gaze | GazeShift, context: PlanningContext) -> tuple[Fault, ...]:
    return target_faults(node.target, context)


def _lead(length: float) -> float:
    """Seconds by which the eyes lead in a turn of this length: at most half of it."""
    return min(float(facts()["eyes"]["lead"]), length / 2)


def _converge(
    times: Float64, inward: float, layer: Layer, source: str, holds: bool = False
) -> tuple[Channel, ...]:
    """AU66 for eyes that turn in by so many degrees each, at the first keys of a gaze or all."""
    if not inward:
        return ()
    values = min(inward / tables.by_number()[66].degrees, 1.0) * EYES_TAKEN[: len(times)]
    return (Channel(au(66)[0], times, values, layer=layer, keeps_last=holds, source=source),)


def claims(node: Gaze, context: PlanningContext) -> frozenset[str]:
    """Every influence takes the eyes: one cannot look at two things."""
    return frozenset({"gaze"})


def claims_of_shift(node: GazeShift, context: PlanningContext) -> frozenset[str]:
    """A base state can change to one other at a time; a temporary gaze does not mind."""
    return frozenset({"base gaze"})


KINDS = (
    BehaviourKind(Gaze, timing, expand, check, claims=claims),
    BehaviourKind(GazeShift, timing_of_shift, expand_shift, check, claims=claims_of_shift, region="eyes"),
)
