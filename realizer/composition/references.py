"""A block in, every sync reference it makes out."""

from __future__ import annotations

from collections.abc import Iterator

from bml_schema import Block, Speech, Synchronize, SyncRef

__all__ = ["abroad", "references"]


def abroad(block: Block) -> tuple[SyncRef, ...]:
    """Those into other blocks."""
    return tuple(ref for ref in references(block) if ref.block is not None and ref.block != block.id)


def references(block: Block) -> Iterator[SyncRef]:
    """Of its behaviours, their syncs in text, and its constraints."""
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
