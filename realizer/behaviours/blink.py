"""blink: a blink of both lids, or a wink."""

from __future__ import annotations

from bml_schema import Blink
from realizer.animation.channel import Channel
from realizer.behaviours import pose_channels
from realizer.behaviours.kind import BehaviourKind, PlanningContext
from realizer.behaviours.table_timing import table_timing
from realizer.core.array_types import Float64


def expand(node: Blink, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels of AU45, closed from attackPeak to relax."""
    return pose_channels.hold(pose_channels.columns({(45, node.side): 1.0}, node.amount), times, node.id)


KINDS = (BehaviourKind(Blink, table_timing("blink"), expand, parameters={"amount": "amount"}),)
