"""The documents of a session until their blocks play: they are read, spoken, then submitted."""

from __future__ import annotations

import logging
import re
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from bml_schema import Block, BMLError, BMLSizeError, read
from realizer.behaviours.registry import VOCABULARY
from realizer.core.settings import Settings, raises
from realizer.playback.feedback_events import parse_warning
from realizer.playback.player import Player
from realizer.playback.speaking import stretch_to_fit, without_stretch
from realizer.scheduling.timing import Warning
from realizer.server.documents.limits import beyond, too_large
from realizer.server.documents.pending_blocks import Preparation, Waiting
from realizer.server.documents.tts_requests import Orders
from realizer.server.session.effects import Effect
from realizer.server.speech.speech_streams import Speeches
from realizer.speech.utterance import SpeechRequest

log = logging.getLogger(__name__)

_BLOCK_ID = re.compile(r"<(?:\w+:)?bml\b[^<>]*?\bid\s*=\s*[\"']([^\"'<>]{1,256})[\"']")


@dataclass(frozen=True, slots=True)
class Stopped:
    """A block that somebody stopped after it had come and before it was read."""

    block: Block


class Inbox:
    """Documents that have come and are not prepared yet: no more messages than blocks may wait."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._unread: deque[Iterator[Block | BMLError]] = deque()
        self._came = 0  # so many messages
        self._all_stopped = 0  # every block up to that message
        self._stopped: dict[str, int] = {}  # a block -> if it is in a message up to that one

    def __bool__(self) -> bool:
        return bool(self._unread)

    def put(self, text: str) -> Warning | None:
        """Take a message; or say why it is not taken."""
        limits = self._settings
        if len(self._unread) >= limits.max_blocks:
            words = f"{limits.max_blocks} messages wait to be read: wanted fewer at a time"
            return Warning(name_of(text), "PARSING_FAILURE", f"{words} {raises('max_blocks')}")
        if (beyond := too_large(text, limits)) is not None:
            return Warning(name_of(text), "PARSING_FAILURE", beyond)
        found = read(text, VOCABULARY, max_bytes=limits.max_document, max_behaviours=limits.max_behaviours)
        self._unread.append(found)
        self._came += 1
        return None

    def stop(self, blocks: Iterable[str] | None) -> None:
        """Let none of these, or of all (None), play that have come so far and are not read."""
        if not self._unread:
            return
        if blocks is None:
            self._all_stopped = self._came
        else:
            self._stopped |= dict.fromkeys(blocks, self._came)

    def next(self) -> Block | Stopped | Warning | None:
        """The next block, or why there is none; None where all is read."""
        while self._unread:
            try:
                item = next(self._unread[0], None)
            except Exception:
                log.exception("a document could not be read")
                self._unread.popleft()
                return Warning("<no id>", "PARSING_FAILURE", "internal error while reading")
            if isinstance(item, Block):
                number = self._came - len(self._unread) + 1
                stopped = number <= max(self._all_stopped, self._stopped.get(item.id, 0))
                return Stopped(item) if stopped else item
            if item is not None:
                refused = parse_warning(item)
                if isinstance(item, BMLSizeError):  # of behaviours: the bytes were counted before
                    refused = replace(refused, text=f"{refused.text} {raises('max_behaviours')}")
                return refused
            self._unread.popleft()
        self._stopped.clear()
        return None

    def clear(self) -> None:
        """Nobody wants it any more."""
        self._unread.clear()


class Intake:
    """What a session does with documents until they play.

    Args:
        name: of the session.
        owe: takes what is to be done for them.

    Attributes:
        voices: index of a character -> the voice it was given.
    """

    def __init__(
        self, name: str, settings: Settings, player: Player, owe: Callable[[Iterable[Effect]], None]
    ) -> None:
        self.voices: dict[int, str] = {}
        self.preparation = Preparation()
        self.speeches = Speeches(player)
        self.orders = Orders(player, self.preparation)
        self.inbox = Inbox(settings)
        self._name = name
        self._settings = settings
        self._player = player
        self._owe = owe

    @property
    def ready(self) -> bool:
        """Something can be read or planned at once."""
        return bool(self.inbox or self.speeches.has_next or self.preparation.has_ready)

    @property
    def resting(self) -> bool:
        """Nothing is being read, spoken, prepared or said piece by piece."""
        return not (self.inbox or len(self.preparation) or len(self.speeches) or len(self.orders))

    def put(self, text: str, t: float) -> None:
        """Take a message with documents, or refuse it."""
        if (refused := self.inbox.put(text)) is not None:
            self.refuse(refused, t)

    def read_one(self, t: float) -> bool:
        """Prepare what comes next in a speech, or in the inbox; False where there is nothing."""
        item = self.speeches.next() or self.inbox.next()
        if isinstance(item, Warning):
            self.refuse(item, t)
        elif isinstance(item, Stopped):
            self._prepare(item.block, t, stopped=True)
        elif item is not None:
            self._prepare(item, t)
        return item is not None

    def stop(self, blocks: Collection[str] | None, t: float) -> set[str]:
        """Give up what is not planned yet, read or not.

        Args:
            blocks: which; None for all.

        Returns:
            Those that had been read.
        """
        self.inbox.stop(blocks)
        for block in self.speeches.held_back(blocks):
            self._prepare(block, t, stopped=True)
        waiting = [w for w in self.preparation.waiting if blocks is None or w.block.id in blocks]
        self.withdraw(waiting, t)
        return {w.block.id for w in waiting}

    def _prepare(self, block: Block, t: float, *, stopped: bool = False) -> None:
        """Ask for the block's voice and acknowledge it; it is planned when nothing is missing."""
        if (fault := self._beyond_limits(block)) is not None:
            self.refuse(Warning(block.id, "CANNOT_CREATE_BEHAVIOR", fault), t, block.character_id)
            return
        try:
            block = self.speeches.placed(block)
            wants = self._player.speech_requests(block)
            character = self._player.character_index(block.character_id)
            waiting = self.preparation.add(block, character, {}, t)
            waiting.lacks, waiting.flows = self.speeches.lacks, self.speeches.flows(block)
            self._player.announce(block, t)
        except Exception:
            self._internal(block, t)
            return
        if stopped:
            self.withdraw([waiting], t)
        else:
            self._speak(waiting, wants)

    def submit_ready(self, t: float) -> bool:
        """Plan the first block that waits for nothing; False where all wait."""
        waiting = self.preparation.ready()
        if waiting is None:
            return False
        try:
            waiting.block = self.speeches.placed(waiting.block)
            schedule = self._player.submit(waiting.block, t, waiting.utterances)
            if schedule.lengths and waiting.final:
                # Time has passed while the voice spoke, and it never comes exactly: what is left is little.
                waiting.utterances = stretch_to_fit(waiting.utterances, schedule.lengths)
                schedule = self._player.submit(waiting.block, t, waiting.utterances)
        except Exception:
            self.preparation.remove([waiting])
            self._internal(waiting.block, t)
            return True
        if schedule.lengths:
            self._speak_again(waiting, schedule.lengths, t)
            return True
        self.preparation.remove([waiting])
        if schedule.failed:
            self.speeches.refused(waiting.block.id)
        else:
            self.speeches.planned(waiting.block.id)
        if waiting.block.composition == "REPLACE" and not schedule.failed:
            self.withdraw(self.preparation.replaced_by(waiting), t)
        return True

    def _speak_again(self, waiting: Waiting, lengths: Mapping[str, Mapping[str, float]], t: float) -> None:
        """More of the block fits if its speech lasts so long; what comes back is taken as it is."""
        wants = self._player.speech_requests(waiting.block)
        again = {b: wants[b] for b in self.orders.unfinished(waiting)}
        again |= {b: replace(wants[b], seconds=times["end"]) for b, times in lengths.items()}
        waiting.utterances = {b: without_stretch(u) for b, u in waiting.utterances.items()}
        waiting.since, waiting.final = t, True
        self._speak(waiting, again)

    def _speak(self, waiting: Waiting, wants: Mapping[str, SpeechRequest]) -> None:
        """Order what a voice has to say."""
        voice = self.voices.get(waiting.character) or self._settings.voice
        chosen = {b: replace(say, voice=say.voice or voice) for b, say in wants.items()}
        self._owe(self.orders.place(waiting, chosen))

    def withdraw(self, gone: list[Waiting], t: float) -> None:
        """Give up blocks that are not planned yet."""
        for waiting in gone:
            self._player.withdraw(waiting.block, t)
            self.speeches.refused(waiting.block.id)
        self.preparation.remove(gone)

    def end(self, blocks: Collection[str], t: float) -> None:
        """End blocks, whether they play already or not."""
        self.withdraw([w for w in self.preparation.waiting if w.block.id in blocks], t)
        self._player.stop(t, blocks)

    def _beyond_limits(self, block: Block) -> str | None:
        busy = len(self.preparation) + self._player.active_count
        return beyond(block, self._settings, busy, self._player.characters)

    def _internal(self, block: Block, t: float) -> None:
        """A bug: the traceback is ours, the client gets the block's id."""
        log.exception("session %s: block %s failed", self._name, block.id)
        text = "internal error while planning this block"
        self.refuse(Warning(block.id, "EXECUTION_EXCEPTION", text), t, block.character_id)

    def refuse(self, warning: Warning, t: float, character: str | None = None) -> None:
        """Report what is not taken."""
        self._player.refuse(warning, t, character)
        self.speeches.refused(warning.id)


def name_of(message: str) -> str:
    """The block id of a document that is not parsed, where it can be read near its start."""
    found = _BLOCK_ID.search(message, 0, 4096)
    return found.group(1) if found else "<no id>"
