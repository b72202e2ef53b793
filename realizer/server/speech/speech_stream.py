"""A streaming speech: chunks of text and clips, and the block that spans them."""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from bml_schema import Block, read
from realizer.behaviours.registry import VOCABULARY
from realizer.server.speech.sentence_splitter import SentenceSplitter, is_sentence
from realizer.spoken_block import Chunk, clip_block, text_block
from realizer.text.parts import markup
from realizer.text.stream import TextStream


@dataclass(eq=False)
class SpeechStream:
    """One speech.

    Its own block is a <wait> that lasts from the first chunk to the last. Times are seconds on the session
    clock.

    Attributes:
        unspoken: (sentence or id of a clip, whether it is a clip) of what is in no block yet.
        arriving: id of a clip in `unspoken` that is spoken while it arrives -> when its last piece came.
        scheduled: ids of blocks that are planned and have not ended, in order.
    """

    id: str
    connection: int
    composition: str
    chunk: Chunk
    reader: TextStream | None = None  # of Markdown and the like; None: text has tags only
    splitter: SentenceSplitter = field(default_factory=SentenceSplitter)
    unspoken: deque[tuple[str, bool]] = field(default_factory=deque)
    marks: dict[str, str] = field(default_factory=dict)  # sync -> id of its chunk's block
    arriving: dict[str, float] = field(default_factory=dict)
    partial_chunks: set[str] = field(default_factory=set)  # ids of blocks that speak only part of a sentence
    unplanned: list[str] = field(default_factory=list)  # ids of blocks that are not planned yet, in order
    scheduled: list[str] = field(default_factory=list)
    # id of each block -> words, spoken when it ended
    words: dict[str, list[str]] = field(default_factory=dict)
    is_announced: bool = False
    is_closed: bool = False
    is_finished: bool = False  # whether the speech was cut off
    last_end: float = 0.0
    shown: bool = False  # whether anything of it was heard or moved the face
    end: float = 0.0

    # from the client ------------------------------------------------------------------------------

    def add(self, text: str, clip: str | None) -> None:
        """Add text, and a clip after it."""
        self._split(text, close=clip is not None)
        if clip is not None:
            self.unspoken.append((clip, True))

    def add_parts(self, clip: str, parts: Iterable[str], *, is_last: bool) -> None:
        """Add parts of a clip that arrives, before what follows it."""
        at = self.unspoken.index((clip, True))
        if is_last:
            self.arriving.pop(clip, None)
            del self.unspoken[at]
        for place, part in enumerate(parts, at):
            self.unspoken.insert(place, (part, True))

    @property
    def has_piece(self) -> bool:
        """Whether the next sentence or clip is there."""
        return bool(self.unspoken) and not (self.unspoken[0][1] and self.unspoken[0][0] in self.arriving)

    def close(self) -> None:
        """End the text: its rest is complete."""
        self._split("", close=True)
        self.is_closed = True

    def _split(self, text: str, *, close: bool) -> None:
        if self.reader is not None:
            text = markup(self.reader.feed(text, close=close))
        self.unspoken.extend((piece, False) for piece in self.splitter.feed(text, close=close))

    @property
    def unspoken_length(self) -> int:
        """The number of characters that are in no block yet."""
        return sum(len(text) for text, is_clip in self.unspoken if not is_clip)

    # blocks ---------------------------------------------------------------------------------------

    @property
    def anticipator(self) -> str:
        """The id of the anticipator of its own block's end."""
        return f"speech-{self.id}"

    def own_block(self) -> Block:
        """Return its own block: a <wait> for the end of the last chunk."""
        self.is_announced = True
        wait = f'<wait id="{self.id}" start="0" end="anticipators:{self.anticipator}:end"/>'
        (block,) = read(replace(self.chunk, number=0).document(wait), VOCABULARY)
        assert isinstance(block, Block)
        return replace(block, id=self.id, composition=self.composition)

    def next_chunk(self) -> Block:
        """Return the block of the next sentence or clip."""
        piece, is_clip = self.unspoken.popleft()
        chunk = self.chunk = replace(self.chunk, number=self.chunk.number + 1, marks=dict(self.marks))
        block = clip_block(piece, chunk) if is_clip else text_block(piece, chunk, self._take_warnings())
        speech = next((node for node in block.behaviours if node.id == self.id), None)
        self.marks |= dict.fromkeys(getattr(speech, "marked", ()), block.id)
        self.unplanned.append(block.id)
        self.words[block.id] = []
        if not is_clip and not is_sentence(piece) and (self.unspoken or not self.is_closed):
            self.partial_chunks.add(block.id)
        return block

    def _take_warnings(self) -> list[str]:
        """Return what of the text is left out since the last call."""
        if self.reader is None:
            return []
        warnings, self.reader.warnings = self.reader.warnings, []
        return warnings

    # states of blocks ---------------------------------------------------------------------------------

    @property
    def open_chunks(self) -> list[str]:
        """The ids of blocks that have not ended, in order."""
        return [*self.scheduled, *self.unplanned]

    def on_planned(self, chunk: str) -> None:
        """Note that a block was planned."""
        if chunk in self.unplanned:
            self.on_done(chunk)
            self.scheduled.append(chunk)

    def on_done(self, chunk: str) -> None:
        """Note that a block has ended or was refused."""
        for chunks in (self.unplanned, self.scheduled):
            if chunk in chunks:
                chunks.remove(chunk)

    def awaits_sync(self, sync: str) -> bool:
        """Return whether a sync of the text may still arrive or is not planned yet."""
        if self.is_finished:
            return False
        chunk = self.marks.get(sync)
        return chunk in self.unplanned or (chunk is None and not (self.is_closed and not self.unspoken))
