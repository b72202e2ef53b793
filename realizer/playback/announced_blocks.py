"""Announced blocks that have not arrived, and the commands for them."""

from __future__ import annotations

from dataclasses import dataclass, field

from bml_schema import Block
from realizer.playback.active_block import Dependency
from realizer.playback.block_states import BlockEvent, State, next_state


@dataclass(eq=False)
class AnnouncedBlock:
    """An announced block with the commands that it received so far.

    Attributes:
        state: IN_PREP, or REVOKED after it was ended and reported.
        activated: it does not wait for activation.
        dependencies: blocks that were placed before it.
    """

    block: Block
    state: State = State.IN_PREP
    activated: bool = False
    dependencies: list[Dependency] = field(default_factory=list)

    @property
    def revoked(self) -> bool:
        return self.state is State.REVOKED

    def change_state(self, event: BlockEvent) -> None:
        """Change to the state that follows from an event."""
        self.state = next_state(self.state, event)


class AnnouncedBlocks:
    """The announced blocks of a session, by id."""

    def __init__(self) -> None:
        self._blocks: dict[str, AnnouncedBlock] = {}

    def __len__(self) -> int:
        return len(self._blocks)

    def __contains__(self, id: str) -> bool:
        return id in self._blocks

    def add(self, block: Block) -> None:
        self._blocks[block.id] = AnnouncedBlock(block)

    def get(self, id: str) -> AnnouncedBlock | None:
        """Return the announced block with an id, or None."""
        return self._blocks.get(id)

    def pop(self, block: Block) -> AnnouncedBlock:
        """Remove and return a block that has arrived or was withdrawn."""
        return self._blocks.pop(block.id, None) or AnnouncedBlock(block)
