"""Handlers of the messages that change nothing in a session: hello, save, state and ping."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from realizer.core.settings import Settings
from realizer.playback.player import Player
from realizer.protocol.messages.common import PROTOCOL
from realizer.protocol.messages.replies import (
    BlockState,
    CharacterState,
    ErrorMessage,
    Pong,
    StateMessage,
    VoiceState,
)
from realizer.protocol.messages.requests import Hello, Ping, Save, StateQuery
from realizer.server.documents.document_queue import Submission
from realizer.server.session.character_faces import CharacterFaces
from realizer.server.session.connections import Connections
from realizer.server.session.welcome import build_welcome
from realizer.server.streams.connection import Connection

Query = Hello | Save | StateQuery | Ping
OFF = "wanted a service that saves files: `realizer serve --edit DIR`"
BARRED = "wanted a token for all sessions"


@dataclass(eq=False)
class QueryHandlers:
    """The handlers of the messages that change nothing in a session.

    Attributes:
        id: name of the session.
        capabilities: of the service, for `welcome`.
    """

    id: str
    settings: Settings
    capabilities: Mapping[str, Any]
    player: Player
    faces: CharacterFaces
    submission: Submission
    connections: Connections

    def handle(self, connection: Connection, message: Query, t: float) -> None:
        """Answer a message.

        Args:
            t: seconds on the session clock.
        """
        match message:
            case Hello():
                self._hello(connection, message, t)
            case StateQuery():
                self.connections.reply(connection.id, self._state(connection, t))
            case Save():
                self._save(connection, message)
            case Ping():
                self.connections.reply(connection.id, Pong(id=message.id, time=t))

    def send_welcome(self, connection: int, t: float) -> None:
        """Send `welcome` to a connection."""
        seq = self.connections.log.newest
        capabilities = {**self.capabilities, "edit": self.connections[connection].may_edit}
        welcome = build_welcome(self.id, t, seq, self.settings, capabilities)
        self.connections.reply(connection, welcome)

    def _hello(self, connection: Connection, message: Hello, t: float) -> None:
        if message.version != PROTOCOL:
            text = f"wanted version {PROTOCOL} of the protocol, got {message.version}"
            error = ErrorMessage(code="version", message=text, where="hello.version")
            self.connections.reply(connection.id, error)
        elif message.session not in (None, self.id):
            assert message.session is not None
            self.connections.move(connection.id, message.session, message.seen)
        else:
            self.send_welcome(connection.id, t)
            if message.seen is not None:
                self.connections.send_missed_feedback(connection.id, message.seen)

    def _save(self, connection: Connection, message: Save) -> None:
        folder = self.settings.edit
        if folder is None or not connection.may_edit:
            error = ErrorMessage(code="edit", message=OFF if folder is None else BARRED, where="save")
            self.connections.reply(connection.id, error)
        else:
            self.connections.write(connection.id, message, folder)

    def _state(self, connection: Connection, t: float) -> StateMessage:
        state = self.player.state(t)
        preparing = [
            BlockState(id=w.block.id, character=w.block.character_id, status="IN_PREP")
            for w in self.submission.pending.blocks
        ]
        characters = [
            CharacterState(face=self.faces.name(index), voice=self.submission.voices.get(index), **face)
            for index, face in enumerate(state["characters"])
        ]
        return StateMessage(
            session=self.id,
            time=t,
            blocks=[*(BlockState(**block) for block in state["blocks"]), *preparing],
            characters=characters,
            voice=VoiceState(name=self.settings.voice, fault=self.submission.tts.fault),
            connections=len(self.connections),
            dropped=connection.dropped,
        )
