"""gesture, pointing, posture, postureShift, locomotion: timed and reported, not shown on a face."""

from __future__ import annotations

from typing import Any

from bml_schema import Gesture, Locomotion, Pointing, Posture, PostureShift
from realizer.animation.channel import Channel
from realizer.behaviours.kind import Kind, World
from realizer.behaviours.table_timing import preferred
from realizer.core.array_types import Float64
from realizer.scheduling.timing import Timing


def _kind(node_class: type[Any], element: str) -> Kind:
    def timing(node: Any, world: World) -> Timing:
        return preferred(element)

    return Kind(node_class, timing, nothing)


def nothing(node: Any, times: Float64, world: World) -> tuple[Channel, ...]:
    """A face shows nothing of it."""
    return ()


KINDS = (
    _kind(Gesture, "gesture"),
    _kind(Pointing, "pointing"),
    _kind(Posture, "posture"),
    _kind(PostureShift, "postureShift"),
    _kind(Locomotion, "locomotion"),
)
