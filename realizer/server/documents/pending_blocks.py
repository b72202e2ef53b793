"""Blocks that wait for speech, or for the blocks they refer to."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

from bml_schema import Block
from realizer.playback.references import references
from realizer.speech.duration_fit import allow_small_warp
from realizer.speech.utterance import SpeechRequest, Utterance


@dataclass(eq=False)
class PendingBlock:
    """A block in preparation.

    Attributes:
        requests: speak id -> (behaviour, what it says): what the voice still owes.
        utterances: behaviour -> what the voice has made.
        predecessors: blocks in preparation that must be planned first.
        final: what the voice makes now is not asked for again.
        is_incomplete: whether something the block names is still to come.
        is_streaming: what it says is a part of a sentence: the rest follows in another block.
    """

    block: Block
    character: int
    waiting_since: float
    requests: dict[int, tuple[str, SpeechRequest]]
    utterances: dict[str, Utterance] = field(default_factory=dict)
    predecessors: set[PendingBlock] = field(default_factory=set)
    final: bool = False
    is_incomplete: Callable[[Block], bool] = lambda block: False
    is_streaming: bool = False

    @property
    def is_ready(self) -> bool:
        """It waits for nothing."""
        return not self.requests and not self.predecessors and not self.is_incomplete(self.block)


class PendingBlocks:
    """The blocks that wait, in the order in which they came."""

    def __init__(self) -> None:
        self.blocks: list[PendingBlock] = []

    def __len__(self) -> int:
        return len(self.blocks)

    def add(
        self, block: Block, character: int, requests: dict[int, tuple[str, SpeechRequest]], now: float
    ) -> PendingBlock:
        """Let a block wait for its voice, and for the earlier blocks it depends on.

        It depends on blocks whose sync points it names, on those it is to follow, on one with its own id,
        and, where it is appended, on all of its character. A replacing block waits for nobody:
        `replaced_by` says what it ends. Blocks that are to follow this one depend on it.
        """
        named = {ref.block for ref in references(block)} | {*block.append_after, *block.chunk_after}
        after = {
            w
            for w in self.blocks
            if block.composition != "REPLACE"
            and (
                w.block.id in named
                or w.block.id == block.id
                or (
                    w.character == character
                    and (block.composition == "APPEND" or w.block.composition == "REPLACE")
                )
            )
        }
        pending = PendingBlock(block, character, now, requests, predecessors=after)
        for other in self.blocks:
            if other.block.id in (*block.prepend_before, *block.chunk_before) and other not in after:
                other.predecessors.add(pending)
        self.blocks.append(pending)
        return pending

    def add_utterance(self, speak: int, utterance: Utterance) -> None:
        """The voice has made one utterance; one nobody waits for any more is dropped."""
        for pending in self.blocks:
            if speak in pending.requests:
                behaviour, _ = pending.requests.pop(speak)
                pending.utterances[behaviour] = allow_small_warp(utterance) if pending.final else utterance

    def give_up(self, speak: int) -> None:
        """No voice can say it: the block goes on without, its speech is dropped when it is planned."""
        for pending in self.blocks:
            pending.requests.pop(speak, None)

    def request_of(self, speak: int) -> SpeechRequest | None:
        """What a speak id asked for; None where nobody waits for it."""
        return next((w.requests[speak][1] for w in self.blocks if speak in w.requests), None)

    @property
    def has_ready(self) -> bool:
        """Whether `first_ready` would give a block."""
        return any(w.is_ready for w in self.blocks)

    def first_ready(self) -> PendingBlock | None:
        """The first block that waits for nothing; None where all wait. `remove` it when it is planned."""
        return next((w for w in self.blocks if w.is_ready), None)

    def replaced_by(self, pending: PendingBlock) -> list[PendingBlock]:
        """The blocks in preparation that came before a replacing block of their character."""
        return [
            w
            for w in self.blocks
            if w.character == pending.character and w.waiting_since <= pending.waiting_since
        ]

    def overdue(self, before: float) -> Iterator[int]:
        """Speak ids asked for before that time and not answered."""
        return iter([speak for w in self.blocks if w.waiting_since < before for speak in w.requests])

    def deadline(self, patience: float) -> float | None:
        """When the first voice that owes something will have taken longer than `patience` seconds."""
        return min((w.waiting_since + patience for w in self.blocks if w.requests), default=None)

    def remove(self, gone: Iterable[PendingBlock]) -> None:
        """Take blocks out; nobody waits for them any more."""
        ids = {id(w) for w in gone}
        self.blocks = [w for w in self.blocks if id(w) not in ids]
        for pending in self.blocks:
            pending.predecessors = {w for w in pending.predecessors if id(w) not in ids}
