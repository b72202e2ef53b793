"""The behaviours: kinds of all families, and the vocabulary of the parser."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from realizer.behaviours import (
    audio,
    blink,
    block_control,
    body,
    emotion,
    expression,
    face,
    fap_values,
    gaze,
    head,
    idle_control,
    keyframes,
    speech,
    timeline,
    wait,
)
from realizer.behaviours.kind import Kind

__all__ = ["KINDS", "MODULES", "VOCABULARY"]

MODULES = (
    face,
    gaze,
    head,
    speech,
    wait,
    body,
    emotion,
    expression,
    fap_values,
    timeline,
    keyframes,
    blink,
    idle_control,
    audio,
    block_control,
)

# Clark tag of an element -> what it brings; -> the class a parser makes of it.
KINDS: Mapping[str, Kind] = MappingProxyType({kind.tag: kind for module in MODULES for kind in module.KINDS})
VOCABULARY: Mapping[str, type[Any]] = MappingProxyType({tag: kind.node for tag, kind in KINDS.items()})
