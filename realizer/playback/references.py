"""The sync references of a block: collection and replacement."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from bml_schema import Behaviour, Block, Constraint, Required, Speech, Sync, Synchronize, SyncRef


def external_refs(block: Block) -> tuple[SyncRef, ...]:
    """Return the references into other blocks."""
    return tuple(ref for ref in references(block) if ref.block is not None and ref.block != block.id)


def references(block: Block) -> Iterator[SyncRef]:
    """Yield the references of its behaviours, of syncs in their text, and of its constraints."""
    for behaviour in block.behaviours:
        yield from behaviour.syncs.values()
        if isinstance(behaviour, Speech) and behaviour.text is not None:
            for piece in behaviour.text.parts:
                if not isinstance(piece, str) and piece.ref is not None:
                    yield piece.ref
    for constraint in block.constraints:
        for part in constraint.parts:
            yield from part.refs
            if not isinstance(part, Synchronize):
                yield part.ref


def with_references(block: Block, to: Callable[[SyncRef], SyncRef]) -> Block:
    """Return the block with each reference replaced by `to(reference)`."""

    def inside(node: Behaviour | Constraint) -> Behaviour | Constraint:
        if isinstance(node, Constraint):
            parts = (replace(part, refs=tuple(map(to, part.refs))) for part in node.parts)
            return replace(
                node,
                parts=tuple(p if isinstance(p, Synchronize) else replace(p, ref=to(p.ref)) for p in parts),
            )
        if isinstance(node, Speech) and node.text is not None:
            said = (
                replace(p, ref=to(p.ref)) if isinstance(p, Sync) and p.ref is not None else p
                for p in node.text.parts
            )
            node = replace(node, text=replace(node.text, parts=tuple(said)))
        return replace(node, syncs={point: to(ref) for point, ref in node.syncs.items()})

    children = (
        replace(child, children=tuple(map(inside, child.children)))
        if isinstance(child, Required)
        else inside(child)
        for child in block.children
    )
    return replace(block, children=tuple(children))
