"""wait: a pause that other behaviours can refer to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bml_schema import Wait
from realizer.behaviours.kind import BehaviourKind, PlanningContext
from realizer.behaviours.table_timing import timing_from_table
from realizer.scheduling.timing import Timing

# 1/s^2; a stated duration is stiffer than the gaps of the table, but for a blink's.
STATED = 1000.0


def timing(node: Wait, context: PlanningContext) -> Timing:
    """Return the `duration`; without one, the default, which references can stretch."""
    wanted = timing_from_table("wait")
    if not node.duration:
        return wanted
    return replace(wanted, preferred=np.array([node.duration]), stiffness=np.array([STATED]))


KINDS = (BehaviourKind(Wait, timing),)
