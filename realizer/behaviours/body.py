"""gesture, pointing, posture, postureShift, locomotion: timed and reported, not shown on a face."""

from __future__ import annotations

from typing import Any

from bml_schema import Gesture, Locomotion, Pointing, Posture, PostureShift
from realizer.animation.channel import Channel
from realizer.behaviours.kind import BehaviourKind, PlanningContext
from realizer.behaviours.table_timing import timing_from_table
from realizer.core.array_types import Float64
from realizer.scheduling.timing import Timing


def _kind(node_class: type[Any], element: str) -> BehaviourKind:
    def timing(node: Any, context: PlanningContext) -> Timing:
        return timing_from_table(element)

    return BehaviourKind(node_class, timing, nothing)


def nothing(node: Any, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return no channels: the face does not move."""
    return ()


KINDS = (
    _kind(Gesture, "gesture"),
    _kind(Pointing, "pointing"),
    _kind(Posture, "posture"),
    _kind(PostureShift, "postureShift"),
    _kind(Locomotion, "locomotion"),
)
