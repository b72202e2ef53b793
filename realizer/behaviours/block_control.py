"""interrupt, activate, parametervaluechange: behaviours that act on other blocks."""

from __future__ import annotations

from bml_schema import Activate, Interrupt, ParameterValueChange
from realizer.behaviours import kind
from realizer.behaviours.kind import BehaviourKind
from realizer.behaviours.table_timing import table_timing


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
    BehaviourKind(Interrupt, table_timing("interrupt"), command=interrupt),
    BehaviourKind(Activate, table_timing("activate"), command=activate),
    BehaviourKind(ParameterValueChange, table_timing("parametervaluechange"), command=change),
)
