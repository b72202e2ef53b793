"""The registry of behaviours: a row for each module with behaviour elements."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any

from bml_schema import VOCABULARY as SCHEMA
from bml_schema.node_schema import local
from realizer.behaviours.guarded import guarded
from realizer.behaviours.kind import BehaviourKind
from realizer.core.registry import Registry


def _is_family(value: Any) -> bool:
    return isinstance(value, tuple) and all(isinstance(kind, BehaviourKind) for kind in value)


# Family, a module of this package -> its elements. It is imported when one of them is first used, or at once
# if their node classes are not in bml_schema.
ELEMENTS = {
    "face": "faceLexeme faceFacs face faceShift",
    "gaze": "gaze gazeShift",
    "head": "head headDirectionShift",
    "speech": "speech",
    "wait": "wait",
    "body": "gesture pointing posture postureShift locomotion",
    "emotion": "emotion mood",
    "expression": "expression",
    "fap_values": "faps fapFile",
    "timeline": "timeline",
    "keyframes": "facekeyframe",
    "blink": "blink",
    "idle_control": "idle",
    "listen": "listen",
    "audio": "audiofile",
    "block_control": "interrupt activate parametervaluechange",
}
FAMILIES: Registry[tuple[BehaviourKind, ...]] = Registry(
    "realizer.behaviours",
    {name: f"realizer.behaviours.{name}:KINDS" for name in ELEMENTS},
    wanted="a tuple of realizer.behaviours.kind.BehaviourKind",
    accepts=_is_family,
)


class _Kinds(Mapping[str, BehaviourKind]):
    """Clark tag of an element -> its BehaviourKind. A plug-in cannot replace our elements."""

    def __init__(self) -> None:
        tags = {local(tag): tag for tag in SCHEMA}
        self._kinds: dict[str, BehaviourKind] = {}
        self._families: dict[str, str] = {}  # tag -> its family, which is imported on first use
        for name in FAMILIES:
            elements = ELEMENTS.get(name, "").split()
            if elements and tags.keys() >= set(elements):
                self._families |= dict.fromkeys([tags[element] for element in elements], name)
            else:
                self._import(name)

    def _import(self, name: str) -> None:
        for _, family in FAMILIES.working([name]):
            for kind in family:
                if self._families.get(kind.tag, name) == name:
                    self._kinds.setdefault(kind.tag, kind if name in ELEMENTS else guarded(kind, name))

    def __getitem__(self, tag: str) -> BehaviourKind:
        if tag not in self._kinds and tag in self._families:
            self._import(self._families[tag])
        return self._kinds[tag]

    def __iter__(self) -> Iterator[str]:
        return iter({**self._families, **self._kinds})

    def __len__(self) -> int:
        return len({**self._families, **self._kinds})

    def __contains__(self, tag: object) -> bool:  # without an import
        return tag in self._families or tag in self._kinds


KINDS: Mapping[str, BehaviourKind] = _Kinds()
# Clark tag of an element -> its node class, for the parser.
VOCABULARY: Mapping[str, type[Any]] = MappingProxyType(
    {tag: SCHEMA[tag] if tag in SCHEMA else KINDS[tag].node for tag in KINDS}
)
