"""Handlers of the messages that change nothing in a session: hello, save, state and ping."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from realizer.core.settings import Settings
from realizer.expressions.library import library_of
from realizer.playback.player import Player
from realizer.protocol.messages import replies, requests
from realizer.protocol.messages.common import MAX_CONTENT, MAX_CONTROL, MAX_FPS, PICTURES, PROTOCOL
from realizer.protocol.streams import STREAMS
from realizer.server.documents.document_queue import Submission
from realizer.server.documents.limits import MAX_CHARACTERS
from realizer.server.session.character_faces import CharacterFaces
from realizer.server.session.connections import Connection, Connections
from realizer.server.session.effects import MoveConnection, Write

# The limits that are settings `max_NAME`.
NAMED_LIMITS = [name for name in replies.Limits.model_fields if hasattr(Settings, f"max_{name}")]
Query = requests.Hello | requests.Save | requests.StateQuery | requests.Ping
OFF = "wanted a service that saves files: `realizer serve --edit DIR`"
BARRED = "wanted a token for all sessions"


@dataclass(eq=False)
class QueryHandlers:
    """The handlers of the messages that change nothing in a session."""

    id: str
    settings: Settings
    capabilities: Mapping[str, Any]
    player: Player
    faces: CharacterFaces
    submission: Submission
    connections: Connections

    def handle(self, connection: Connection, message: Query, t: float) -> None:
        """Answer a message."""
        match message:
            case requests.Hello():
                self._hello(connection, message, t)
            case requests.StateQuery():
                self.connections.reply(connection.id, self._state(connection, t))
            case requests.Save():
                self._save(connection, message)
            case requests.Ping():
                self.connections.reply(connection.id, replies.Pong(id=message.id, time=t))

    def send_welcome(self, connection: int, t: float, seen: int | None = None) -> None:
        """Send `welcome` to a connection, and the feedback after `seen`."""
        s = self.settings
        changed: dict[str, Any] = {"edit": self.connections[connection].may_edit}
        if s.edit is not None:  # the folder may have changed since the service began
            changed["expressions"] = sorted(library_of(s.library_folder))
        welcome = replies.Welcome(
            session=self.id,
            connection=connection,
            time=t,
            seq=self.connections.log.newest,
            capabilities=replies.Capabilities(
                streams={stream: list(row.encodings) for stream, row in STREAMS.items()},
                pictures=list(PICTURES),
                fps=s.fps,
                corpus=s.corpus is not None,
                **{**self.capabilities, **changed},
            ),
            limits=replies.Limits(
                **{name: getattr(s, f"max_{name}") for name in NAMED_LIMITS},
                control=MAX_CONTROL,
                content=MAX_CONTENT,
                characters=MAX_CHARACTERS,
                picture=s.max_size,
                fps=MAX_FPS,
                keep=s.keep,
            ),
        )
        self.connections.reply(connection, welcome)
        if seen is not None:
            self.connections.send_missed_feedback(connection, seen)

    def _hello(self, connection: Connection, message: requests.Hello, t: float) -> None:
        if message.version != PROTOCOL:
            text = f"wanted version {PROTOCOL} of the protocol, got {message.version}"
            error = replies.ErrorMessage(code="version", message=text, where="hello.version")
            self.connections.reply(connection.id, error)
        elif message.session not in (None, self.id):
            assert message.session is not None
            self.connections.add_effects([MoveConnection(connection.id, message.session, message.seen)])
        else:
            self.send_welcome(connection.id, t, message.seen)

    def _save(self, connection: Connection, message: requests.Save) -> None:
        folder = self.settings.edit
        if folder is None or not connection.may_edit:
            error = replies.ErrorMessage(code="edit", message=OFF if folder is None else BARRED, where="save")
            self.connections.reply(connection.id, error)
        else:
            self.connections.add_effects([Write(connection.id, message, folder)])

    def _state(self, connection: Connection, t: float) -> replies.StateMessage:
        state = self.player.state(t)
        preparing = [
            replies.BlockState(
                id=w.block.id,
                character=w.block.character_id,
                status="IN_PREP",
                waits_for=self.submission.awaited_by(w) or None,
            )
            for w in self.submission.pending.blocks
        ]
        characters = [
            replies.CharacterState(
                face=self.faces.name(index), voice=self.submission.voices.get(index), **face
            )
            for index, face in enumerate(state["characters"])
        ]
        return replies.StateMessage(
            session=self.id,
            time=t,
            blocks=[*(replies.BlockState(**block) for block in state["blocks"]), *preparing],
            characters=characters,
            voice=replies.VoiceState(name=self.settings.voice, fault=self.submission.tts.fault),
            connections=len(self.connections),
            dropped=connection.dropped,
        )


def capabilities_of(settings: Settings) -> dict[str, Any]:
    """Return the capabilities of the service without its streams: names that documents and messages use."""
    from realizer.animation.axis import AU_NAMES
    from realizer.behaviours.registry import KINDS
    from realizer.emotions.words import known_words
    from realizer.face.load import list_faces, load_face
    from realizer.render.cameras import camera_names
    from realizer.render.light import presets
    from realizer.speech.registry import voices
    from realizer.tables.lexemes import face_lexemes, head_lexemes

    return {
        "behaviours": sorted(tag.partition("}")[2] for tag in KINDS),
        "lexemes": {"faceLexeme": sorted(face_lexemes()), "head": sorted(head_lexemes())},
        "emotions": sorted(known_words()),
        "expressions": sorted(library_of(settings.library_folder)),
        "aus": list(AU_NAMES()),
        "faces": [face.name for face in list_faces()],
        "voices": [voice.name for voice in voices() if voice.available],
        "cameras": list(camera_names(load_face(settings.face, deformer=settings.deformer))),
        "lights": list(presets()),
    }
