"""Blocks that wait for speech, or for the blocks they refer to."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

from bml_schema import Block
from realizer.playback.references import references
from realizer.speech.duration_fit import allow_small_warp
from realizer.speech.utterance import SpeechRequest, Utterance


@dataclass(eq=False)
class Waiting:
    """A block in preparation.

    Attributes:
        says: speak id -> (behaviour, what it says): what the voice still owes.
        utterances: behaviour -> what the voice has made.
        after: blocks in preparation that must be planned first.
        final: what the voice makes now is not asked for again.
        lacks: whether something the block names is still to come.
        flows: what it says is a part of a sentence: the rest follows in another block.
    """

    block: Block
    character: int
    since: float
    says: dict[int, tuple[str, SpeechRequest]]
    utterances: dict[str, Utterance] = field(default_factory=dict)
    after: set[Waiting] = field(default_factory=set)
    final: bool = False
    lacks: Callable[[Block], bool] = lambda block: False
    flows: bool = False

    @property
    def ready(self) -> bool:
        """It waits for nothing."""
        return not self.says and not self.after and not self.lacks(self.block)


class Preparation:
    """The blocks that wait, in the order in which they came."""

    def __init__(self) -> None:
        self.waiting: list[Waiting] = []

    def __len__(self) -> int:
        return len(self.waiting)

    def add(
        self, block: Block, character: int, says: dict[int, tuple[str, SpeechRequest]], now: float
    ) -> Waiting:
        """Let a block wait for its voice, and for the earlier blocks it depends on.

        It depends on blocks whose sync points it names, on those it is to follow, on one with its own id,
        and, where it is appended, on all of its character. A replacing block waits for nobody:
        `replaced_by` says what it ends. Blocks that are to follow this one depend on it.
        """
        named = {ref.block for ref in references(block)} | {*block.append_after, *block.chunk_after}
        after = {
            w
            for w in self.waiting
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
        waiting = Waiting(block, character, now, says, after=after)
        for other in self.waiting:
            if other.block.id in (*block.prepend_before, *block.chunk_before) and other not in after:
                other.after.add(waiting)
        self.waiting.append(waiting)
        return waiting

    def spoken(self, speak: int, utterance: Utterance) -> None:
        """The voice has made one utterance; one nobody waits for any more is dropped."""
        for waiting in self.waiting:
            if speak in waiting.says:
                behaviour, _ = waiting.says.pop(speak)
                waiting.utterances[behaviour] = allow_small_warp(utterance) if waiting.final else utterance

    def unspoken(self, speak: int) -> None:
        """No voice can say it: the block goes on without, its speech is dropped when it is planned."""
        for waiting in self.waiting:
            waiting.says.pop(speak, None)

    def said(self, speak: int) -> SpeechRequest | None:
        """What a speak id asked for; None where nobody waits for it."""
        return next((w.says[speak][1] for w in self.waiting if speak in w.says), None)

    @property
    def has_ready(self) -> bool:
        """Whether `ready` would give a block."""
        return any(w.ready for w in self.waiting)

    def ready(self) -> Waiting | None:
        """The first block that waits for nothing; None where all wait. `remove` it when it is planned."""
        return next((w for w in self.waiting if w.ready), None)

    def replaced_by(self, waiting: Waiting) -> list[Waiting]:
        """The blocks in preparation that came before a replacing block of their character."""
        return [w for w in self.waiting if w.character == waiting.character and w.since <= waiting.since]

    def overdue(self, before: float) -> Iterator[int]:
        """Speak ids asked for before that time and not answered."""
        return iter([speak for w in self.waiting if w.since < before for speak in w.says])

    def deadline(self, patience: float) -> float | None:
        """When the first voice that owes something will have taken longer than `patience` seconds."""
        return min((w.since + patience for w in self.waiting if w.says), default=None)

    def remove(self, gone: Iterable[Waiting]) -> None:
        """Take blocks out; nobody waits for them any more."""
        ids = {id(w) for w in gone}
        self.waiting = [w for w in self.waiting if id(w) not in ids]
        for waiting in self.waiting:
            waiting.after = {w for w in waiting.after if id(w) not in ids}
