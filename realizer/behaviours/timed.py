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
from realizer.scheduling.timing import Timing

# 1/s^2; a stated duration is stiffer than the gaps of the table, but for a blink's.
STATED = 1000.0


def wait_timing(node: Wait, context: PlanningContext) -> Timing:
    """Return the `duration`; without one, the default, which references can stretch."""
    wanted = timing_from_table("wait")
    if not node.duration:
        return wanted
    return replace(wanted, preferred=np.array([node.duration]), stiffness=np.array([STATED]))


BODY = (Gesture, Pointing, Posture, PostureShift, Locomotion)
COMMANDS = (Interrupt, Activate, ParameterValueChange)
KINDS = (
    BehaviourKind(Wait, wait_timing),
    *(BehaviourKind(node, table_timing(local(node.tag))) for node in BODY),
    *(BehaviourKind(node, table_timing(local(node.tag)), command=lambda node: node) for node in COMMANDS),
)
