"""The queue of a session's documents, and their submission: parsed, synthesized, then planned."""

import logging
import re
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import replace

from bml_schema import Block, BMLError, BMLSizeError, made_ids, read
from realizer.behaviours.registry import VOCABULARY
from realizer.core.settings import Settings, limit_hint
from realizer.playback.feedback_events import parse_warning
from realizer.playback.player import Player
from realizer.playback.speaking import stretch_to_fit, without_stretch
from realizer.scheduling.timing import Warning
from realizer.server.documents.limits import block_limit_error, size_error
from realizer.server.documents.pending_blocks import (
    PendingBlock,
    PendingBlocks,
    TtsRequests,
)
from realizer.server.session.effects import Effect
from realizer.server.speech.speech_streams import SpeechStreams
from realizer.speech.utterance import SpeechRequest

log = logging.getLogger(__name__)

_BLOCK_ID = re.compile(r"<(?:\w+:)?bml\b[^<>]*?\bid\s*=\s*[\"']([^\"'<>]{1,256})[\"']")


class DocumentQueue:
    """A queue of unread messages with documents, at most `settings.max_blocks`."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._unread: deque[tuple[Iterator[Block | BMLError], int | None]] = deque()  # with their senders
        self._block_ids = made_ids()  # for documents of dialects that have none
        self.received = 0  # number of the last message that came
        self._all_cancelled = 0  # all blocks up to this message are cancelled
        self._cancelled: dict[str, int] = {}  # id of a block -> cancelled up to this message

    def __len__(self) -> int:
        """Return the number of messages that are not read to their end."""
        return len(self._unread)

    def put(self, text: str, sender: int | None = None) -> Warning | None:
        """Add a message of a connection, or return why it is refused."""
        limits = self._settings
        if len(self._unread) >= limits.max_blocks:
            error = f"{limits.max_blocks} messages wait to be read: wanted fewer at a time"
            return Warning(block_id_of(text), "PARSING_FAILURE", f"{error} {limit_hint('max_blocks')}")
        if (too_large := size_error(text, limits)) is not None:
            return Warning(block_id_of(text), "PARSING_FAILURE", too_large)
        most = {"max_bytes": limits.max_document, "max_behaviours": limits.max_behaviours}
        ids, strict_bml = self._block_ids, limits.strict_bml
        self._unread.append((read(text, VOCABULARY, block_ids=ids, strict_bml=strict_bml, **most), sender))
        self.received += 1
        return None

    def cancel(self, blocks: Iterable[str] | None) -> None:
        """Cancel blocks, or all (None), that have arrived and are not read."""
        if not self._unread:
            return
        if blocks is None:
            self._all_cancelled = self.received
        else:
            self._cancelled |= dict.fromkeys(blocks, self.received)

    def is_cancelled(self, block: Block) -> bool:
        """Return whether the block that `next` returned last is cancelled."""
        return self.message <= max(self._all_cancelled, self._cancelled.get(block.id, 0))

    def next(self) -> Block | Warning | None:
        """Return the next block or the warning that replaces it; None if the queue is empty."""
        while self._unread:
            try:
                item = next(self._unread[0][0], None)
            except Exception:
                log.exception("a document could not be read")
                self._unread.popleft()
                return Warning("<no id>", "PARSING_FAILURE", "internal error while reading")
            if isinstance(item, Block):
                return item
            if item is not None:
                refused = parse_warning(item)
                if isinstance(item, BMLSizeError):  # too many behaviours: `put` has counted the bytes
                    refused = replace(refused, text=f"{refused.text} {limit_hint('max_behaviours')}")
                return refused
            self._unread.popleft()
        self._cancelled.clear()
        return None

    @property
    def sender(self) -> int | None:
        """The number of the connection that the block that `next` returned last came by."""
        return self._unread[0][1]

    @property
    def message(self) -> int:
        """The number of the message that is read, or was read last."""
        return self.received - max(len(self._unread) - 1, 0)

    def clear(self) -> None:
        """Remove all messages."""
        self._unread.clear()


class Submission:
    """The submission of a session's documents: it reads them, requests speech, and plans blocks."""

    def __init__(
        self, name: str, settings: Settings, player: Player, add_effects: Callable[[Iterable[Effect]], None]
    ) -> None:
        self.voices: dict[int, str] = {}  # index of a character -> name of its voice
        self.counts = Counter[str]()
        self.pending = PendingBlocks()
        self.speeches = SpeechStreams(player.manager, player.context.language)
        self.tts = TtsRequests(player.manager, self.pending)
        self.queue = DocumentQueue(settings)
        self._name = name
        self._settings = settings
        self._player = player
        self._add_effects = add_effects
        self._message = 0
        self._followers = set[PendingBlock]()  # waited for the block that was planned last

    def work(self, t: float) -> bool:
        """Plan a block that is ready, or else read one. Return False if nothing has changed.

        The end of a message is a change too: it ends the standstill, also in a replay of the journal.
        """
        unread = len(self.queue)
        return self._plan_next(t) or self._parse_next(t) or len(self.queue) < unread

    @property
    def is_in_message(self) -> bool:
        """Whether more of the message whose block was planned last can be read or planned.

        Blocks that waited for that one belong to it, so that they are not late for its first sync points.
        """
        if self.queue and self.queue.message == self._message:
            return True
        together = (w for w in self.pending.blocks if w.message == self._message or w in self._followers)
        return any(w.is_ready for w in together)

    @property
    def has_work(self) -> bool:
        """Whether something can be read or planned now."""
        return bool(self.queue or self.speeches.has_next or self.pending.first_ready())

    @property
    def is_idle(self) -> bool:
        """Whether no document is being read or prepared and no speech is open."""
        return not (self.queue or len(self.pending) or len(self.speeches) or len(self.tts))

    def enqueue(self, text: str, sender: int | None = None) -> None:
        """Add a message of a connection with documents to the queue, or refuse it."""
        if (refused := self.queue.put(text, sender)) is not None:
            self.refuse(refused)

    def _parse_next(self, t: float) -> bool:
        """Prepare the next block of a speech or of the queue. Return False if there is none."""
        if (chunk := self.speeches.next()) is not None:
            self._prepare(chunk, t)
            return True
        item = self.queue.next()
        if isinstance(item, Warning):
            self.refuse(item)
        elif item is not None:
            self._prepare(
                item, t, self.queue.message, cancelled=self.queue.is_cancelled(item), sender=self.queue.sender
            )
        return item is not None

    def stop(self, blocks: Collection[str] | None, t: float) -> set[str]:
        """Cancel blocks that are not planned yet, read or not.

        Args:
            blocks: their ids; None for all.

        Returns:
            The ids of those that had been read.
        """
        self.queue.cancel(blocks)
        for block in self.speeches.cancel(blocks):
            self._prepare(block, t, cancelled=True)
        pending = [w for w in self.pending.blocks if blocks is None or w.block.id in blocks]
        self.withdraw(pending, t)
        return {w.block.id for w in pending}

    def _prepare(
        self,
        block: Block,
        t: float,
        message: int = 0,
        *,
        cancelled: bool = False,
        sender: int | None = None,
    ) -> None:
        """Request the speech of a block and acknowledge it. It is planned when nothing is missing."""
        busy = len(self.pending) + len(self._player.blocks.active())
        fault = block_limit_error(block, self._settings, busy, self._player.characters)
        if fault is not None:
            self.refuse(Warning(block.id, "CANNOT_CREATE_BEHAVIOR", fault), block.character_id)
            return
        try:
            block = self.speeches.with_links(block)
            requests = self._player.speech_requests(block)
            character = self._player.cast.index_of(block.character_id)
            pending = PendingBlock(
                block, character, t, message, self._player.resources, is_incomplete=self.speeches.awaits_sync
            )
            pending.sender = sender
            pending.is_streaming = self.speeches.is_streaming(block)
            self.pending.add(pending)
            self._player.announce(block, t)
        except Exception:
            self._internal(block)
            return
        if cancelled:
            self.withdraw([pending], t)
        else:
            self._request_speech(pending, requests)

    def awaited_by(self, pending: PendingBlock) -> list[str]:
        """Return what a block waits for: other blocks, its own speeches, and syncs of open speeches."""
        blocks = [other.block.id for other in self.pending.blocks if other in pending.predecessors]
        speeches = [f"{pending.block.id}:{id}" for id in self.tts.requested(pending)]
        return list(dict.fromkeys([*blocks, *speeches, *self.speeches.awaited_syncs(pending.block)]))

    def _plan_next(self, t: float) -> bool:
        """Plan the first block that is ready. Return False if there is none."""
        pending = self.pending.first_ready()
        # How much of its message is read before must not depend on when a voice answers.
        if pending is None or (pending.utterances and self.queue and self.queue.message == pending.message):
            return False
        self._message = pending.message
        self._followers = {other for other in self.pending.blocks if pending in other.predecessors}
        try:
            pending.block = self.speeches.with_links(pending.block)
            schedule = self._player.submit(pending.block, t, pending.utterances, pending.sender)
            if schedule.lengths and pending.final:
                # The voice never meets a length exactly, and time has passed: stretch the small difference.
                pending.utterances = stretch_to_fit(pending.utterances, schedule.lengths)
                schedule = self._player.submit(pending.block, t, pending.utterances, pending.sender)
        except Exception:
            self.pending.remove([pending])
            self._internal(pending.block)
            return True
        if schedule.lengths:
            self._request_again(pending, schedule.lengths, t)
            return True
        replaced = self.pending.replaced_by(pending)
        self.pending.remove([pending])
        self.counts["over_limit"] += schedule.over_limit
        if schedule.failed:
            self.speeches.on_refused(pending.block.id)
        else:
            self.speeches.on_planned(pending.block.id)
        if pending.block.composition == "REPLACE" and not schedule.failed:
            self.withdraw(replaced, t)
        return True

    def _request_again(
        self, pending: PendingBlock, lengths: Mapping[str, Mapping[str, float]], t: float
    ) -> None:
        """Request speech again with the lengths that let more of the block fit. The result is final."""
        whole = self._player.speech_requests(pending.block)
        requests = {b: whole[b] for b in self.tts.unfinished(pending)}
        requests |= {b: replace(whole[b], seconds=times["end"]) for b, times in lengths.items()}
        pending.utterances = {b: without_stretch(u) for b, u in pending.utterances.items()}
        pending.waiting_since, pending.final = t, True
        self._request_speech(pending, requests)

    def _request_speech(self, pending: PendingBlock, requests: Mapping[str, SpeechRequest]) -> None:
        voice = self.voices.get(pending.character) or self._settings.voice
        self._add_effects(self.tts.request(pending, requests, voice))

    def withdraw(self, blocks: list[PendingBlock], t: float) -> None:
        """Remove blocks that are not planned yet."""
        for pending in blocks:
            self._player.manager.withdraw(pending.block, t)
            self.speeches.on_refused(pending.block.id)
        self.pending.remove(blocks)

    def end(self, blocks: Collection[str], t: float) -> None:
        """End blocks, whether they play already or not."""
        self.withdraw([w for w in self.pending.blocks if w.block.id in blocks], t)
        self._player.stop(t, blocks)

    def _internal(self, block: Block) -> None:
        log.exception("session %s: block %s failed", self._name, block.id)
        warning = Warning(block.id, "EXECUTION_EXCEPTION", "internal error while planning this block")
        self.refuse(warning, block.character_id)

    def refuse(self, warning: Warning, character: str | None = None) -> None:
        """Publish a warning about a block that is not accepted."""
        self._player.refuse(warning, character)
        self.speeches.on_refused(warning.id)


def block_id_of(message: str) -> str:
    """Return the id of the last block of an unparsed message, for whose end clients wait, or "<no id>"."""
    begin = max(0, *(message.rfind(f"<bml{blank}") for blank in " \t\r\n"))
    match = _BLOCK_ID.search(message, begin, begin + 4096)
    return match[1] if match else "<no id>"
