"""expression: an entry of the expression library as action units."""

from __future__ import annotations

from bml_schema import Expression
from bml_schema.behaviours import PEAK
from realizer.animation.channel import Channel
from realizer.behaviours import pose_channels
from realizer.behaviours.expressive_channels import express
from realizer.behaviours.kind import BehaviourKind, Fault, PlanningContext
from realizer.behaviours.table_timing import from_gaps
from realizer.core.array_types import Float64
from realizer.scheduling.timing import Timing


def timing(node: Expression, context: PlanningContext) -> Timing:
    """Return the onset, apex and offset of the library; those of templates were measured."""
    return from_gaps(PEAK, context.library[node.name].gaps)


def expand(node: Expression, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels with the expression from attackPeak to relax."""
    values = pose_channels.columns(context.library[node.name].aus, node.intensity)
    return express(pose_channels.hold(values, times, node.id), context)


def check(node: Expression, context: PlanningContext) -> tuple[Fault, ...]:
    """Return a fatal fault for an unknown name."""
    return (
        ()
        if node.name in context.library
        else (pose_channels.unknown_word("name", node.name, context.library),)
    )


KINDS = (
    BehaviourKind(
        Expression,
        timing,
        expand,
        check,
        parameters={"intensity": "intensity", "amount": "intensity"},
    ),
)
