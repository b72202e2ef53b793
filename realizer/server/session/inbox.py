"""The inbox of a session: each message of a client is written to the journal, and then handled."""

import json
from dataclasses import dataclass
from typing import get_args

from bml_schema import WarningFeedback
from realizer.playback.player import Player
from realizer.protocol.messages.parse import Control, parse_control
from realizer.protocol.messages.replies import ErrorMessage
from realizer.protocol.messages.requests import Subscribe, Track, Unsubscribe
from realizer.protocol.streams import STREAMS
from realizer.server.documents.document_queue import Submission, block_id_of
from realizer.server.journal.entry import Kind
from realizer.server.journal.session_journal import SessionJournal
from realizer.server.session.connections import Connection, Connections
from realizer.server.session.control_handlers import ControlHandlers
from realizer.server.session.query_handlers import Query, QueryHandlers
from realizer.server.session.tracked_faces import TrackedFaces

# Messages that affect only their own connection: they are not written to the journal.
PASSING = (*get_args(Query), Subscribe, Unsubscribe, Track)
PICTURE = bytes([STREAMS["video"].kind or 0])  # first byte of a picture


@dataclass(eq=False)
class Inbox:
    """The inbox of a session."""

    player: Player
    submission: Submission
    journal: SessionJournal
    connections: Connections
    queries: QueryHandlers
    controls: ControlHandlers
    tracked: TrackedFaces
    ending: bool = False  # whether documents are refused because the service is ending

    def handle(self, connection: Connection, message: str | bytes, t: float) -> bool:
        """Handle a message, or reply with an error. Return whether it was written to the journal.

        Args:
            message: bytes are a picture or a sound clip, text that starts with `{` is control, all else is
                BML.
        """
        if isinstance(message, bytes) and message[:1] == PICTURE:
            self.tracked.picture(connection.id, message, t)
            return False
        control: Control | None = None
        if isinstance(message, str) and (text := message.lstrip("\ufeff \t\r\n")).startswith("{"):
            parsed = parse_control(text, can_save=connection.may_edit)
            if isinstance(parsed, ErrorMessage):
                self.connections.reply(connection.id, parsed)
                return False
            if isinstance(parsed, PASSING):
                self._handle_passing(connection, parsed, t)
                return False
            control = parsed
        is_bml = control is None and isinstance(message, str)
        ending = "the service is ending and takes no more documents" if self.ending and is_bml else None
        kind: Kind = "text" if isinstance(message, str) else "sound"
        if (refused := ending or self.journal.accept(t, kind, connection.id, message)) is not None:
            if is_bml:
                # Without a number: the message is not in the journal, and a session that is restored from the
                # journal must number all other feedback in the same way.
                id = block_id_of(str(message))
                warning = WarningFeedback(id=id, type="CANNOT_CREATE_BEHAVIOR", text=refused)
                self.connections.send_feedback([warning.to_xml()])
            else:
                self.connections.reply(connection.id, ErrorMessage(code="journal", message=refused))
        elif isinstance(message, bytes):
            self.controls.handle_sound(connection, message, t)
        elif control is not None:
            self.controls.handle(connection, control, t)
        else:
            self.submission.enqueue(message)
        return refused is None

    def _handle_passing(self, connection: Connection, control: Control, t: float) -> None:
        """Handle a message that is not written to the journal, except for the characters that it adds."""
        known = self.player.characters
        if isinstance(control, Track):
            self.tracked.start(connection.id, control)
        elif isinstance(control, Query):
            self.queries.handle(connection, control, t)
        else:
            self.controls.handle(connection, control, t)
        for name in self.player.characters:
            if name not in known:  # their order matters: the first is the default
                self.journal.note(t, "text", connection.id, json.dumps({"type": "character", "id": name}))
