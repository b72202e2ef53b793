"""idle: scales the blinks and small movements of a face, and chooses where its eyes look."""

import numpy as np

from bml_schema import Idle
from realizer.animation.axis import mask_channel
from realizer.animation.channel import Channel, Layer
from realizer.animation.idle.blinks import OnsetMask
from realizer.behaviours.kind import BehaviourKind, PlanningContext, claiming, table_timing
from realizer.core.array_types import Float64


def expand(node: Idle, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels that mask parts of the idle motion from start to end, and stay.

    All exist even if they mask nothing: they replace earlier ones.
    """
    masks: list[tuple[type[Channel], str, float]] = [
        (OnsetMask, "blinks", 1.0 - node.blinks),
        (Channel, "motion", 1.0 - node.motion),
        (Channel, "life", 1.0 - node.liveliness),
        *((OnsetMask, name, float(node.eyes == name.upper())) for name in ("listening", "thinking")),
    ]
    return tuple(
        channel(
            mask_channel(name),
            times,
            np.array([0.0, masked]),
            layer=Layer.BASE,
            keeps_last=True,
            source=node.id,
        )
        for channel, name, masked in masks
    )


KINDS = (BehaviourKind(Idle, table_timing("idle"), expand, claims=claiming("idle face"), region="idle"),)
