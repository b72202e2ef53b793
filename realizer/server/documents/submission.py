"""The submission of documents to the player."""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace

from bml_schema import Block
from realizer.core.settings import Settings
from realizer.pipeline import as_it_is, warped
from realizer.playback.player import Player
from realizer.scheduling.timing import Warning
from realizer.server.documents.document_queue import Inbox, Stopped
from realizer.server.documents.limits import beyond
from realizer.server.documents.pending_blocks import Preparation, Waiting
from realizer.server.documents.tts_requests import Orders
from realizer.server.session.effects import Effect
from realizer.server.speech.speech_streams import Speeches
from realizer.speech.utterance import Say

log = logging.getLogger(__name__)


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
            wants = self._player.wants(block)
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
                waiting.utterances = warped(waiting.utterances, schedule.lengths)
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
        wants = self._player.wants(waiting.block)
        again = {b: wants[b] for b in self.orders.unfinished(waiting)}
        again |= {b: replace(wants[b], seconds=times["end"]) for b, times in lengths.items()}
        waiting.utterances = {b: as_it_is(u) for b, u in waiting.utterances.items()}
        waiting.since, waiting.final = t, True
        self._speak(waiting, again)

    def _speak(self, waiting: Waiting, wants: Mapping[str, Say]) -> None:
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

    def _beyond_limits(self, block: Block) -> str | None:
        busy = len(self.preparation) + self._player.alive
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
