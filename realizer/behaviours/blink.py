"""blink: a blink of both lids, or a wink."""

from __future__ import annotations

from bml_schema import Blink
from realizer.animation.channel import Channel
from realizer.behaviours import pose_channels
from realizer.behaviours.kind import BehaviourKind, PlanningContext
from realizer.behaviours.table_timing import timing_from_table
from realizer.core.array_types import Float64
from realizer.scheduling.timing import Timing


def timing(node: Blink, context: PlanningContext) -> Timing:
    return timing_from_table("blink")


def expand(node: Blink, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels of AU45, closed from attackPeak to relax."""
    return pose_channels.hold(pose_channels.columns({(45, node.side): 1.0}, node.amount), times, node.id)


KINDS = (BehaviourKind(Blink, timing, expand, parameters={"amount": "amount"}),)
