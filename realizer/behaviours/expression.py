"""expression: an entry of the expression library as action units."""

from __future__ import annotations

from bml_schema import Expression
from realizer.animation.channel import Channel
from realizer.behaviours import pose_channels
from realizer.behaviours.kind import Fault, Kind, World
from realizer.behaviours.table_timing import from_gaps
from realizer.core.array_types import Float64
from realizer.scheduling.timing import Timing

POINTS = ("start", "attackPeak", "relax", "end")


def timing(node: Expression, world: World) -> Timing:
    """Onset, apex and offset of the library; a template's as it was measured."""
    return from_gaps(POINTS, world.library[node.name].gaps)


def expand(node: Expression, times: Float64, world: World) -> tuple[Channel, ...]:
    """There at attackPeak, held to relax, gone at end."""
    return pose_channels.shown(
        pose_channels.columns(world.library[node.name].aus, node.intensity), times, node.id
    )


def check(node: Expression, world: World) -> tuple[Fault, ...]:
    """An unknown name is fatal."""
    return () if node.name in world.library else (pose_channels.unknown("name", node.name, world.library),)


KINDS = (
    Kind(
        Expression,
        timing,
        expand,
        check,
        parameters={"intensity": "intensity", "amount": "intensity"},
    ),
)
