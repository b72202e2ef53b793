"""The recovery of a session that has raised an exception: it is built anew from what it has accepted."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from realizer.core.errors import RealizerError
from realizer.scheduling.timing import Warning
from realizer.server.documents.document_queue import block_id_of
from realizer.server.journal.entry import Entry, SavedSession
from realizer.server.journal.replay import ReplayWatch, catch_up, restore_session
from realizer.server.journal.session_journal import SessionJournal
from realizer.server.session.connections import Connection, FeedbackLog
from realizer.server.session.effects import Speak
from realizer.server.session.session import Session
from realizer.server.session.session_clock import SessionClock
from realizer.server.session.tracked_faces import TrackedFaces
from realizer.server.streams.broadcast import Broadcast
from realizer.speech.utterance import Utterance

log = logging.getLogger(__name__)

ATTEMPTS = 3  # replays; each but the last leaves out a message at which the one before has failed


class RecoveryError(RealizerError):
    """A session cannot be recovered."""


class _Progress(ReplayWatch):
    """Which message of a replay is worked on."""

    def __init__(self) -> None:
        super().__init__(self._take)
        self.index = 0  # of the last entry
        self.document: int | None = None  # index of the document that is read or planned

    def _take(self, note: str | None) -> None:
        self.document = self._noted

    def before(self, session: Session, index: int, entry: Entry) -> None:
        self.index = index
        super().before(session, index, entry)


def recover(
    session: Session,
    saved: SavedSession,
    speak: Callable[[Speak], Utterance | RealizerError],
    now: float,
    fault: str,
    *,
    failed_before: bool = False,
) -> tuple[list[Speak], dict[int, Entry]]:
    """Build a session anew from its journal; its clients, their subscriptions, its clock and log stay.

    A document at which the replay fails again is left out, with a warning; another message silently, as its
    sender has got an error.

    Args:
        speak: synthesizes a request again.
        now: seconds on the host's clock.
        fault: what the warnings say.
        failed_before: whether it has been recovered shortly before: then the document that it works on after
            the replay is left out, too.

    Returns:
        The speech requests that are not answered yet, and by index the entries that replace those left out.

    Raises:
        RecoveryError: the replay fails again and again.
    """
    before = _begin_anew(session)
    left_out: dict[int, Entry] = {}
    for attempt in range(ATTEMPTS):
        entries = [
            replace(entry, kind="tick", number=0, body="") if index in left_out else entry
            for index, entry in enumerate(saved.entries)
        ]
        progress = _Progress()
        try:
            at, unanswered = restore_session(session, replace(saved, entries=entries), speak, progress)
            culprit = progress.document if failed_before and attempt == 0 else None
            if culprit is None:
                break
        except Exception:
            log.warning("session %s: its replay fails", session.id, exc_info=attempt + 1 == ATTEMPTS)
            if not saved.entries:
                raise RecoveryError(f"session {session.id}: its checkpoint cannot be restored") from None
            culprit = progress.index if progress.document is None else progress.document
        entry = saved.entries[culprit]
        is_document = isinstance(entry.body, str) and not entry.body.lstrip().startswith("{")
        left_out[culprit] = replace(entry, kind="aside" if is_document else "tick")
        _begin_anew(session)
    else:
        raise RecoveryError(f"session {session.id}: {ATTEMPTS} replays have failed")
    seen = before.log.newest
    catch_up(session, max(at, before.clock.read(now)), seen)
    unanswered += [effect for effect in session.take_effects() if isinstance(effect, Speak)]
    _go_on(session, before, now)
    for entry in left_out.values():
        if entry.kind == "aside":
            session.submission.refuse(Warning(block_id_of(str(entry.body)), "CANNOT_CREATE_BEHAVIOR", fault))
    return unanswered, left_out


class _Remains(NamedTuple):
    """What clients need of the parts of a session that has failed."""

    clock: SessionClock
    log: FeedbackLog
    connections: dict[int, Connection]
    journal: SessionJournal
    tracked: TrackedFaces
    broadcast: Broadcast
    is_ending: bool


def _begin_anew(session: Session) -> _Remains:
    """Make all parts of a session anew, at 0 of a clock; return what clients need of the old ones."""
    remains = _Remains(
        session.clock, session.feedback_log, dict(session.connections), session.journal, session.tracked,
        session.broadcast, session.is_ending,
    )  # fmt: skip
    session.take_effects()
    session.is_ending = False
    session.make_parts(0.0, FeedbackLog(remains.log.epoch))
    return remains


def _go_on(session: Session, remains: _Remains, now: float) -> None:
    """Go on after a replay with the clients, the clock, the feedback log and the journal of before.

    Feedback that the replay has made beyond what was sent is sent; subscriptions go on where they were.
    """
    session.clock.opened, session.is_ending = remains.clock.opened, remains.is_ending
    t, log, replayed = session.clock.read(now), remains.log, session.feedback_log
    log.restore(max(log.newest, replayed.newest), replayed.since(log.newest + 1), t)
    checkpoint, connections = session.journal.checkpoint, session.connections
    session.feedback_log = connections.log = checkpoint.feedback_log = log
    remains.journal.go_on(checkpoint, connections)
    session.journal = remains.journal
    session.tracked.cameras = remains.tracked.cameras
    session.broadcast.counts = session.submission.counts = remains.broadcast.counts
    session.broadcast.overload = remains.broadcast.overload
    connections.replace(remains.connections)
    for connection in connections.values():
        session.subscriptions.renew(connection, t)
    session.broadcast.set_subscribers(connections.values())
    session.take_effects()  # the clients know all of that
    connections.send_unsent_feedback()
