"""interrupt, activate, parametervaluechange: behaviours that act on other blocks."""

from __future__ import annotations

from bml_schema import Activate, Interrupt, ParameterValueChange
from realizer.animation.channel import Channel
from realizer.behaviours import kind
from realizer.behaviours.kind import BehaviourKind, PlanningContext
from realizer.behaviours.table_timing import timing_from_table
from realizer.core.array_types import Float64
from realizer.scheduling.timing import Timing


def timing_of_interrupt(node: Interrupt, context: PlanningContext) -> Timing:
    return timing_from_table("interrupt")


def timing_of_activate(node: Activate, context: PlanningContext) -> Timing:
    return timing_from_table("activate")


def timing_of_change(node: ParameterValueChange, context: PlanningContext) -> Timing:
    """At once, or as long as its start and end say."""
    return timing_from_table("parametervaluechange")


def nothing(
    node: Interrupt | Activate | ParameterValueChange, times: Float64, context: PlanningContext
) -> tuple[Channel, ...]:
    return ()


def interrupt(node: Interrupt) -> kind.Interrupt:
    include = frozenset(node.include) if node.include else None
    return kind.Interrupt(node.target, include, frozenset(node.exclude))


def activate(node: Activate) -> kind.Activate:
    return kind.Activate(node.target)


def change(node: ParameterValueChange) -> kind.Change:
    """Return a linear change if the document gives an end and wants one, otherwise an instant one."""
    trajectory = node.trajectory
    assert trajectory is not None  # the parser requires one
    evenly = trajectory.type == "linear" and "end" in node.syncs
    block, behaviour = node.target
    return kind.Change(
        block,
        behaviour,
        node.param_id,
        trajectory.target_value,
        trajectory.initial_value,
        "linear" if evenly else None,
    )


KINDS = (
    BehaviourKind(Interrupt, timing_of_interrupt, nothing, command=interrupt),
    BehaviourKind(Activate, timing_of_activate, nothing, command=activate),
    BehaviourKind(ParameterValueChange, timing_of_change, nothing, command=change),
)
