"""Blocks that were announced and have not arrived, and the commands for them."""

from __future__ import annotations

from dataclasses import dataclass, field

from bml_schema import Block
from realizer.playback.active_block import Dependency
from realizer.playback.block_states import BlockEvent, State, next_state


@dataclass(eq=False)
class AnnouncedBlock:
    """What was done to a block before it came.

    Attributes:
        state: IN_PREP, or REVOKED where it was ended; that was reported.
        activated: it need not wait for activation.
        dependencies: what was put before it.
    """

    block: Block
    state: State = State.IN_PREP
    activated: bool = False
    dependencies: list[Dependency] = field(default_factory=list)

    @property
    def revoked(self) -> bool:
        return self.state is State.REVOKED

    def change_state(self, event: BlockEvent) -> None:
        """Take the state that follows from an event."""
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
        """Of a block that is still to come."""
        return self._blocks.get(id)

    def pop(self, block: Block) -> AnnouncedBlock:
        """A block is here, or will not come: what was done to it until now."""
        return self._blocks.pop(block.id, None) or AnnouncedBlock(block)
