"""Removal of behaviours from a block, with everything that refers to them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import NamedTuple

from bml_schema.behaviours import Speech, SpeechText, Sync
from bml_schema.nodes import Behaviour, Block, Constraint, Required, Synchronize
from bml_schema.sync_refs import SyncRef


class ReducedBlock(NamedTuple):
    """A block without some of its behaviours.

    Attributes:
        block: the rest; its places and problems are those of the original.
        lost_references: id of a removed behaviour -> the references and constraints that were removed with
            it: "behaviour:sync", or the id or path of a constraint.
        fatal: ids of removed behaviours that a constraint inside <required> names.
    """

    block: Block
    lost_references: Mapping[str, tuple[str, ...]]
    fatal: frozenset[str]


def without(block: Block, gone: Collection[str]) -> ReducedBlock:
    """Return a block without some behaviours, the references to their sync points, and their constraints.

    Args:
        block: is not changed.
        gone: ids of behaviours. For an id that the block does not have, references to it are removed.
    """
    gone = frozenset(gone)
    losses = ReferenceRemover(gone)
    children: list[Behaviour | Required | Constraint] = []
    for child in block.children:
        if isinstance(child, Required):
            inside = (losses.without(c, required=True) for c in child.children)
            children.append(replace(child, children=tuple(c for c in inside if c is not None)))
        elif (left := losses.without(child)) is not None:
            children.append(left)
    lost = {id: tuple(names) for id, names in losses.lost_references.items()}
    return ReducedBlock(replace(block, children=tuple(children)), lost, frozenset(losses.fatal))


class ReferenceRemover:
    """Removes references to dropped behaviours; collects `lost_references` and `fatal` as in ReducedBlock."""

    def __init__(self, gone: Collection[str]) -> None:
        self.gone = gone
        self.lost_references: dict[str, list[str]] = {}
        self.fatal: set[str] = set()

    def without(
        self, node: Behaviour | Constraint, *, required: bool = False
    ) -> Behaviour | Constraint | None:
        """Return a node without references to dropped behaviours, or None if the node itself goes."""
        if isinstance(node, Constraint):
            return self._constraint(node, required or node.required)
        return None if node.id in self.gone else self._behaviour(node)

    def _is_gone(self, ref: SyncRef, name: str) -> bool:
        if ref.block is not None or ref.behaviour not in self.gone or ref.behaviour is None:
            return False
        names = self.lost_references.setdefault(ref.behaviour, [])
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

    def _constraint(self, node: Constraint, required: bool) -> Constraint | None:
        name = node.id or (node.place.path if node.place else "constraint")
        refs = [ref for part in node.parts for ref in part.refs]
        refs += [part.ref for part in node.parts if not isinstance(part, Synchronize)]
        gone = {ref.behaviour for ref in refs if self._is_gone(ref, name) and ref.behaviour}
        if required:
            self.fatal |= gone
        return None if gone else node
