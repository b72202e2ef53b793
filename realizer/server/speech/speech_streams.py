"""The streaming speeches of a session."""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import chain

from bml_schema import Block, BlockProgress, Feedback, SyncRef
from realizer.core.similar import similar
from realizer.playback.block_manager import BlockManager
from realizer.playback.references import Continuation, references, with_references
from realizer.protocol.messages.speech import SpeechMessage
from realizer.scheduling.timing import UNKNOWN, Warning
from realizer.server.session.control_fields import FieldError
from realizer.server.speech.speech_stream import SpeechStream
from realizer.spoken_block import Chunk
from realizer.text.stream import TextStream

# The anticipated end of an open speech is so much later than now, so that it counts as not known.
OPEN = 2 * UNKNOWN  # s
# Its own block ends so much after its last chunk, so that the feedback of the chunk comes first.
BEHIND = 1e-3  # s
SAME = 1e-6  # s
# So many chunks are prepared ahead. An interruption makes the work for more useless.
AHEAD = 6
OPEN_CHUNKS = 20  # of a speech, with those that are spoken and whose expressions go on
PARTS = 2  # of a clip that arrives, ahead of those: later, a part can be longer
MOST = 500_000  # waiting characters of one speech; nine hours
MAX_SPEECHES = 1_000  # of a session
PATIENCE = 20.0  # s; a clip of which no piece has come for so long is spoken without the rest
CUT_OFF = ("INTERRUPTED", "REVOKED")


