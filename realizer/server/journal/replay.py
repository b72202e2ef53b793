"""Replay of journal entries into a session."""

from collections.abc import Callable, Iterable

from bml_schema import Block
from realizer.core.errors import RealizerError, VoiceError
from realizer.playback.feedback_events import acknowledgement
from realizer.scheduling.timing import Warning
from realizer.server.documents.document_queue import block_id_of
from realizer.server.journal.entry import Entry, SavedSession
from realizer.server.journal.replay_watch import TRIES, ReplayWatch
from realizer.server.session.effects import Speak
from realizer.server.session.session import Session
from realizer.speech.utterance import Utterance


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
        watch: notes the document that is worked on.

    Returns:
        The speech requests that are not answered yet.
    """
    unanswered: dict[int, Speak] = {}
    for index, entry in enumerate(entries):
        if watch is not None:
            watch.before(session, index, entry)
        session.replay_until(entry.at, before_event)
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
    at = session.restore(saved.parts) if saved.parts else 0.0
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
        seen: sequence number of the last feedback that the client received.

    Returns:
        Seconds on that clock, `now` or later.
    """
    while session.feedback_log.newest < seen and not session.closed:
        if (due := session.player.next_deadline()) is None:
            break
        now = max(now, session.clock.opened + due)
        session.tick(now)
    return now
