"""The factory of sessions: new ones, and those restored from a journal."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Mapping
from typing import Any

from realizer.behaviours.kind import Position
from realizer.core.errors import RealizerError
from realizer.core.settings import Settings
from realizer.expressions.library import library_of
from realizer.face.fap_mapping import mapping_of
from realizer.server.http.metrics import Metrics
from realizer.server.journal import Journal, JournalError, Recorder, SavedSession, journal_at
from realizer.server.journal.journal_writer import JournalWriter
from realizer.server.journal.recordings import RecordingFolder, head
from realizer.server.journal.replay import catch_up, restore_session
from realizer.server.runtime.session_registry import JoinError
from realizer.server.session.effects import Effect, Speak
from realizer.server.session.session import Session
from realizer.server.session.welcome import capabilities_of
from realizer.speech.utterance import Utterance

log = logging.getLogger(__name__)


class SessionFactory:
    """Makes the sessions of one process.

    Args:
        metrics: counts records that had to stop.

    Attributes:
        journal: what another process goes on from; None: none does.
        ending: sessions take no more documents.
    """

    def __init__(self, settings: Settings, metrics: Metrics) -> None:
        self.journal: Journal | None = None
        self.ending = False
        self._settings = settings
        self._metrics = metrics
        self._record: Recorder | None = None
        self._scene: Mapping[str, Position] | None = None
        self._capabilities: dict[str, Any] = {}

    async def load(self) -> None:
        """What every session shares; raises as `SessionHost.start`."""
        settings, loop = self._settings, asyncio.get_running_loop()
        if settings.journal is not None:
            self.journal = journal_at(settings.journal)
        if settings.scene is not None:
            from realizer.playback.scene_file import parse_scene

            self._scene = parse_scene(settings.scene.read_text("utf-8"))
        if settings.record is not None:
            self._record = RecordingFolder(settings.record, head(settings, self._scene))
        # A face that is not there is said before a door opens.
        from realizer.face.load import load_face

        await loop.run_in_executor(None, lambda: load_face(settings.face, deformer=settings.deformer))
        mapping_of(settings.face, settings.mapping)
        library_of(settings.expressions)
        self._capabilities = await loop.run_in_executor(None, capabilities_of, settings)

    def close(self) -> None:
        """Nothing more is to be kept."""
        for journal in (self.journal, self._record):
            if journal is not None:
                journal.close()

    def new(self, id: str, now: float, named: bool) -> Session:
        """A session that begins now, on the caller's clock; one with a name is kept in the journal.

        Raises:
            HubError: it cannot be kept.
        """
        epoch = time.time()
        session = self._session(id, now, named=named, epoch=epoch)
        session.journal = self._journal_writer(id, self.journal if named else None)
        try:
            session.journal.begin(epoch)
        except JournalError as error:
            raise JoinError(503, str(error)) from None
        return session

    async def restore(
        self, name: str, seen: int, speak: Callable[[Speak], Utterance | RealizerError]
    ) -> tuple[Session, list[Effect]] | None:
        """A session as the journal has it, without its connections; None where it has none of that name.

        Args:
            seen: seq of the feedback that a client had last: the session has come at least so far.
            speak: says again what was said.

        Returns:
            It, and what its shell owes it.

        Raises:
            JournalError: the journal cannot be read.
        """
        if self.journal is None or (kept := self.journal.claim(name)) is None:
            return None
        loop = asyncio.get_running_loop()
        session = self._session(name, 0.0, named=True, epoch=kept.epoch)
        try:
            at, owed = await loop.run_in_executor(None, restore_session, session, kept, speak)
        except JournalError:
            raise
        except Exception:
            log.exception("session %s cannot be gone on with", name)
            raise JournalError(f"session {name} cannot be gone on with: internal error") from None
        session.journal = self._journal_writer(name, self.journal, kept)
        await loop.run_in_executor(None, session.journal.resume, kept)
        at = catch_up(session, at, seen)
        owed += [effect for effect in session.take_effects() if isinstance(effect, Speak)]
        now = loop.time()
        session.opened = now - max(at, time.time() - kept.epoch)
        for connection in session.connections:  # which went with the other process
            session.disconnect(connection, now)
        log.info("session %s is gone on with, %d entries long", name, len(kept.entries))
        return session, owed

    def _session(self, id: str, now: float, *, named: bool, epoch: float) -> Session:
        session = Session(
            id,
            self._settings,
            now,
            named=named,
            scene=self._scene,
            capabilities=self._capabilities,
            epoch=epoch,
        )
        session.ending = self.ending
        return session

    def _journal_writer(
        self, id: str, journal: Journal | None, kept: SavedSession | None = None
    ) -> JournalWriter:
        return JournalWriter(id, journal, self._record, stopped=self._metrics.record_stopped, saved=kept)
