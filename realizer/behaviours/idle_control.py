"""idle: scales the blinks and small movements of a face."""

from __future__ import annotations

import numpy as np

from bml_schema import Idle
from realizer.animation.axis import mask_channel
from realizer.animation.channel import Channel, Layer
from realizer.animation.idle.blinks import BlinkReduction
from realizer.behaviours.kind import BehaviourKind, PlanningContext, claiming
from realizer.behaviours.table_timing import table_timing
from realizer.core.array_types import Float64


def expand(node: Idle, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels that reduce blinks and motion from start to end, and stay.

    Both channels exist even without a reduction: they replace an earlier one.
    """
    return tuple(
        channel(
            mask_channel(name),
            times,
            np.array([0.0, 1.0 - part]),
            layer=Layer.BASE,
            keeps_last=True,
            source=node.id,
        )
        for channel, name, part in ((BlinkReduction, "blinks", node.blinks), (Channel, "motion", node.motion))
    )


KINDS = (BehaviourKind(Idle, table_timing("idle"), expand, claims=claiming("idle face"), region="idle"),)
