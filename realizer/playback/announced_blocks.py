"""Blocks that have arrived and are not planned yet, and their links to the blocks of a session."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import inf
from typing import NamedTuple

from bml_schema import Block
from realizer.playback import block_links
from realizer.playback.active_block import ActiveBlock, BlockMoment, Dependency
from realizer.playback.block_states import BlockEvent, State, next_state
from realizer.playback.block_store import BlockStore
from realizer.scheduling.timing import Warning


class BlockRejectedError(Exception):
    """A block cannot be accepted; the warning has the reason, None if it has been reported.

    Attributes:
        over_limit: planning it takes too many steps.
    """

    def __init__(self, warning: Warning | None, *, over_limit: bool = False) -> None:
        super().__init__(warning and warning.text)
        self.warning = warning
        self.over_limit = over_limit


class BlockLinks(NamedTuple):
    """The blocks that a new one waits for, and the accepted ones that have to wait for it."""

    waits: list[Dependency]
    followers: list[tuple[ActiveBlock, BlockMoment]]


@dataclass(eq=False)
class AnnouncedBlock:
    """A block that was announced and has not arrived, with the commands that it received so far."""

    block: Block
    character: int  # index of its character
    number: int = 0  # order of arrival
    state: State = State.IN_PREP  # IN_PREP, or REVOKED after it was ended and reported
    activated: bool = False  # it does not wait for activation
    dependencies: list[Dependency] = field(default_factory=list)  # blocks that were placed before it
    # ids of the blocks that have to wait for it and had not started when it was announced
    unstarted: frozenset[str] = frozenset()

    @property
    def is_revoked(self) -> bool:
        return self.state is State.REVOKED

    @property
    def is_too_late(self) -> bool:
        """Whether it will be refused, because a block that has to wait for it had started, or is unknown."""
        return any(name not in self.unstarted for name, _ in block_links.followers(self.block))

    def change_state(self, event: BlockEvent) -> None:
        self.state = next_state(self.state, event)

    def ends(self, other: AnnouncedBlock | ActiveBlock) -> bool:
        """Return whether it interrupts or replaces another block, if that is earlier."""
        replaces = self.block.composition == "REPLACE" and self.character == other.character
        return replaces or other.block.id in self.block.interrupt


class AnnouncedBlocks:
    """The announced blocks of a session, by id, in order of arrival."""

    def __init__(self, blocks: BlockStore) -> None:
        self._blocks = blocks
        self._announced: dict[str, AnnouncedBlock] = {}

    def __len__(self) -> int:
        return len(self._announced)

    def find(self, id: str) -> AnnouncedBlock | None:
        return self._announced.get(id)

    def pop(self, id: str) -> AnnouncedBlock | None:
        return self._announced.pop(id, None)

    def add(self, block: Block, character: int) -> AnnouncedBlock | None:
        """Announce a block, once; return None if its id is in use."""
        if block.id in self._announced or self.is_in_use(block, character):
            return None
        names = (name for name, _ in block_links.followers(block))
        unstarted = frozenset(filter(self._has_not_started, names))
        added = AnnouncedBlock(block, character, self._blocks.new_number(), unstarted=unstarted)
        self._announced[block.id] = added
        return added

    def before(self, announced: AnnouncedBlock) -> list[AnnouncedBlock]:
        return [other for other in self._announced.values() if other.number < announced.number]

    def is_in_use(self, block: Block, character: int) -> bool:
        """Whether the id of a block belongs to a playing or waiting one that it does not end."""
        other = self._blocks.find(block.id)
        return other is not None and not AnnouncedBlock(block, character).ends(other)

    def blocks_to_end(self, announced: AnnouncedBlock) -> list[ActiveBlock]:
        active = self._blocks.active()
        return [p for p in active if p.number < announced.number and announced.ends(p)]

    def dependencies(self, announced: AnnouncedBlock) -> list[Dependency]:
        placed_before = [w for w in announced.dependencies if not w.block.is_done]
        block, active = announced.block, self._blocks.active()
        waits = block_links.dependencies(block, announced.character, announced.number, active)
        return waits + placed_before

    def links(self, announced: AnnouncedBlock) -> BlockLinks:
        """Return the links of a block.

        Raises:
            BlockRejectedError: a block that has to wait for it has started, or is itself a dependency.
        """
        id_of_block, waits = announced.block.id, self.dependencies(announced)
        waiting: list[tuple[ActiveBlock, BlockMoment]] = []
        for name, moment in block_links.followers(announced.block):
            playing = self._blocks.find(name)
            if playing is not None and playing.is_waiting:
                waiting.append((playing, moment))
            elif playing is not None or name not in announced.unstarted:
                text = f"prependBefore, chunkBefore: wanted blocks that have not started, got {name!r}"
                raise BlockRejectedError(Warning(id_of_block, "TargetBlockAlreadyStartedException", text))
        if waiting and any(id(playing) in block_links.all_dependencies(waits) for playing, _ in waiting):
            text = "prependBefore, chunkBefore: wanted blocks that this one does not wait for itself"
            raise BlockRejectedError(Warning(id_of_block, "IMPOSSIBLE_TO_SCHEDULE", text))
        return BlockLinks(waits, waiting)

    def unheard(self, announced: AnnouncedBlock) -> Iterator[Warning]:
        """Yield a warning for each attribute of a block that names one of which nothing was heard before."""
        block, number = announced.block, announced.number
        if not (block.interrupt or block.append_after):
            return
        known = {playing.block.id: playing.number for playing in reversed(self._blocks.all())}
        known |= {other.block.id: other.number for other in self.before(announced)}
        for name, ids in (("interrupt", block.interrupt), ("appendAfter", block.append_after)):
            for id in ids:
                if not (known[id] < number if id in known else self._blocks.has_seen(id)):
                    text = f"{name}: wanted a block, got {id!r}, of which nothing was heard"
                    yield Warning(block.id, "EXECUTION_FAILURE", text)
                    break

    def place_after(self, playing: ActiveBlock) -> None:
        """Let earlier announced blocks wait for an accepted one that is put before them."""
        for name, moment in block_links.followers(playing.block):
            other = self._announced.get(name)
            if other is not None and other.number < playing.number:
                other.dependencies.append(Dependency(playing, moment))

    def _has_not_started(self, id: str) -> bool:
        """Whether a block has been announced or planned, and has not started, was revoked or refused."""
        if id in self._announced:
            return True
        if (playing := self._blocks.find(id)) is not None:
            return playing.is_waiting
        past = self._blocks.schedule_of(id)
        return past is not None and past.start == inf
