"""Handlers of the control messages."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import get_args

from realizer.core.errors import FaceError, PluginError, VoiceError
from realizer.playback.player import Player
from realizer.protocol.messages import requests
from realizer.protocol.messages.common import Reply
from realizer.protocol.messages.replies import ErrorCode, ErrorMessage
from realizer.protocol.messages.speech import SpeechMessage
from realizer.protocol.wire import ClipPiece, WireError, unpack_clip
from realizer.server.documents.document_queue import Submission
from realizer.server.session.character_faces import CharacterFaces
from realizer.server.session.connections import Connection
from realizer.server.session.control_fields import FieldError, character_index, direct_values, emotion_values
from realizer.server.session.query_handlers import Query, QueryHandlers
from realizer.server.session.subscriptions import Subscriptions
from realizer.server.session.tracked_faces import TrackedFaces
from realizer.server.speech.audio_clips import HEARD, AudioClips, ClipError, heard_samples
from realizer.server.speech.speech_streams import PATIENCE

# Messages that affect only their own connection: they are not written to the journal.
PASSING = (*get_args(Query), requests.Subscribe, requests.Unsubscribe, requests.Track)


@dataclass(eq=False)
class ControlHandlers:
    """The handlers of the control messages of a session."""

    player: Player
    faces: CharacterFaces
    clips: AudioClips
    submission: Submission
    subscriptions: Subscriptions
    queries: QueryHandlers
    tracked: TrackedFaces
    reply: Callable[[int, Reply], None]

    def handle(self, connection: Connection, message: requests.Control, t: float) -> None:
        """Handle a control message, or reply with an error and change nothing (`stop`: see `_stop`)."""
        characters = self.player.characters
        id = message.id if isinstance(message, SpeechMessage) else None
        try:
            self._handle(connection, message, t)
            return
        except ClipError as error:
            answer = _error("clip", error, error.where, id)
        except FieldError as error:
            answer = _error("invalid", error, f"{message.type}.{error.where}", id)
        except FaceError as error:
            answer = _error("face", error, f"{message.type}.face")
        except VoiceError as error:
            answer = _error("voice", error, f"{message.type}.voice")
        except PluginError as error:
            answer = _error("unsupported", error, message.type)
        self.player.cast.drop_new(characters)
        self.reply(connection.id, answer)

    def _handle(self, connection: Connection, message: requests.Control, t: float) -> None:
        match message:
            case requests.Subscribe():
                self.subscriptions.subscribe(connection, message, t)
            case requests.Unsubscribe():
                self.subscriptions.unsubscribe(connection, message)
            case requests.SceneMessage(objects=objects):
                self.player.set_scene(
                    None if objects is None else {name: (p.x, p.y, p.z) for name, p in objects.items()}
                )
            case requests.CharacterMessage():
                self._character(message)
            case requests.SetMessage():
                self._set(message, t)
            case requests.Heard(speaking=speaking, text=text):
                index = character_index(self.player.cast, message.character)
                self.player.hear(t, is_speaking=speaking, text=text, character=index)
            case requests.Anticipate():
                self.player.anticipate(message.id, message.syncs, t)
            case SpeechMessage():
                self._speech(connection, message, t)
            case requests.Stop():
                self._stop(message, t)
            case requests.Track():
                self.tracked.start(connection.id, message)
            case _:
                self.queries.handle(connection, message, t)

    def handle_sound(self, connection: Connection, message: bytes, t: float) -> None:
        """Add a piece of a sound clip, or reply with an error."""
        try:
            piece = unpack_clip(message)
            if piece.id.startswith(HEARD):
                self._hear(piece, t)
            else:
                self._clip_piece(piece, t)
        except WireError as error:
            self.reply(connection.id, ErrorMessage(code="unsupported", message=str(error)))
        except FieldError as error:
            self.reply(connection.id, _error("clip", error, error.where))

    def _clip_piece(self, piece: ClipPiece, t: float) -> None:
        try:
            self.clips.add_chunk(piece)
        except ClipError as error:
            self._speak_parts(piece.id, t, is_last=True, fault=str(error))
            raise
        self._speak_parts(piece.id, t, is_last=piece.final)

    def _speak_parts(self, clip: str, t: float, *, is_last: bool, fault: str | None = None) -> None:
        """Pass on what has arrived of a clip to the speech that waits for it.

        Args:
            fault: why no more of it will come.
        """
        speeches = self.submission.speeches
        wanted = speeches.parts_wanted(clip, t)
        if wanted < 0:
            self.clips.unfollow(clip)
        elif wanted or is_last:
            parts = self.clips.next_parts(clip, is_last=is_last)
            said = None if fault is None else f"clip {clip!r}: {fault}"
            speeches.add_parts(clip, parts, is_last=is_last, fault=said)

    def on_disconnect(self, connection: int, t: float) -> None:
        """Close the speeches of a connection that has left; the rest of what it sent is spoken."""
        for clip in self.submission.speeches.arriving(connection):
            self._speak_parts(clip, t, is_last=True, fault="its last piece was not sent")
        self.submission.speeches.on_disconnect(connection)

    def end_overdue_clips(self, t: float) -> None:
        """Speak clips of which nothing has come for long without their rest."""
        for clip in self.submission.speeches.overdue(t):
            self._speak_parts(clip, t, is_last=True, fault=f"no piece of it has come for {PATIENCE:g} s")

    def _hear(self, piece: ClipPiece, t: float) -> None:
        sound = heard_samples(piece)
        index = character_index(self.player.cast, piece.id.removeprefix(HEARD) or None)
        self.player.hear_sound(sound, piece.rate, t, is_last=piece.final, character=index)

    def _stop(self, message: requests.Stop, t: float) -> None:
        """End blocks. A block that has just ended by itself is no error.

        Unknown blocks are an error, but the others end: someone who stops a face must not hear it speak on.
        """
        submission, wanted = self.submission, None if message.blocks is None else set(message.blocks)
        # Unread documents may contain any of the blocks.
        unread = bool(submission.queue)
        known = submission.stop(wanted, t)
        self.player.stop(t, wanted)
        unknown = [
            repr(id[:80])
            for id in message.blocks or ()
            if not (unread or id in known or id in submission.speeches or self.player.blocks.has_seen(id))
        ]
        if unknown:
            more = "" if len(unknown) == len(message.blocks or ()) else "; the others were stopped"
            text = f"wanted blocks that play or wait, got {', '.join(unknown[:10])}{more}"
            raise FieldError("blocks", text)

    def _speech(self, connection: Connection, message: SpeechMessage, t: float) -> None:
        annotates = message.clip is not None and (message.id is None or message.describes_clip)
        if message.id is not None:
            if message.clip is not None:
                self.clips.check(message, annotates=annotates)
            character_index(self.player.cast, message.character)
            self.submission.speeches.check(message)
        if annotates:
            self.clips.annotate(message)
        if message.id is not None:
            is_arriving = message.clip is not None and self.clips.follow(message.clip)
            self.submission.speeches.handle(message, connection.id, t, is_arriving=is_arriving)
            if is_arriving:
                self._speak_parts(message.clip or "", t, is_last=False)

    def _character(self, message: requests.CharacterMessage) -> None:
        if message.face is not None:
            self.faces.check(message.face)
        if message.voice is not None:
            from realizer.speech.registry import find_voice

            find_voice(message.voice).close()  # report an unknown voice now, not with the next speech
        index = character_index(self.player.cast, message.id)
        if message.face is not None:
            self.faces.assigned[index] = message.face
            self.subscriptions.announce_face_change(index)
        if message.voice is not None:
            self.submission.voices[index] = message.voice

    def _set(self, message: requests.SetMessage, t: float) -> None:
        index = character_index(self.player.cast, message.character)
        values = direct_values(message, self.player.direct_names(index))
        if "emotion" in message.model_fields_set:
            self.player.set_emotion(emotion_values(message.emotion), t, index)
        self.player.set_direct(values, t, index)


def _error(code: ErrorCode, error: Exception, where: str, id: str | None = None) -> ErrorMessage:
    return ErrorMessage(code=code, message=str(error), where=where, id=id)
