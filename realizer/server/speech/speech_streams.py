"""The streaming speeches of a session."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from bml_schema import Block, BlockProgress, Feedback, SyncRef
from realizer.playback.player import Player
from realizer.playback.references import references, with_references
from realizer.protocol.messages.speech import SpeechMessage
from realizer.server.speech.speech_chunks import Piece
from realizer.server.speech.speech_stream import Turn

# An open speech ends so much later than now, as long as nobody knows when.
OPEN = 1e6  # s
# Its block ends so much behind its last piece, so that what is told of that one comes first.
BEHIND = 1e-3  # s
SAME = 1e-6  # s
# So many pieces are made ahead of the one that is heard. More is work that an interruption makes useless.
AHEAD = 6
MOST = 500_000  # characters of one speech that wait; nine hours
MOST_SPEECHES = 1_000  # of a session
CUT_OFF = ("INTERRUPTED", "REVOKED")


class SpeechError(ValueError):
    """A message of a speech that cannot be followed; `where` is its field."""

    def __init__(self, where: str, text: str) -> None:
        super().__init__(text)
        self.where = where


class Speeches:
    """The speeches of a session.

    Block `ID` is a <wait> from the first piece to the last: others can follow, interrupt and replace it as
    any block. Piece k is block `ID.k` and starts when the one before it has ended.
    """

    def __init__(self, player: Player) -> None:
        self._player = player
        self._speeches: dict[str, Turn] = {}

    def __len__(self) -> int:
        return len(self._speeches)

    # from clients -------------------------------------------------------------------------------

    def hear(self, message: SpeechMessage, connection: int, t: float) -> None:
        """More of a speech.

        What comes for one that was cut off is left out; its id is free again when it is closed.

        Raises:
            SpeechError: too much of it waits to be said, or it was closed and is still being said.
        """
        assert message.id is not None
        speech = self._speeches.get(message.id)
        if speech is None:
            if len(self._speeches) >= MOST_SPEECHES:
                raise SpeechError("id", f"wanted at most {MOST_SPEECHES} speeches at a time")
            piece = Piece(message.id, 0, message.character, message.language)
            speech = Turn(message.id, connection, message.composition, piece, spoken=t)
            self._speeches[message.id] = speech
            self._anticipate(speech, t + OPEN, t)
        elif speech.over:
            if message.close:
                self._forget(message.id)
            return
        elif speech.closed:
            raise SpeechError(
                "id", f"wanted a speech that is open, {message.id!r} was closed and is being said"
            )
        text = message.append or ""
        if speech.waiting + len(text) > MOST:
            raise SpeechError("append", f"wanted at most {MOST} characters that wait to be said, got more")
        speech.add(text, message.clip)
        if message.close:
            speech.close()

    def leave(self, connection: int) -> None:
        """Who spoke is gone: what is left is said, then its speeches end."""
        for speech in [s for s in self._speeches.values() if s.connection == connection and not s.closed]:
            speech.close()
            if speech.over:
                self._forget(speech.id)

    def __contains__(self, block: str) -> bool:
        """Whether a block is one of a speech that is not over."""
        return self._of(block) is not None

    # blocks out ---------------------------------------------------------------------------------

    def next(self) -> Block | None:
        """The next block that is to be prepared."""
        speech = next(filter(self._has_next, self._speeches.values()), None)
        if speech is None:
            return None
        return speech.next_piece() if speech.asked else speech.around()

    def held_back(self, blocks: Collection[str] | None) -> list[Block]:
        """The own blocks of these speeches, or of all (None), that `next` would have given."""
        held = [
            s
            for s in self._speeches.values()
            if not (s.asked or s.over) and (blocks is None or s.id in blocks)
        ]
        return [speech.around() for speech in held]

    @property
    def has_next(self) -> bool:
        """Whether `next` would give a block."""
        return any(map(self._has_next, self._speeches.values()))

    def placed(self, block: Block) -> Block:
        """A piece behind those before it; any other block with what it says of `ID:ID:m` of the piece."""
        speech = self._of(block.id)
        if speech is None or block.id == speech.id:
            return with_references(block, self._found) if any(map(self._names, references(block))) else block
        holder = self._player.blocks.find(speech.id)
        before = [id for id in speech.left if id != block.id]
        if holder is not None and holder.is_waiting:
            before += [wait.block.block.id for wait in holder.dependencies]
        return replace(block, append_after=tuple(before))

    def flows(self, block: Block) -> bool:
        """Whether a piece is part of a sentence of which more has come."""
        speech = self._of(block.id)
        return speech is not None and block.id in speech.parts

    def lacks(self, block: Block) -> bool:
        """Whether it names a sync of a speech that may still come."""
        named = filter(self._names, references(block))
        return any(self._speeches[ref.block or ""].lacks(ref.sync or "") for ref in named)

    # what became of them ------------------------------------------------------------------------

    def planned(self, block: str) -> None:
        """A block was taken in."""
        speech = self._of(block)
        if speech is not None:
            speech.planned(block)

    def refused(self, block: str) -> None:
        """A block will not play; without the one that holds it together a speech is over."""
        speech = self._of(block)
        if speech is not None:
            speech.done(block)
            speech.over |= block == speech.id

    def told(self, feedback: Feedback) -> tuple[Feedback, frozenset[str]]:
        """Feedback as it is to go out, and the blocks that end with what it tells of."""
        if not isinstance(feedback, BlockProgress) or not feedback.id.endswith(":end"):
            return feedback, frozenset()
        block = feedback.id.removesuffix(":end")
        speech = self._of(block)
        if speech is None:
            return feedback, frozenset()
        if block != speech.id:
            speech.said += self._words(block, feedback.global_time)
            speech.done(block)
            speech.spoken = max(speech.spoken, feedback.global_time)
            return feedback, frozenset()
        left = frozenset(speech.left)
        if feedback.status not in CUT_OFF:
            self._forget(speech.id)
            return feedback, left
        speech.over = True
        if speech.closed:
            self._forget(speech.id)
        words = [word for piece in speech.ahead for word in self._words(piece, feedback.global_time)]
        return replace(feedback, said=" ".join([*speech.said, *words])), left

    @property
    def open(self) -> list[str]:
        """Ids of those whose end nobody knows yet."""
        return [speech.id for speech in self._speeches.values() if not speech.over]

    @property
    def lasting(self) -> bool:
        """Whether `settle` may have something to do as time passes."""
        return bool(self.open)

    def settle(self, t: float) -> bool:
        """Let the block of each speech end with its last piece; True where one ends at another time."""
        moved = False
        for speech in self._speeches.values():
            if speech.over:
                continue
            # Before its own block starts nobody knows when that is: it must not end before.
            placed = self._player.blocks.find(speech.id) is not None
            if not (speech.closed and placed) or speech.owed or speech.unsaid:
                end = t + OPEN if speech.end < t + OPEN / 2 else speech.end
            else:
                last = (self._player.blocks.find(id) for id in speech.ahead)
                end = max([speech.spoken, *(piece.end for piece in last if piece is not None)]) + BEHIND
                end = max(t, end)
            if abs(end - speech.end) > SAME:
                self._anticipate(speech, end, t)
                moved = True
        return moved

    # inside -------------------------------------------------------------------------------------

    def _of(self, block: str) -> Turn | None:
        name, _, number = block.rpartition(".")
        return self._speeches.get(name if number.isdigit() and name in self._speeches else block)

    def _has_next(self, speech: Turn) -> bool:
        if speech.over:
            return False
        if not speech.asked:
            return True
        ready = bool(speech.unsaid) and len(speech.left) < AHEAD
        return ready and self._player.blocks.find(speech.id) is not None

    def _names(self, ref: SyncRef) -> bool:
        """Whether it is a sync in the text of a speech: `ID:ID:m`."""
        known = ref.block is not None and ref.block in self._speeches and ref.behaviour == ref.block
        return known and ref.sync not in ("start", "end")

    def _found(self, ref: SyncRef) -> SyncRef:
        """A reference to a sync of a speech, as one to the piece it stands in."""
        if not self._names(ref):
            return ref
        piece = self._speeches[ref.block or ""].marks.get(ref.sync or "")
        return ref if piece is None else replace(ref, block=piece)

    def _forget(self, id: str) -> None:
        self._player.forget_anticipator(self._speeches.pop(id).anticipator)

    def _anticipate(self, speech: Turn, end: float, t: float) -> None:
        speech.end = end
        self._player.anticipate(speech.anticipator, {"end": end}, t)

    def _words(self, piece: str, t: float) -> list[str]:
        """The words of a piece that have sounded."""
        playing = next((p for p in reversed(self._player.blocks.all()) if p.block.id == piece), None)
        if playing is None:
            return []
        heard = playing.words_spoken(t)
        if heard is not None:
            return heard.split()
        order = sorted(playing.speech.values(), key=lambda s: s.start)
        return [word.text for speaking in order for word in speaking.utterance.words]
