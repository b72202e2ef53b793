"""Behaviours of plug-ins, whose exceptions become warnings."""

from __future__ import annotations

import logging
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from realizer.behaviours.kind import BehaviourKind, Fault, PlanningContext
from realizer.core.array_types import Float64

log = logging.getLogger(__name__)
_warn = cache(log.warning)  # each text once


def guarded(kind: BehaviourKind, plugin: str) -> BehaviourKind:
    """Return a behaviour of a plug-in that plays as before; where its functions fail, it is dropped.

    Its timing and its channels are tried when it is checked, so that a failure is one warning about the
    behaviour. What fails only later is a warning in the log.
    """

    def words(error: Exception) -> str:
        return f"the plug-in {plugin} failed: {type(error).__name__}: {error}"

    def check(node: Any, context: PlanningContext) -> tuple[Fault, ...]:
        try:
            faults = tuple(kind.check(node, context))
            if kind.speech_request is None and not any(fault.fatal for fault in faults):
                gaps = kind.timing(node, context).preferred
                kind.claims(node, context)
                kind.expand(node, np.concatenate([[0.0], np.cumsum(gaps)]), context)
        except Exception as error:
            return (Fault("CANNOT_CREATE_BEHAVIOR", words(error)),)
        return faults

    def expand(node: Any, times: Float64, context: PlanningContext) -> tuple[Any, ...]:
        try:
            return kind.expand(node, times, context)
        except Exception as error:
            _warn(words(error))
            return ()

    return replace(kind, check=check, expand=expand)
