"""What a block names in other blocks: sync references, anticipators, and speech that it continues."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import field, fields, replace
from typing import Self

from bml_schema import Behaviour, Block, Constraint, Speech, Synchronize, SyncRef
from bml_schema.node_schema import node
from realizer.core import work


@node
class Continuation(Block):
    """A block whose speech continues that of other blocks: it starts when theirs is over."""

    speaks_after: tuple[str, ...] = field(default=(), compare=False, repr=False)

    @classmethod
    def of(cls, block: Block, speaks_after: Iterable[str]) -> Self:
        values = {f.name: getattr(block, f.name) for f in fields(Block) if f.init}
        return cls(**values, speaks_after=tuple(speaks_after))


def speaks_after(block: Block) -> tuple[str, ...]:
    """Return the ids of the blocks whose speech a block continues."""
    return block.speaks_after if isinstance(block, Continuation) else ()


def external_refs(block: Block) -> tuple[SyncRef, ...]:
    return tuple(ref for ref in references(block) if ref.block is not None and ref.block != block.id)


def references(block: Block) -> Iterator[SyncRef]:
    """Yield the references of its behaviours, of syncs in their text, and of its constraints."""
    for behaviour in work.counted(block.behaviours):
        for _, ref in behaviour.references:
            yield ref
    for constraint in work.counted(block.constraints):
        yield from constraint.references


def with_references(block: Block, to: Callable[[SyncRef], SyncRef]) -> Block:
    """Return the block with each reference replaced by `to(reference)`."""

    def inside(node: Behaviour | Constraint, required: bool) -> Behaviour | Constraint:
        if isinstance(node, Constraint):
            parts = (replace(part, refs=tuple(map(to, part.refs))) for part in node.parts)
            return replace(
                node,
                parts=tuple(p if isinstance(p, Synchronize) else replace(p, ref=to(p.ref)) for p in parts),
            )
        if isinstance(node, Speech):
            node = node.with_references(lambda sync: sync.ref and to(sync.ref))
        return replace(node, syncs={point: to(ref) for point, ref in node.syncs.items()})

    return block.with_children(inside)


# BMLA's reserved block id for points in time that a client announces.
ANTICIPATORS = "anticipators"


def anticipators_of(block: Block) -> set[str]:
    return {ref.behaviour or "" for ref in references(block) if ref.block == ANTICIPATORS}
