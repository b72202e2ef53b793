"""Blocks that wait for their speech or for other blocks."""

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
        requests: id of a request -> (behaviour, its speech): requests without an answer.
        utterances: behaviour -> its synthesized speech.
        predecessors: blocks in preparation that must be planned first.
        final: whether the requested speech is used as it comes, without another request.
        is_incomplete: whether a block refers to a sync point that has not arrived.
        is_streaming: whether the block speaks part of a sentence, which another block continues.
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
        """Whether the block waits for nothing."""
        return not self.requests and not self.predecessors and not self.is_incomplete(self.block)


class PendingBlocks:
    """The waiting blocks in order of arrival."""

    def __init__(self) -> None:
        self.blocks: list[PendingBlock] = []

    def __len__(self) -> int:
        return len(self.blocks)

    def add(
        self, block: Block, character: int, requests: dict[int, tuple[str, SpeechRequest]], now: float
    ) -> PendingBlock:
        """Add a block, which waits for its speech and for the earlier blocks it depends on.

        It depends on blocks whose sync points it names, on those it follows, on one with its own id, on a
        replacing block of its character, and, if it is appended, on all blocks of its character. A replacing
        block depends on none: it ends those that `replaced_by` returns. Blocks that must follow this one
        depend on it.
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
        """Store the answer to a request. It is dropped if no block waits for it."""
        for pending in self.blocks:
            if speak in pending.requests:
                behaviour, _ = pending.requests.pop(speak)
                pending.utterances[behaviour] = allow_small_warp(utterance) if pending.final else utterance

    def give_up(self, speak: int) -> None:
        """Remove a request that no voice can fulfil: the block is planned without that speech."""
        for pending in self.blocks:
            pending.requests.pop(speak, None)

    def request_of(self, speak: int) -> SpeechRequest | None:
        """Return the speech of a request, or None if no block waits for it."""
        return next((w.requests[speak][1] for w in self.blocks if speak in w.requests), None)

    @property
    def has_ready(self) -> bool:
        """Whether `first_ready` would return a block."""
        return any(w.is_ready for w in self.blocks)

    def first_ready(self) -> PendingBlock | None:
        """Return the first block that is ready, or None. The caller removes it once it is planned."""
        return next((w for w in self.blocks if w.is_ready), None)

    def replaced_by(self, pending: PendingBlock) -> list[PendingBlock]:
        """Return the blocks of the same character that arrived no later than a replacing block."""
        return [
            w
            for w in self.blocks
            if w.character == pending.character and w.waiting_since <= pending.waiting_since
        ]

    def overdue(self, before: float) -> Iterator[int]:
        """Yield the ids of requests from before that time without an answer."""
        return iter([speak for w in self.blocks if w.waiting_since < before for speak in w.requests])

    def deadline(self, patience: float) -> float | None:
        """Return the time at which the oldest request is `patience` seconds old; None without requests."""
        return min((w.waiting_since + patience for w in self.blocks if w.requests), default=None)

    def remove(self, gone: Iterable[PendingBlock]) -> None:
        """Remove blocks, also from the predecessors of others."""
        ids = {id(w) for w in gone}
        self.blocks = [w for w in self.blocks if id(w) not in ids]
        for pending in self.blocks:
            pending.predecessors = {w for w in pending.predecessors if id(w) not in ids}
