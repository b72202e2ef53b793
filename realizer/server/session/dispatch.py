"""Messages in, each kept before it is followed: bytes are sound, `{` begins control, all else is BML."""

from __future__ import annotations

import json
import logging
from typing import TYPE_CHECKING

from bml_schema import WarningFeedback
from realizer.protocol.messages.parse import Control, parse_control
from realizer.protocol.messages.replies import ErrorMessage
from realizer.protocol.messages.requests import Hello, Ping, StateQuery, Subscribe, Unsubscribe
from realizer.protocol.wire import WireError, unpack_clip
from realizer.server.documents.document_queue import name_of
from realizer.server.journal import JournalError, Lost
from realizer.server.journal.entry import Kind
from realizer.server.session.control_handlers import follow
from realizer.server.speech.audio_clips import ClipError
from realizer.server.streams.connection import Connection

if TYPE_CHECKING:
    from realizer.server.session.session import Session

log = logging.getLogger(__name__)

# Messages that change nothing for others, nor for who comes later.
PASSING = (Hello, Ping, StateQuery, Subscribe, Unsubscribe)


def take(session: Session, connection: Connection, message: str | bytes, t: float) -> bool:
    """Do what a message asks for, or tell its client why not.

    Args:
        t: seconds on the session clock.

    Returns:
        Whether it is in the journal.
    """
    if isinstance(message, bytes):
        return _sound(session, connection, message, t)
    if (text := message.lstrip("\ufeff \t\r\n")).startswith("{"):
        control = parse_control(text)
        if isinstance(control, ErrorMessage):
            session.reply(connection.id, control)
            return False
        return _control(session, connection, control, message, t)
    if session.ending:
        words: str | None = "the service is ending and takes no more documents"
    else:
        words = _kept(session, t, "text", connection, message)
    if words is None:
        session.intake.put(message, t)
    else:
        # Not by the player, which would number it: it is not in the journal, and who goes on with the
        # session from there would number all else otherwise.
        told = WarningFeedback(id=name_of(message), type="CANNOT_CREATE_BEHAVIOR", text=words)
        session.tell(told.to_xml())
    return words is None


def _sound(session: Session, connection: Connection, message: bytes, t: float) -> bool:
    if (words := _kept(session, t, "sound", connection, message)) is not None:
        session.reply(connection.id, ErrorMessage(code="journal", message=words))
        return False
    try:
        session.clips.take(unpack_clip(message))
    except WireError as error:
        session.reply(connection.id, ErrorMessage(code="unsupported", message=str(error)))
    except ClipError as error:
        session.reply(connection.id, ErrorMessage(code="clip", message=str(error), where=error.where))
    return True


def _control(session: Session, connection: Connection, control: Control, message: str, t: float) -> bool:
    if isinstance(control, PASSING):
        known = session.player.characters
        follow(session, connection, control, t)
        for name in session.player.characters:
            if name not in known:  # who is named first is who moves where nobody is named
                session.note(t, "text", connection.id, json.dumps({"type": "character", "id": name}))
        return False
    if (words := _kept(session, t, "text", connection, message)) is not None:
        session.reply(connection.id, ErrorMessage(code="journal", message=words))
        return False
    follow(session, connection, control, t)
    return True


def _kept(session: Session, t: float, kind: Kind, connection: Connection, message: str | bytes) -> str | None:
    """None once a message is in the journal; otherwise why it is not taken."""
    try:
        session.notes.keep(t, kind, connection.id, message)
    except Lost as error:
        session.lose(error)
        return str(error)
    except JournalError as error:
        log.error("session %s: %s", session.id, error)
        return f"this could not be kept, so it is not taken: {error}"
    return None
