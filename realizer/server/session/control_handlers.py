"""Handlers of the control messages that change a session."""

from __future__ import annotations

from collections.abc import Callable

from realizer.core.errors import FaceError, VoiceError
from realizer.playback.player import Player
from realizer.protocol.messages.common import Reply
from realizer.protocol.messages.parse import Control
from realizer.protocol.messages.replies import ErrorCode, ErrorMessage
from realizer.protocol.messages.requests import (
    Anticipate,
    CharacterMessage,
    SceneMessage,
    SetMessage,
    Stop,
    Subscribe,
    Unsubscribe,
)
from realizer.protocol.messages.speech import SpeechMessage
from realizer.server.documents.document_queue import Submission
from realizer.server.session.character_faces import CharacterFaces
from realizer.server.session.control_fields import FieldError, character_index, direct_values, emotion_values
from realizer.server.session.subscriptions import Subscriptions
from realizer.server.speech.audio_clips import AudioClips, ClipError
from realizer.server.streams.connection import Connection


class ControlHandlers:
    """The handlers of the control messages that change what a session shows or sends.

    Args:
        reply: sends a message to a connection, by its id.
    """

    def __init__(
        self,
        player: Player,
        faces: CharacterFaces,
        clips: AudioClips,
        submission: Submission,
        subscriptions: Subscriptions,
        reply: Callable[[int, Reply], None],
    ) -> None:
        self._player = player
        self._faces = faces
        self._clips = clips
        self._submission = submission
        self._subscriptions = subscriptions
        self._reply = reply

    def handle(self, connection: Connection, message: Control, t: float) -> None:
        """Handle a control message, or reply with an error and change nothing.

        Args:
            t: seconds on the session clock.
        """
        try:
            self._handle(connection, message, t)
        except FieldError as error:
            id = message.id if isinstance(message, SpeechMessage) else None
            self._error(connection, "invalid", error, f"{message.type}.{error.where}", id)
        except ClipError as error:
            self._error(connection, "clip", error, error.where)
        except FaceError as error:
            self._error(connection, "face", error, f"{message.type}.face")
        except VoiceError as error:
            self._error(connection, "voice", error, f"{message.type}.voice")

    def _error(
        self, connection: Connection, code: ErrorCode, error: Exception, where: str, id: str | None = None
    ) -> None:
        self._reply(connection.id, ErrorMessage(code=code, message=str(error), where=where, id=id))

    def _handle(self, connection: Connection, message: Control, t: float) -> None:
        match message:
            case Subscribe():
                self._subscriptions.subscribe(connection, message, t)
            case Unsubscribe():
                self._subscriptions.unsubscribe(connection, message)
            case SceneMessage(objects=objects):
                self._player.set_scene(
                    None if objects is None else {name: (p.x, p.y, p.z) for name, p in objects.items()}
                )
            case CharacterMessage():
                self._character(message)
            case SetMessage():
                self._set(message, t)
            case Anticipate():
                self._player.anticipate(message.id, message.syncs, t)
            case SpeechMessage():
                self._speech(connection, message, t)
            case Stop():
                self._stop(message, t)

    def _stop(self, message: Stop, t: float) -> None:
        """End blocks. A block that has just ended by itself is no error."""
        submission, wanted = self._submission, None if message.blocks is None else set(message.blocks)
        # Unread documents may contain any of the blocks.
        unread = bool(submission.queue)
        known = submission.stop(wanted, t)
        self._player.stop(t, wanted)
        unknown = [
            repr(id[:80])
            for id in message.blocks or ()
            if not (unread or id in known or id in submission.speeches or self._player.blocks.has_seen(id))
        ]
        if unknown:
            raise FieldError("blocks", f"wanted blocks that play or wait, got {', '.join(unknown[:10])}")

    def _speech(self, connection: Connection, message: SpeechMessage, t: float) -> None:
        if message.clip is not None and (message.id is None or _has_annotation(message)):
            self._clips.annotate(message)
        if message.id is None:
            return
        if message.clip is not None and message.clip not in self._clips.recordings:
            raise FieldError("clip", f"wanted a clip that was sent to its last piece, got {message.clip!r}")
        character_index(self._player, message.character)
        self._submission.speeches.handle(message, connection.id, t)

    def _character(self, message: CharacterMessage) -> None:
        if message.face is not None:
            self._faces.check(message.face)
        if message.voice is not None:
            from realizer.speech.registry import find_voice

            find_voice(message.voice).close()  # report an unknown voice now, not with the next speech
        index = character_index(self._player, message.id)
        if message.face is not None:
            self._faces.assigned[index] = message.face
            self._subscriptions.announce_face_change(index)
        if message.voice is not None:
            self._submission.voices[index] = message.voice

    def _set(self, message: SetMessage, t: float) -> None:
        index = character_index(self._player, message.character)
        values = direct_values(message, self._player.direct_names(index))
        if "emotion" in message.model_fields_set:
            self._player.set_emotion(emotion_values(message.emotion), t, index)
        self._player.set_direct(values, t, index)


def _has_annotation(message: SpeechMessage) -> bool:
    """Whether a message describes its clip; one that only names the clip changes no annotation."""
    return bool(message.text is not None or message.words or message.phonemes or message.visemes)
