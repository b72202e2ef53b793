"""interrupt, activate, parametervaluechange: behaviours that act on other blocks."""

from __future__ import annotations

from bml_schema import Activate, Interrupt, ParameterValueChange
from realizer.behaviours.kind import BehaviourKind
from realizer.behaviours.table_timing import table_timing

KINDS = (
    BehaviourKind(Interrupt, table_timing("interrupt"), command=lambda node: node),
    BehaviourKind(Activate, table_timing("activate"), command=lambda node: node),
    BehaviourKind(ParameterValueChange, table_timing("parametervaluechange"), command=lambda node: node),
)
