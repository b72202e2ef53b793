"""Ids of dropped behaviours and a node in, the node without references to them out; notes what went."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from bml_schema.behaviours import Speech, SpeechText, Sync
from bml_schema.nodes import Behaviour, Constraint, Synchronize
from bml_schema.sync_refs import SyncRef

__all__: list[str] = []


class Losses:
    """What vanishes with dropped behaviours.

    Attributes:
        lost: id of the dropped behaviour -> "behaviour:sync" of references, ids or paths of constraints.
        fatal: ids whose loss breaks a required constraint.
    """

    def __init__(self, gone: Collection[str]) -> None:
        self.gone = gone
        self.lost: dict[str, list[str]] = {}
        self.fatal: set[str] = set()

    def without(self, node: Behaviour | Constraint) -> Behaviour | Constraint | None:
        """The node without references to what is gone; None for a constraint that names it."""
        return self._constraint(node) if isinstance(node, Constraint) else self._behaviour(node)

    def _is_gone(self, ref: SyncRef, name: str) -> bool:
        if ref.block is not None or ref.behaviour not in self.gone or ref.behaviour is None:
            return False
        names = self.lost.setdefault(ref.behaviour, [])
        if name not in names[-1:]:
            names.append(name)
        return True

    def _behaviour(self, node: Behaviour) -> Behaviour:
        syncs = {p: ref for p, ref in node.syncs.items() if not self._is_gone(ref, f"{node.id}:{p}")}
        if len(syncs) < len(node.syncs):
            node = replace(node, syncs=syncs)
        if isinstance(node, Speech) and node.text is not None:
            parts = tuple(
                Sync(id=p.id)
                if isinstance(p, Sync) and p.ref is not None and self._is_gone(p.ref, f"{node.id}:{p.id}")
                else p
                for p in node.text.parts
            )
            if parts != node.text.parts:
                node = replace(node, text=SpeechText(parts=parts))
        return node

    def _constraint(self, node: Constraint) -> Constraint | None:
        name = node.id or (node.place.path if node.place else "constraint")
        refs = [ref for part in node.parts for ref in part.refs]
        refs += [part.ref for part in node.parts if not isinstance(part, Synchronize)]
        gone = {ref.behaviour for ref in refs if self._is_gone(ref, name) and ref.behaviour}
        if node.required:
            self.fatal |= gone
        return None if gone else node
