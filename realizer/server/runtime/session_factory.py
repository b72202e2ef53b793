"""The factory of sessions: new ones, and those restored from a journal, which other processes had."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import logging
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Any
from weakref import WeakValueDictionary

from bml_schema import Emotion
from realizer.behaviours.kind import Position
from realizer.behaviours.registry import KINDS
from realizer.core.errors import RealizerError
from realizer.core.settings import Settings
from realizer.expressions.library import library_of
from realizer.face.fap_mapping import mapping_of
from realizer.server.documents.document_queue import block_id_of
from realizer.server.http.metrics import Metrics
from realizer.server.journal import Entry, Journal, JournalError, TakenOver, journal_at
from realizer.server.journal.entry import NOTE
from realizer.server.journal.memory_journal import MemoryJournal
from realizer.server.runtime.session_registry import JoinError
from realizer.server.session.effects import Speak
from realizer.server.session.query_handlers import capabilities_of
from realizer.server.session.session import Session
from realizer.server.streams.broadcast import Overload
from realizer.speech.utterance import Utterance

if TYPE_CHECKING:
    from realizer.server.journal.recordings import RecordingFolder
    from realizer.server.journal.replay import ReplayNote, ReplayWatch


log = logging.getLogger(__name__)

# A query for so many sessions takes a millisecond or two, which delays no frame.
BATCH = 100


class SessionFactory:
    """The factory of the sessions of one process."""

    def __init__(self, settings: Settings, metrics: Metrics) -> None:
        self.journal: Journal | None = None
        self._memory = MemoryJournal()
        self.ending = False
        self.overload = Overload()
        self._settings = settings
        self._metrics = metrics
        self._recorder: RecordingFolder | None = None
        self._scene: Mapping[str, Position] | None = None
        self._capabilities: dict[str, Any] = {}
        # By session, of replays and what is left of them.
        self._watches: WeakValueDictionary[str, ReplayWatch] = WeakValueDictionary()

    async def load(self) -> None:
        """Load what all sessions share. Raises as `SessionHost.start`."""
        settings, loop = self._settings, asyncio.get_running_loop()
        if settings.journal is not None:
            self.journal = journal_at(settings.journal)
        if settings.scene is not None:
            from realizer.behaviours.gaze_targets import parse_scene

            self._scene = parse_scene(settings.scene.read_text("utf-8"))
        if settings.record is not None:
            from realizer.server.journal.recordings import RecordingFolder, recording_head

            self._recorder = RecordingFolder(settings.record, recording_head(settings, self._scene))
        # Load the face now: a missing one is an error before any transport opens.
        from realizer.face.load import load_face

        await loop.run_in_executor(None, lambda: load_face(settings.face, deformer=settings.deformer))
        # Emotions take half a frame to import: too long for the event loop.
        await loop.run_in_executor(None, KINDS.__getitem__, Emotion.tag)
        mapping_of(settings.face, settings.mapping)
        library_of(settings.library_folder)
        self._capabilities = await loop.run_in_executor(None, capabilities_of, settings)

    def close(self) -> None:
        """Close the journal and the recordings; what is still replayed has not failed."""
        for name, watch in self._watches.items():
            watch.withdraw(functools.partial(self._try_note, name))
        for log_ in (self.journal, self._recorder):
            if log_ is not None:
                log_.close()

    def new(self, id: str, now: float, named: bool) -> Session:
        """Return a session that begins now, on the caller's clock. A named one is added to the journal.

        Raises:
            JoinError: the journal cannot be written.
        """
        epoch = time.time()
        session = self._session(id, now, named=named, epoch=epoch)
        journal = self.journal if named and self.journal is not None else self._memory
        session.journal.open(journal, self._recorder, on_stopped=self._on_recording_stopped)
        try:
            session.journal.begin(epoch)
        except JournalError as error:
            raise JoinError(503, str(error)) from None
        return session

    async def restore(
        self, name: str, seen: int, speak: Callable[[Speak], Utterance | RealizerError]
    ) -> tuple[Session, list[Speak]] | None:
        """Restore a session from the journal, without its connections; None if the journal has none.

        Args:
            seen: sequence number of the last feedback that a client received; the session is advanced to it.

        Returns:
            The session, and the speech requests that are not answered yet.

        Raises:
            JournalError: the journal cannot be read, or the session not be restored.
        """
        if self.journal is None or (saved := self.journal.claim(name)) is None:
            return None
        from realizer.server.journal.replay import TRIES, ReplayNote, ReplayWatch, catch_up, restore_session

        loop = asyncio.get_running_loop()
        last = ReplayNote.read(saved.parts)
        parts = {part: text for part, text in saved.parts.items() if part != NOTE}
        saved = replace(saved, parts=parts)
        if last is not None and last.begun >= TRIES:
            self._put_aside(name, saved.entries, last)
        watch = ReplayWatch(
            lambda text: asyncio.run_coroutine_threadsafe(self._note(name, text), loop).result(), last
        )
        self._watches[name] = watch
        session = self._session(name, 0.0, named=True, epoch=saved.epoch)
        try:
            at, unanswered = await loop.run_in_executor(None, restore_session, session, saved, speak, watch)
        except JournalError:
            raise
        except Exception:
            log.exception("session %s cannot be resumed", name)
            raise JournalError(f"session {name} cannot be resumed: internal error") from None
        watch.write = lambda text: self._try_note(name, text)
        session.journal.open(
            self.journal, self._recorder, on_stopped=self._on_recording_stopped, follow=watch.follow
        )
        await loop.run_in_executor(None, session.journal.resume, saved)
        at = await loop.run_in_executor(None, catch_up, session, at, seen)
        unanswered += [effect for effect in session.take_effects() if isinstance(effect, Speak)]
        now = loop.time()
        session.clock.opened = now - max(at, time.time() - saved.epoch)
        for connection in list(session.connections):  # of the other process
            session.disconnect(connection, now)
        log.info("session %s is resumed, %d entries long", name, len(saved.entries))
        return session, unanswered

    def _put_aside(self, session: str, entries: list[Entry], note: ReplayNote) -> None:
        """Replace a document in the journal by a note that it is left out."""
        assert self.journal is not None
        index = note.entry
        if not index < len(entries) or entries[index].kind != "text":
            return  # the note is not ours
        entries[index] = replace(entries[index], kind="aside")
        self.journal.replace(session, index, entries[index])
        self._metrics.counts["quarantined"] += 1
        log.warning(
            "session %s: block %s, entry %d of the journal, is put aside: %d replays have not ended",
            session, block_id_of(str(entries[index].body)), index, note.begun,
        )  # fmt: skip

    async def _note(self, session: str, text: str | None) -> None:
        """Write a note about the replay. Without it, the replay goes on.

        Raises:
            TakenOver: another process has taken the session over.
        """
        assert self.journal is not None
        try:
            self.journal.note(session, text)
        except TakenOver:
            raise
        except JournalError as error:
            log.warning("session %s: its replay is not noted: %s", session, error)

    def _try_note(self, session: str, text: str | None) -> None:
        """Write a note about the documents that are left from the replay."""
        assert self.journal is not None
        with contextlib.suppress(JournalError):
            self.journal.note(session, text)

    async def taken_over(self, sessions: Iterable[Session]) -> list[Session]:
        """Return those of the named sessions that another process has taken over.

        The journal is queried in a thread, because a server may hang.
        """
        if self.journal is None:
            return []
        loop = asyncio.get_running_loop()
        named = iter([session for session in sessions if session.named and not session.closed])
        lost: list[Session] = []
        while batch := {session.id: session for session in islice(named, BATCH)}:
            try:
                ids = await loop.run_in_executor(None, self.journal.taken_over, batch.keys())
            except JournalError as error:
                log.warning("sessions that other processes have taken over are not known: %s", error)
                break
            # A failed write may have closed one meanwhile.
            lost += [batch[id] for id in ids if not batch[id].closed]
        return lost

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
        session.is_ending = self.ending
        session.broadcast.counts = session.submission.counts = self._metrics.counts
        session.broadcast.overload = self.overload
        return session

    def _on_recording_stopped(self) -> None:
        self._metrics.counts["records_stopped"] += 1
