"""Control messages: what each of them does to a session, and what it is answered."""

from __future__ import annotations

from typing import TYPE_CHECKING

from realizer.core.errors import FaceError, VoiceError
from realizer.protocol.messages.common import PROTOCOL
from realizer.protocol.messages.parse import Control
from realizer.protocol.messages.replies import (
    BlockState,
    CharacterState,
    ErrorMessage,
    Pong,
    StateMessage,
    VoiceState,
)
from realizer.protocol.messages.requests import (
    Anticipate,
    CharacterMessage,
    Hello,
    Ping,
    SceneMessage,
    SetMessage,
    StateQuery,
    Stop,
    Subscribe,
    Unsubscribe,
)
from realizer.protocol.messages.speech import SpeechMessage
from realizer.server.session.control_fields import Wrong, feeling_of, held, index_of
from realizer.server.session.subscriptions import subscribe, tell_face, unsubscribe
from realizer.server.speech.audio_clips import ClipError
from realizer.server.speech.speech_streams import SpeechError
from realizer.server.streams.connection import Connection

if TYPE_CHECKING:
    from realizer.server.session.session import Session


def follow(session: Session, connection: Connection, message: Control, t: float) -> None:
    """Do what a control message asks; one that cannot be followed is answered by an error alone.

    Args:
        t: seconds on the session clock.
    """
    try:
        match message:
            case Hello():
                _hello(session, connection, message, t)
            case Subscribe():
                subscribe(session, connection, message, t)
            case Unsubscribe():
                unsubscribe(session, connection, message)
            case SceneMessage():
                session.player.set_scene(
                    None
                    if message.objects is None
                    else {name: (p.x, p.y, p.z) for name, p in message.objects.items()}
                )
            case CharacterMessage():
                _character(session, message)
            case SetMessage():
                _set(session, message, t)
            case Anticipate():
                session.player.anticipate(message.id, message.syncs, t)
            case SpeechMessage():
                _say(session, connection, message, t)
            case Stop():
                _stop(session, message, t)
            case StateQuery():
                session.reply(connection.id, _state(session, connection, t))
            case Ping():
                session.reply(connection.id, Pong(id=message.id, time=t))
    except (Wrong, SpeechError) as error:
        where = f"{message.type}.{error.where}"
        id = message.id if isinstance(message, SpeechMessage) else None
        session.reply(connection.id, ErrorMessage(code="invalid", message=str(error), where=where, id=id))
    except ClipError as error:
        session.reply(connection.id, ErrorMessage(code="clip", message=str(error), where=error.where))
    except FaceError as error:
        where = f"{message.type}.face"
        session.reply(connection.id, ErrorMessage(code="face", message=str(error), where=where))
    except VoiceError as error:
        where = f"{message.type}.voice"
        session.reply(connection.id, ErrorMessage(code="voice", message=str(error), where=where))


def _stop(session: Session, message: Stop, t: float) -> None:
    """End what is known of these blocks; one that has ended by itself has only been quicker."""
    intake, wanted = session.intake, None if message.blocks is None else set(message.blocks)
    # What is not read may hold any of them.
    unread = bool(intake.inbox)
    known = intake.stop(wanted, t)
    session.player.stop(t, wanted)
    strange = [
        repr(id[:80])
        for id in message.blocks or ()
        if not (unread or id in known or id in intake.speeches or session.player.cast.knew(id))
    ]
    if strange:
        raise Wrong("blocks", f"wanted blocks that play or wait, got {', '.join(strange[:10])}")


def _say(session: Session, connection: Connection, message: SpeechMessage, t: float) -> None:
    if message.clip is not None and (message.id is None or _tells(message)):
        session.clips.tell(message)
    if message.id is None:
        return
    if message.clip is not None and message.clip not in session.clips.recordings:
        raise Wrong("clip", f"wanted a clip that was sent to its last piece, got {message.clip!r}")
    index_of(session, message.character)
    session.intake.speeches.hear(message, connection.id, t)


def _tells(message: SpeechMessage) -> bool:
    """Whether it says what is in its clip; one that only names it changes nothing of that."""
    return bool(message.text is not None or message.words or message.phonemes or message.visemes)


def _hello(session: Session, connection: Connection, message: Hello, t: float) -> None:
    if message.version != PROTOCOL:
        words = f"wanted version {PROTOCOL} of the protocol, got {message.version}"
        session.reply(connection.id, ErrorMessage(code="version", message=words, where="hello.version"))
        return
    if message.session not in (None, session.id):
        assert message.session is not None
        session.move(connection.id, message.session, message.seen)
        return
    session.welcome(connection.id, t + session.opened)
    if message.seen is not None:
        session.resume(connection.id, message.seen)


def _character(session: Session, message: CharacterMessage) -> None:
    if message.face is not None:
        session.faces.check(message.face)
    if message.voice is not None:
        from realizer.speech.registry import find_voice

        find_voice(message.voice).close()  # one that is not there is said before anything is spoken
    index = index_of(session, message.id)
    if message.face is not None:
        session.faces.given[index] = message.face
        tell_face(session, index)
    if message.voice is not None:
        session.intake.voices[index] = message.voice


def _set(session: Session, message: SetMessage, t: float) -> None:
    index = index_of(session, message.character)
    values = held(message, session.player.held(index))
    if "emotion" in message.model_fields_set:
        session.player.set_feeling(feeling_of(message.emotion), t, index)
    session.player.set_direct(values, t, index)


def _state(session: Session, connection: Connection, t: float) -> StateMessage:
    state = session.player.state(t)
    preparing = [
        BlockState(id=w.block.id, character=w.block.character_id, status="IN_PREP")
        for w in session.intake.preparation.waiting
    ]
    faces = [
        CharacterState(face=session.faces.name(index), voice=session.intake.voices.get(index), **face)
        for index, face in enumerate(state["characters"])
    ]
    return StateMessage(
        session=session.id,
        time=t,
        blocks=[*(BlockState(**block) for block in state["blocks"]), *preparing],
        characters=faces,
        voice=VoiceState(name=session.settings.voice, fault=session.intake.orders.fault),
        connections=len(session.connections),
        dropped=connection.dropped,
    )
