"""The registry of behaviours: one row for each module with behaviour elements."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from realizer.behaviours.kind import BehaviourKind
from realizer.core.registry import Registry


def _is_family(value: Any) -> bool:
    return isinstance(value, tuple) and all(isinstance(kind, BehaviourKind) for kind in value)


FAMILIES: Registry[tuple[BehaviourKind, ...]] = Registry(
    "realizer.behaviours",
    {
        "face": "realizer.behaviours.face:KINDS",
        "gaze": "realizer.behaviours.gaze:KINDS",
        "head": "realizer.behaviours.head:KINDS",
        "speech": "realizer.behaviours.speech:KINDS",
        "wait": "realizer.behaviours.wait:KINDS",
        "body": "realizer.behaviours.body:KINDS",
        "emotion": "realizer.behaviours.emotion:KINDS",
        "expression": "realizer.behaviours.expression:KINDS",
        "fap_values": "realizer.behaviours.fap_values:KINDS",
        "timeline": "realizer.behaviours.timeline:KINDS",
        "keyframes": "realizer.behaviours.keyframes:KINDS",
        "blink": "realizer.behaviours.blink:KINDS",
        "idle_control": "realizer.behaviours.idle_control:KINDS",
        "listen": "realizer.behaviours.listen:KINDS",
        "audio": "realizer.behaviours.audio:KINDS",
        "block_control": "realizer.behaviours.block_control:KINDS",
    },
    wanted="a tuple of realizer.behaviours.kind.BehaviourKind",
    accepts=_is_family,
)


def _kinds() -> Mapping[str, BehaviourKind]:
    kinds: dict[str, BehaviourKind] = {}
    for _, family in FAMILIES.working():
        for kind in family:
            kinds.setdefault(kind.tag, kind)  # the first counts: a plug-in cannot replace our elements
    return MappingProxyType(kinds)


# Clark tag of an element -> its BehaviourKind, and -> its node class for the parser.
KINDS: Mapping[str, BehaviourKind] = _kinds()
VOCABULARY: Mapping[str, type[Any]] = MappingProxyType({tag: kind.node for tag, kind in KINDS.items()})
