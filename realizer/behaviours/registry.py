"""The registry of behaviours: a row for each module with behaviour elements, and those of plug-ins."""

import logging
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from bml_schema import VOCABULARY as SCHEMA
from bml_schema.node_schema import local
from realizer.behaviours.kind import BehaviourKind, Fault, PlanningContext
from realizer.core.array_types import Float64
from realizer.core.registry import Registry

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


# Family, a module of this package -> its elements. It is imported when one of them is first used, or at once
# if their node classes are not in bml_schema.
ELEMENTS = {
    "face": "faceLexeme faceFacs face faceShift expression blink blinkemitter",
    "gaze": "gaze gazeShift",
    "head": "head headDirectionShift",
    "speech": "speech",
    "emotion": "emotion mood",
    "fap_values": "faps fapFile",
    "timeline": "timeline",
    "keyframes": "facekeyframe",
    "idle_control": "idle",
    "listen": "listen",
    "audio": "audiofile",
    "timed": "wait gesture pointing posture postureShift locomotion interrupt activate parametervaluechange",
}
FAMILIES: Registry[tuple[BehaviourKind, ...]] = Registry(
    "realizer.behaviours",
    {name: f"realizer.behaviours.{name}:KINDS" for name in ELEMENTS},
    wanted="a tuple of realizer.behaviours.kind.BehaviourKind",
    accepts=lambda v: isinstance(v, tuple) and all(isinstance(kind, BehaviourKind) for kind in v),
)


class _Kinds(Mapping[str, BehaviourKind]):
    """Clark tag of an element -> its BehaviourKind. A plug-in cannot replace our elements."""

    def __init__(self) -> None:
        self._kinds: dict[str, BehaviourKind] = {}
        self._families: dict[str, str] = {}  # tag -> its family, which is imported on first use

    def _find_all(self) -> None:
        """Find the families at the first use: a plug-in may import what imports this module."""
        if self._families:
            return
        tags = {local(tag): tag for tag in SCHEMA}
        known = {name: [tags[e] for e in words.split() if e in tags] for name, words in ELEMENTS.items()}
        whole = [name for name, words in ELEMENTS.items() if len(known[name]) == len(words.split())]
        self._families = {tag: name for name in whole for tag in known[name]}
        for name in FAMILIES:
            if name not in whole:
                self._import(name)

    def _import(self, name: str) -> None:
        for _, family in FAMILIES.working([name]):
            for kind in family:
                if self._families.get(kind.tag, name) == name:
                    self._kinds.setdefault(kind.tag, kind if name in ELEMENTS else guarded(kind, name))

    def __getitem__(self, tag: str) -> BehaviourKind:
        self._find_all()
        if tag not in self._kinds and tag in self._families:
            self._import(self._families[tag])
        return self._kinds[tag]

    def __iter__(self) -> Iterator[str]:
        self._find_all()
        return iter({**self._families, **self._kinds})

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __contains__(self, tag: object) -> bool:  # without an import of its family
        self._find_all()
        return tag in self._families or tag in self._kinds


class _Vocabulary(Mapping[str, type[Any]]):
    """Clark tag of an element -> its node class, for the parser."""

    def __getitem__(self, tag: str) -> type[Any]:
        if tag in SCHEMA and tag in KINDS:
            return SCHEMA[tag]
        return KINDS[tag].node

    def __iter__(self) -> Iterator[str]:
        return iter(KINDS)

    def __len__(self) -> int:
        return len(KINDS)


KINDS: Mapping[str, BehaviourKind] = _Kinds()
VOCABULARY: Mapping[str, type[Any]] = _Vocabulary()
