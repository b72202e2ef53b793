"""Replay of journal entries into a session, with notes about the document that is worked on."""

import json
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from bml_schema import Block
from realizer.core.errors import RealizerError, VoiceError
from realizer.playback.feedback_events import acknowledgement
from realizer.scheduling.timing import Warning
from realizer.server.documents.document_queue import block_id_of
from realizer.server.journal.entry import NOTE, Entry, SavedSession
from realizer.server.session.effects import Speak
from realizer.server.session.session import Session
from realizer.speech.utterance import Utterance

TRIES = 2  # a document whose replay was begun so often, and never ended, is put aside
STALLS = 10.0  # s; a document that takes longer stalls its replay


@dataclass(frozen=True, slots=True)
class ReplayNote:
    """A note in the journal about the document that a replay works on."""

    entry: int  # its index among the entries
    begun: int  # how many replays have begun it without an end

    def text(self) -> str:
        """Return the part of the journal."""
        return json.dumps({"entry": self.entry, "begun": self.begun})

    @classmethod
    def read(cls, parts: Mapping[str, str]) -> "ReplayNote | None":
        """Return the note in the parts of a journal, or None."""
        try:
            data = json.loads(parts[NOTE])
            return cls(int(data["entry"]), int(data["begun"]))
        except (KeyError, TypeError, ValueError):
            return None


class ReplayWatch:
    """Notes in the journal which document a session works on until it has planned all of the journal's.

    Args:
        write: stores the text of a note, or deletes it (None).
        last: the note that the replay before left behind.
    """

    def __init__(
        self,
        write: Callable[[str | None], None],
        last: ReplayNote | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.write = write
        self._last = last
        self._clock = clock
        self._since = 0.0  # when the document was noted
        self._session: Session | None = None
        self._noted: int | None = None
        self._entries: dict[int, int] = {}  # number of a message with documents -> index of its entry

    def before(self, session: Session, index: int, entry: Entry) -> None:
        """Note the document that the session works on when it takes an entry: an earlier one, or this."""
        self._session = session
        if entry.kind == "text":
            self._entries[session.submission.queue.received + 1] = index
        if (unfinished := self._unfinished()) is not None:
            self._note(unfinished)
        elif entry.kind == "text":
            self._note(index)

    def follow(self) -> bool:
        """Note the document that is worked on next. Return False if those of the journal are all planned."""
        unfinished = self._unfinished()
        self._note(unfinished)
        return unfinished is not None

    def withdraw(self, write: Callable[[str | None], None]) -> None:
        """Withdraw the note as the process ends in order, unless its document has stalled the replay."""
        if self._noted is not None and self._clock() - self._since < STALLS:
            write(None if self._last is None else self._last.text())

    def _unfinished(self) -> int | None:
        """Return the entry of the first document that is not planned and does not wait for a client."""
        if self._session is None or self._session.closed:
            return None
        submission = self._session.submission
        messages = [
            pending.message
            for pending in submission.pending.blocks
            if not (pending.is_streaming or pending.is_incomplete(pending.block))
        ]
        messages += [submission.queue.message] if submission.queue else []
        return next((self._entries[number] for number in messages if number in self._entries), None)

    def _note(self, index: int | None) -> None:
        if index == self._noted:
            return
        self._noted, self._since = index, self._clock()
        if index is None:
            self.write(None)
            return
        last = self._last
        begun = last.begun if last is not None and last.entry == index else 0
        self.write(ReplayNote(index, begun + 1).text())


def replay(
    session: Session,
    entries: Iterable[Entry],
    speak: Callable[[Speak], Utterance | RealizerError],
    before_event: Callable[[float], None] = lambda t: None,
    watch: ReplayWatch | None = None,
) -> list[Speak]:
    """Replay entries into a session.

    Args:
        session: a new one without a journal, opened at 0 of the caller's clock.
        speak: synthesizes a request again; it must return what it returned the first time.
        before_event: is called with the time of each event, before it.

    Returns:
        The speech requests that are not answered yet.
    """
    unanswered: dict[int, Speak] = {}
    for index, entry in enumerate(entries):
        if watch is not None:
            watch.before(session, index, entry)
        replay_until(session, entry.at, before_event)
        before_event(entry.at)
        match entry.kind:
            case "join":
                session.connect(entry.number, entry.at)
            case "leave":
                session.disconnect(entry.number, entry.at)
            case "text" | "sound":
                session.receive(entry.number, entry.body, entry.at)
            case "spoken":
                request = unanswered.pop(entry.number, None)
                # A request from before the checkpoint is unknown. No block waits for it: an error will do.
                speech = None if request is None or entry.body else speak(request)
                session.on_speech(entry.number, speech or VoiceError(str(entry.body)), entry.at)
            case "tick":
                session.tick(entry.at)
            case "aside":
                put_aside(session, str(entry.body), entry.at)
        for effect in session.take_effects():
            if isinstance(effect, Speak):
                unanswered[effect.id] = effect
    return list(unanswered.values())


def replay_until(
    session: Session, t: float, before: Callable[[float], None] = lambda t: None, *, since: float = 0.0
) -> None:
    """Publish the feedback of a session that is due before `t`, each at its own time.

    Args:
        before: called with each of those times, before the feedback is published.
        since: the time of feedback that is due immediately.
    """
    while (due := session.player.next_deadline()) is not None and due < t and not session.closed:
        due = max(due, since)
        if session.clock.stands_still(due):
            return  # it was published when the documents of a message had been planned
        before(due)
        session.ticker.publish(due)


def restore_checkpoint(session: Session, parts: Mapping[str, str]) -> float:
    """Restore the state and the connections of a checkpoint. The session must be new and opened at 0.

    Args:
        parts: the parts of the checkpoint, as in `SavedSession`.

    Returns:
        The time of the checkpoint on the session clock.

    Raises:
        JournalError: the parts are invalid, or of another version.
    """
    at, connections = session.journal.checkpoint.read(session.id, parts)
    for connection in connections:
        session.connect(connection, at)
    return at


def restore_session(
    session: Session,
    saved: SavedSession,
    speak: Callable[[Speak], Utterance | RealizerError],
    watch: ReplayWatch | None = None,
) -> tuple[float, list[Speak]]:
    """Restore a new session from a journal; arguments as of `replay`.

    Returns:
        The session clock at the last entry, in seconds, and the speech requests that are not answered yet.

    Raises:
        JournalError: the checkpoint cannot be read.
    """
    at = restore_checkpoint(session, saved.parts) if saved.parts else 0.0
    unanswered = replay(session, saved.entries, speak, watch=watch)
    if watch is not None:
        watch.follow()
    return saved.entries[-1].at if saved.entries else at, unanswered


def put_aside(session: Session, text: str, at: float) -> None:
    """Acknowledge a document, as its first reading did, and publish that it is left out."""
    block = Block(id=block_id_of(text))
    session.feedback_log.add(acknowledgement(block, at), at)
    words = f"it is put aside, because the service ended or stalled {TRIES} times when it played it again"
    session.submission.refuse(Warning(block.id, "CANNOT_CREATE_BEHAVIOR", words))
    session.tick(at)


def catch_up(session: Session, now: float, seen: int) -> float:
    """Advance a restored session until it has repeated the feedback that a client has already seen.

    Needed because the clock that says how much time has passed may be another host's, or have been set back.

    Args:
        now: seconds on the caller's clock.

    Returns:
        Seconds on that clock, `now` or later.
    """
    while session.feedback_log.newest < seen and not session.closed:
        if (due := session.player.next_deadline()) is None:
            break
        now = max(now, session.clock.opened + due)
        session.tick(now)
    return now
