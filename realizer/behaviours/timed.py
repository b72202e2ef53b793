"""Elements that are timed and reported, but not shown on a face.

gesture, pointing, posture, postureShift, locomotion; wait, a pause that other behaviours can refer to;
interrupt, activate, parametervaluechange, which act on other blocks.
"""

from dataclasses import replace

import numpy as np

from bml_schema import (
    Activate,
    Gesture,
    Interrupt,
    Locomotion,
    ParameterValueChange,
    Pointing,
    Posture,
    PostureShift,
    Wait,
)
from bml_schema.node_schema import local
from realizer.behaviours.kind import BehaviourKind, PlanningContext, table_timing, timing_from_table
from realizer.core.array_types import Float64
from realizer.scheduling.timing import Timing

# 1/s^2; a stated duration is stiffer than the gaps of the table, but for a blink's.
STATED = 1000.0
NOTICED = 0.005  # s; a smaller difference from the duration is no fault


def wait_timing(node: Wait, context: PlanningContext) -> Timing:
    """Return the `duration`; without one, the default, which references can stretch."""
    wanted = timing_from_table("wait")
    if not node.duration:
        return wanted
    return replace(wanted, preferred=np.array([node.duration]), stiffness=np.array([STATED]))


def review_wait(node: Wait, times: Float64) -> str:
    """Return how much longer or shorter than its `duration` a wait with three stated times is, or ""."""
    start, end = node.syncs.get("start"), node.syncs.get("end")
    more = float(times[-1] - times[0]) - node.duration
    if not node.duration or start is None or end is None or abs(more) < NOTICED:
        return ""
    # Between two behaviours that can both move, a wait is a wish among others.
    if end.behaviour != node.id and replace(end, offset=start.offset) != start:
        return ""
    say = f"it is {abs(more):.3g} s {'longer' if more > 0 else 'shorter'}, as its start and end are given"
    return f"duration: wanted {node.duration:g} s; {say}"


BODY = (Gesture, Pointing, Posture, PostureShift, Locomotion)
COMMANDS = (Interrupt, Activate, ParameterValueChange)
KINDS = (
    BehaviourKind(Wait, wait_timing, review=review_wait),
    *(BehaviourKind(node, table_timing(local(node.tag))) for node in BODY),
    *(BehaviourKind(node, table_timing(local(node.tag)), command=lambda node: node) for node in COMMANDS),
)