class SpeechStreams:
    """The streaming speeches of a session.

    Block `ID` is a <wait> from the first chunk to the last: documents can follow, interrupt and replace it
    like any block. Chunk k is block `ID.k` and starts when the speech of the previous one has ended.
    """

    def __init__(self, manager: BlockManager, language: str = "en-US") -> None:
        self._manager = manager
        self._language = language  # of speeches without one
        self._speeches: dict[str, SpeechStream] = {}

    def __len__(self) -> int:
        return len(self._speeches)

    # from clients -------------------------------------------------------------------------------

    def check(self, message: SpeechMessage) -> None:
        """Check that `handle` can take a message.

        Raises:
            FieldError: too many speeches or characters wait, or the speech is already closed.
        """
        speech = self._speeches.get(message.id or "")
        if speech is None and len(self._speeches) >= MAX_SPEECHES:
            raise FieldError("id", f"wanted at most {MAX_SPEECHES} speeches at a time")
        if speech is not None and speech.is_finished:
            return
        if speech is not None and speech.is_closed:
            raise FieldError("id", f"wanted an open speech, but {message.id!r} is closed and being spoken")
        waiting = 0 if speech is None else speech.unspoken_length
        if waiting + len(message.append or "") > MOST:
            raise FieldError("append", f"wanted at most {MOST} characters that wait to be spoken, got more")

    def handle(self, message: SpeechMessage, connection: int, t: float, *, is_arriving: bool = False) -> None:
        """Begin, continue or close a speech, with a message that `check` has passed.

        `is_arriving`: the clip of the message is not complete; `add_parts` adds what there is of it.

        Messages for a speech that was cut off are ignored; its id is free again after `close`.
        """
        assert message.id is not None
        speech = self._speeches.get(message.id)
        if speech is None:
            chunk = Chunk(message.id, 0, message.character, message.language)
            reader = None
            if not message.plain:
                reader = TextStream(message.language or self._language)
            speech = SpeechStream(message.id, connection, message.composition, chunk, reader, last_end=t)
            self._speeches[message.id] = speech
            self._anticipate(speech, t + OPEN, t)
        elif speech.is_finished:
            if message.close:
                self._forget(message.id)
            return
        speech.add(message.append or "", message.clip)
        if is_arriving and message.clip is not None:
            speech.arriving[message.clip] = t
        if message.close:
            speech.close()

    def parts_wanted(self, clip: str, t: float) -> int:
        """Return how many parts of a clip that arrives can be prepared now; -1 if no speech waits for it.

        Args:
            t: when a piece of it came.
        """
        speech = self._speaker(clip)
        if speech is not None:
            speech.arriving[clip] = t
        return -1 if speech is None else max(0, PARTS - speech.unspoken.index((clip, True)))

    def arriving(self, connection: int) -> list[str]:
        """Return the clips for which the speeches of a connection wait."""
        speeches = [speech for speech in self._speeches.values() if speech.connection == connection]
        return [clip for speech in speeches for clip in sorted(speech.arriving)]

    def overdue(self, t: float) -> list[str]:
        """Return the clips of which no piece has come for PATIENCE seconds."""
        return [clip for clip, last in self._last_pieces() if t >= last + PATIENCE]

    def deadline(self) -> float:
        """Return the time at which a clip is overdue; infinity without one."""
        return min((last + PATIENCE for _, last in self._last_pieces()), default=math.inf)

    def _last_pieces(self) -> list[tuple[str, float]]:
        return [item for s in self._speeches.values() if not s.is_finished for item in s.arriving.items()]

    def add_parts(self, clip: str, parts: Sequence[str], *, is_last: bool, fault: str | None = None) -> None:
        """Add parts of a clip to the speech that waits for it.

        Args:
            fault: why no more will come, which is published as a warning.
        """
        speech = self._speaker(clip)
        if speech is None:
            return
        speech.add_parts(clip, parts, is_last=is_last)
        if fault is not None:
            warning = Warning(f"{speech.id}:{speech.id}", "CANNOT_CREATE_BEHAVIOR", f"speech: {fault}")
            self._manager.refuse(warning, speech.chunk.character)

    def on_disconnect(self, connection: int) -> None:
        """Close the speeches of a connection that has left; the rest of their text is spoken."""
        for speech in [s for s in self._speeches.values() if s.connection == connection and not s.is_closed]:
            speech.close()
            if speech.is_finished:
                self._forget(speech.id)

    def __contains__(self, block: str) -> bool:
        """Whether a block belongs to a speech that is not over."""
        return self._of(block) is not None

    # blocks ---------------------------------------------------------------------------------------

    def next(self) -> Block | None:
        """Return the next block to prepare, or None."""
        speech = next(filter(self._has_next, self._speeches.values()), None)
        if speech is None:
            return None
        return speech.next_chunk() if speech.is_announced else speech.own_block()

    def cancel(self, blocks: Collection[str] | None) -> list[Block]:
        """Return the own blocks of speeches, or of all (None), that `next` has not returned."""
        unannounced = [s for s in self._speeches.values() if not (s.is_announced or s.is_finished)]
        return [speech.own_block() for speech in unannounced if blocks is None or speech.id in blocks]

    @property
    def has_next(self) -> bool:
        """Whether `next` would return a block."""
        return any(map(self._has_next, self._speeches.values()))

    def with_links(self, block: Block) -> Block:
        """Return a chunk's block with its predecessors, any other block with its `ID:ID:m` resolved.

        If it interrupts a speech, it interrupts the chunks too.
        """
        speech = self._of(block.id)
        if speech is None or block.id == speech.id:
            cut = [self._speeches[id].open_chunks for id in block.interrupt if id in self._speeches]
            if cut:
                block = replace(block, interrupt=tuple(dict.fromkeys(chain(block.interrupt, *cut))))
            has_syncs = bool(self._speeches) and any(map(self._is_speech_sync, references(block)))
            return with_references(block, self._chunk_reference) if has_syncs else block
        own = self._manager.blocks.find(speech.id)
        waits = own.dependencies if own is not None and own.is_waiting else ()
        linked = replace(block, append_after=tuple(wait.block.block.id for wait in waits))
        return Continuation.of(linked, (id for id in speech.open_chunks if id != block.id))

    def is_streaming(self, block: Block) -> bool:
        """Whether a block speaks part of a sentence that the next chunk continues."""
        speech = self._of(block.id)
        return speech is not None and block.id in speech.partial_chunks

    def awaits_sync(self, block: Block) -> bool:
        """Whether a block refers to a sync of a speech that may still arrive."""
        return bool(self.awaited_syncs(block))

    def awaited_syncs(self, block: Block) -> list[str]:
        """Return the references of a block to syncs of speeches that may still arrive."""
        named = filter(self._is_speech_sync, references(block) if self._speeches else ())
        awaited = (ref for ref in named if self._speeches[ref.block or ""].awaits_sync(ref.sync or ""))
        return [f"{ref.block}:{ref.behaviour}:{ref.point}" for ref in awaited]

    # their states ---------------------------------------------------------------------------------

    def on_planned(self, block: str) -> None:
        """Note that a block was planned."""
        speech = self._of(block)
        if speech is not None:
            speech.on_planned(block)

    def on_refused(self, block: str) -> None:
        """Note that a block will not play. If it is a speech's own block, the speech is over."""
        speech = self._of(block)
        if speech is not None:
            speech.on_done(block)
            speech.is_finished |= block == speech.id

    def process_feedback(self, feedback: Feedback) -> tuple[Feedback, frozenset[str]]:
        """Return feedback, with the spoken words added if a speech ended, and the blocks to end with it."""
        if not isinstance(feedback, BlockProgress) or not feedback.id.endswith(":end"):
            return feedback, frozenset()
        block = feedback.id.removesuffix(":end")
        speech = self._of(block)
        if speech is None:
            return feedback, frozenset()
        if block != speech.id:
            speech.words[block] = self._words(block, feedback.global_time)
            speech.shown = speech.shown or feedback.shown
            speech.on_done(block)
            speech.last_end = max(speech.last_end, feedback.global_time)
            return replace(feedback, shown=True), frozenset()  # the end of the speech says it for all
        chunks = frozenset(speech.open_chunks)
        speech.is_finished = feedback.status in CUT_OFF
        if speech.is_closed or not speech.is_finished:
            self._forget(speech.id)
        if not speech.is_finished:
            return replace(feedback, shown=speech.shown or not speech.words), chunks
        speech.words |= {chunk: self._words(chunk, feedback.global_time) for chunk in speech.scheduled}
        return replace(feedback, said=" ".join(chain.from_iterable(speech.words.values()))), chunks

    @property
    def open_ids(self) -> list[str]:
        """The ids of speeches that are not over."""
        return [speech.id for speech in self._speeches.values() if not speech.is_finished]

    def advance(self, t: float) -> bool:
        """Update the anticipated ends of speeches. Return whether one has changed."""
        moved = False
        for speech in self._speeches.values():
            if speech.is_finished:
                continue
            # Until its own block is placed, its start is unknown, and it must not end before that.
            placed = self._manager.blocks.find(speech.id) is not None
            if not (speech.is_closed and placed) or speech.unplanned or speech.unspoken:
                end = t + OPEN if speech.end < t + OPEN / 2 else speech.end
            else:
                last = (self._manager.blocks.find(id) for id in speech.scheduled)
                end = max([speech.last_end, *(chunk.end for chunk in last if chunk is not None)]) + BEHIND
                end = max(t, end)
            if abs(end - speech.end) > SAME:
                self._anticipate(speech, end, t)
                moved = True
        return moved

    # inside -------------------------------------------------------------------------------------

    def _of(self, block: str) -> SpeechStream | None:
        name, _, number = block.rpartition(".")
        return self._speeches.get(name if number.isdigit() and name in self._speeches else block)

    def _speaker(self, clip: str) -> SpeechStream | None:
        return next((s for s in self._speeches.values() if clip in s.arriving and not s.is_finished), None)

    def _has_next(self, speech: SpeechStream) -> bool:
        if speech.is_finished:
            return False
        if not speech.is_announced:
            return True
        chunks = speech.open_chunks
        begun = [p for p in map(self._manager.blocks.find, chunks) if p is not None and p.has_begun]
        ahead = len(chunks) - len(begun[1:])  # what was spoken before the last one that has begun may go on
        ready = speech.has_piece and ahead < AHEAD and len(chunks) < OPEN_CHUNKS
        return ready and self._manager.blocks.find(speech.id) is not None

    def _is_speech_sync(self, ref: SyncRef) -> bool:
        """Whether a reference is to a sync in the text of a speech: `ID:ID:m`."""
        known = ref.block is not None and ref.block in self._speeches and ref.behaviour == ref.block
        return known and ref.sync not in ("start", "end")

    def _chunk_reference(self, ref: SyncRef) -> SyncRef:
        if not self._is_speech_sync(ref):
            return ref
        speech, sync = self._speeches[ref.block or ""], ref.sync or ""
        if sync not in speech.marks and not speech.awaits_sync(sync):
            # The warning names the syncs of the chunk that it is looked for in.
            sync = next(iter(similar(sync, speech.marks, most=1)), sync)
        return replace(ref, block=speech.marks[sync]) if sync in speech.marks else ref

    def _forget(self, id: str) -> None:
        self._manager.blocks.drop_anticipators([self._speeches.pop(id).anticipator])

    def _anticipate(self, speech: SpeechStream, end: float, t: float) -> None:
        speech.end = end
        self._manager.anticipate(speech.anticipator, {"end": end}, t)

    def _words(self, chunk: str, t: float) -> list[str]:
        playing = next((p for p in reversed(self._manager.blocks.all()) if p.block.id == chunk), None)
        if playing is None:
            return []
        spoken = playing.words_spoken(t)
        if spoken is not None:
            return spoken.split()
        speeches = sorted(playing.speech.values(), key=lambda s: s.start)
        return [word.text for speech in speeches for word in speech.utterance.words]
