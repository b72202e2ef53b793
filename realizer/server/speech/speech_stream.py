"""One streaming speech: text chunks and clips, and the block that spans them."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace

from bml_schema import Block, read
from realizer.behaviours.registry import VOCABULARY
from realizer.server.speech.sentence_splitter import SentenceSplitter, is_sentence
from realizer.server.speech.speech_chunks import Chunk, clip_block, text_block


@dataclass(frozen=True, slots=True)
class _Clip:
    """A recording that is said after the text before it."""

    id: str


@dataclass(eq=False)
class SpeechStream:
    """One speech.

    Attributes:
        chunk: the last one that was made.
        unspoken: what is in no piece yet.
        marks: sync -> the piece it stands in.
        partial_chunks: pieces that are part of a sentence only.
        unplanned: pieces that were made and are not planned yet, in order.
        scheduled: pieces that are planned and have not ended, in order.
        words: the words that were heard of the pieces that have ended.
        is_announced: its own block was given out.
        is_closed: nothing follows.
        is_finished: it was cut off.
        last_end: when the last piece that has ended did, seconds on the session clock.
        end: when its own block is anticipated to end.
    """

    id: str
    connection: int
    composition: str
    chunk: Chunk
    splitter: SentenceSplitter = field(default_factory=SentenceSplitter)
    unspoken: deque[str | _Clip] = field(default_factory=deque)
    marks: dict[str, str] = field(default_factory=dict)
    partial_chunks: set[str] = field(default_factory=set)
    unplanned: list[str] = field(default_factory=list)
    scheduled: list[str] = field(default_factory=list)
    words: list[str] = field(default_factory=list)
    is_announced: bool = False
    is_closed: bool = False
    is_finished: bool = False
    last_end: float = 0.0
    end: float = 0.0

    # what comes ---------------------------------------------------------------------------------

    def add(self, text: str, clip: str | None) -> None:
        """More of it: a text, and a clip behind that."""
        self.unspoken.extend(self.splitter.feed(text, close=clip is not None))
        if clip is not None:
            self.unspoken.append(_Clip(clip))

    def close(self) -> None:
        """Nothing follows: what is left is whole."""
        self.unspoken.extend(self.splitter.feed("", close=True))
        self.is_closed = True

    @property
    def unspoken_length(self) -> int:
        """Characters that are in no piece yet."""
        return sum(len(one) for one in self.unspoken if isinstance(one, str))

    # blocks out ---------------------------------------------------------------------------------

    @property
    def anticipator(self) -> str:
        """The name of what says when its own block ends."""
        return f"speech-{self.id}"

    def own_block(self) -> Block:
        """Its own block: a <wait> for the end of its last piece."""
        self.is_announced = True
        wait = f'<wait id="{self.id}" start="0" end="anticipators:{self.anticipator}:end"/>'
        (block,) = read(replace(self.chunk, number=0).document(wait), VOCABULARY)
        assert isinstance(block, Block)
        return replace(block, id=self.id, composition=self.composition)

    def next_chunk(self) -> Block:
        """The block of the first of what is unsaid."""
        one = self.unspoken.popleft()
        chunk = self.chunk = replace(self.chunk, number=self.chunk.number + 1, marks=dict(self.marks))
        block = clip_block(one.id, chunk) if isinstance(one, _Clip) else text_block(one, chunk)
        said = next((node for node in block.behaviours if node.id == self.id), None)
        self.marks |= dict.fromkeys(getattr(said, "marked", ()), block.id)
        self.unplanned.append(block.id)
        if isinstance(one, str) and not is_sentence(one) and (self.unspoken or not self.is_closed):
            self.partial_chunks.add(block.id)
        return block

    # what became of them ------------------------------------------------------------------------

    @property
    def open_chunks(self) -> list[str]:
        """The pieces that were made and have not ended, in order."""
        return [*self.scheduled, *self.unplanned]

    def on_planned(self, chunk: str) -> None:
        """A piece was taken in."""
        if chunk in self.unplanned:
            self.on_done(chunk)
            self.scheduled.append(chunk)

    def on_done(self, chunk: str) -> None:
        """A piece has ended, or never comes."""
        for pieces in (self.unplanned, self.scheduled):
            if chunk in pieces:
                pieces.remove(chunk)

    def awaits_sync(self, sync: str) -> bool:
        """Whether a sync of its text may still come."""
        chunk = self.marks.get(sync)
        return chunk in self.unplanned or (chunk is None and not (self.is_closed and not self.unspoken))
