"""Replay of journal entries into a session."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from realizer.core.errors import RealizerError, VoiceError
from realizer.server.journal.entry import Entry, SavedSession
from realizer.server.session.effects import Effect, Speak
from realizer.server.session.session import Session
from realizer.speech.utterance import Utterance


def replay(
    session: Session,
    entries: Iterable[Entry],
    speak: Callable[[Speak], Utterance | RealizerError],
    look: Callable[[float], None] = lambda t: None,
) -> list[Effect]:
    """Do to a new session what was done to one before.

    Args:
        session: its clock is its caller's: it was opened at 0, and is written for by nobody.
        speak: says it again; a voice says the same twice.
        look: is called with every time at which something happens, before it does.

    Returns:
        What its shell still owes it: what was to be spoken and had not been.
    """
    owed: dict[int, Speak] = {}
    for entry in entries:
        session.replay_until(entry.at, look)
        look(entry.at)
        match entry.kind:
            case "join":
                session.connect(entry.number, entry.at)
            case "leave":
                session.disconnect(entry.number, entry.at)
            case "text" | "sound":
                session.receive(entry.number, entry.body, entry.at)
            case "spoken":
                order = owed.pop(entry.number, None)
                # What was asked for before a checkpoint nobody waits for any more.
                said = None if order is None or entry.body else speak(order)
                session.on_speech(entry.number, said or VoiceError(str(entry.body)), entry.at)
            case "tick":
                session.tick(entry.at)
        for effect in session.take_effects():
            if isinstance(effect, Speak):
                owed[effect.id] = effect
    return list(owed.values())


def restore_session(
    session: Session, saved: SavedSession, speak: Callable[[Speak], Utterance | RealizerError]
) -> tuple[float, list[Effect]]:
    """Let a new session be what a journal has kept, up to the last entry; as `replay`.

    Returns:
        Seconds on its clock, and what its shell owes it.

    Raises:
        JournalError: its checkpoint cannot be read.
    """
    at = session.restore(saved.parts) if saved.parts else 0.0
    owed = replay(session, saved.entries, speak)
    return saved.entries[-1].at if saved.entries else at, owed


def catch_up(session: Session, now: float, seen: int) -> float:
    """Let time pass until a session has told again what somebody has seen of it already.

    The clock that says how much has passed may be another machine's, or have been set back.

    Args:
        now: seconds on its caller's clock.
        seen: seq of the feedback that its client had last.

    Returns:
        Seconds on that clock, as late as it must be.
    """
    while session.feedback_log.newest < seen and not session.closed:
        if (due := session.player.next_deadline()) is None:
            break
        now = max(now, session.opened + due)
        session.tick(now)
    return now
