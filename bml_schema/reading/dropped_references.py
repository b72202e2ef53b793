"""Removal of behaviours from a block, with everything that refers to them."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from bml_schema.behaviours import Speech
from bml_schema.nodes import Behaviour, Block, Constraint
from bml_schema.steps import next_element
from bml_schema.sync_refs import SyncRef


class ReducedBlock(NamedTuple):
    """A block without some of its behaviours."""

    block: Block  # the rest; its places and problems are those of the original
    # Id of a removed behaviour -> the references and constraints that were removed with it: "behaviour:sync",
    # or the id or path of a constraint.
    lost_references: Mapping[str, tuple[str, ...]]
    fatal: frozenset[str]  # ids of removed behaviours that a constraint inside <required> names


def without(block: Block, gone: Collection[str]) -> ReducedBlock:
    """Return a block without some behaviours, the references to their sync points, and their constraints.

    References to ids that the block does not have are removed, too.
    """
    gone = frozenset(gone)
    remover = ReferenceRemover(gone)
    rest = block.with_children(remover.without)
    lost = {id: tuple(names) for id, names in remover.lost_references.items()}
    return ReducedBlock(rest, lost, frozenset(remover.fatal))


def without_constraints(block: Block, gone: Sequence[Constraint]) -> Block:
    """Return a block without some of its own constraints."""
    if not gone:
        return block
    return block.with_children(lambda node, _: None if any(node is lost for lost in gone) else node)


def without_references(block: Block, points: Collection[str]) -> Block:
    """Return a block without the references of some of its sync points, "behaviour:sync"."""
    if not points:
        return block

    def without_those(node: Behaviour | Constraint, _: bool) -> Behaviour | Constraint:
        if isinstance(node, Constraint):
            return node
        return _without_points(
            node, {point for point, _ in node.references if f"{node.id}:{point}" in points}
        )

    return block.with_children(without_those)


def _without_points(node: Behaviour, lost: Collection[str]) -> Behaviour:
    if not lost:
        return node
    if isinstance(node, Speech):
        node = node.with_references(lambda sync: None if sync.id in lost else sync.ref)
    return replace(node, syncs={p: ref for p, ref in node.syncs.items() if p not in lost})


class ReferenceRemover:
    """Removes references to dropped behaviours; collects `lost_references` and `fatal` as in ReducedBlock."""

    def __init__(self, gone: Collection[str]) -> None:
        self.gone = gone
        self.lost_references: dict[str, list[str]] = {}
        self.fatal: set[str] = set()

    def without(self, node: Behaviour | Constraint, required: bool = False) -> Behaviour | Constraint | None:
        """Return a node without references to dropped behaviours, or None if the node itself goes."""
        next_element()
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
        lost = {point for point, ref in node.references if self._is_gone(ref, f"{node.id}:{point}")}
        return _without_points(node, lost)

    def _constraint(self, node: Constraint, required: bool) -> Constraint | None:
        name = node.id or (node.place.path if node.place else "constraint")
        gone = {ref.behaviour for ref in node.references if self._is_gone(ref, name) and ref.behaviour}
        if required:
            self.fatal |= gone
        return None if gone else node
