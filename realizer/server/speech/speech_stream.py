"""One streaming speech: text chunks and clips, and the block that spans them."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace

from bml_schema import Block, read
from realizer.behaviours.registry import VOCABULARY
from realizer.server.speech.sentence_splitter import Clauses, whole
from realizer.server.speech.speech_chunks import Piece, clip_block, text_block


@dataclass(frozen=True, slots=True)
class _Clip:
    """A recording that is said after the text before it."""

    id: str


@dataclass(eq=False)
class Turn:
    """One speech.

    Attributes:
        piece: the last one that was made.
        unsaid: what is in no piece yet.
        marks: sync -> the piece it stands in.
        parts: pieces that are part of a sentence only.
        owed: pieces that were made and are not planned yet, in order.
        ahead: pieces that are planned and have not ended, in order.
        said: the words that were heard of the pieces that have ended.
        asked: its own block was given out.
        closed: nothing follows.
        over: it was cut off.
        spoken: when the last piece that has ended did, seconds on the session clock.
        end: when its own block is anticipated to end.
    """

    id: str
    connection: int
    composition: str
    piece: Piece
    clauses: Clauses = field(default_factory=Clauses)
    unsaid: deque[str | _Clip] = field(default_factory=deque)
    marks: dict[str, str] = field(default_factory=dict)
    parts: set[str] = field(default_factory=set)
    owed: list[str] = field(default_factory=list)
    ahead: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    asked: bool = False
    closed: bool = False
    over: bool = False
    spoken: float = 0.0
    end: float = 0.0

    # what comes ---------------------------------------------------------------------------------

    def add(self, text: str, clip: str | None) -> None:
        """More of it: a text, and a clip behind that."""
        self.unsaid.extend(self.clauses.feed(text, close=clip is not None))
        if clip is not None:
            self.unsaid.append(_Clip(clip))

    def close(self) -> None:
        """Nothing follows: what is left is whole."""
        self.unsaid.extend(self.clauses.feed("", close=True))
        self.closed = True

    @property
    def waiting(self) -> int:
        """Characters that are in no piece yet."""
        return sum(len(one) for one in self.unsaid if isinstance(one, str))

    # blocks out ---------------------------------------------------------------------------------

    @property
    def anticipator(self) -> str:
        """The name of what says when its own block ends."""
        return f"speech-{self.id}"

    def around(self) -> Block:
        """Its own block: a <wait> for the end of its last piece."""
        self.asked = True
        wait = f'<wait id="{self.id}" start="0" end="anticipators:{self.anticipator}:end"/>'
        (block,) = read(replace(self.piece, number=0).document(wait), VOCABULARY)
        assert isinstance(block, Block)
        return replace(block, id=self.id, composition=self.composition)

    def next_piece(self) -> Block:
        """The block of the first of what is unsaid."""
        one = self.unsaid.popleft()
        piece = self.piece = replace(self.piece, number=self.piece.number + 1, marks=dict(self.marks))
        block = clip_block(one.id, piece) if isinstance(one, _Clip) else text_block(one, piece)
        said = next((node for node in block.behaviours if node.id == self.id), None)
        self.marks |= dict.fromkeys(getattr(said, "marked", ()), block.id)
        self.owed.append(block.id)
        if isinstance(one, str) and not whole(one) and (self.unsaid or not self.closed):
            self.parts.add(block.id)
        return block

    # what became of them ------------------------------------------------------------------------

    @property
    def left(self) -> list[str]:
        """The pieces that were made and have not ended, in order."""
        return [*self.ahead, *self.owed]

    def planned(self, piece: str) -> None:
        """A piece was taken in."""
        if piece in self.owed:
            self.done(piece)
            self.ahead.append(piece)

    def done(self, piece: str) -> None:
        """A piece has ended, or never comes."""
        for pieces in (self.owed, self.ahead):
            if piece in pieces:
                pieces.remove(piece)

    def lacks(self, sync: str) -> bool:
        """Whether a sync of its text may still come."""
        piece = self.marks.get(sync)
        return piece in self.owed or (piece is None and not (self.closed and not self.unsaid))
