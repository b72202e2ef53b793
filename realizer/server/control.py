"""Control messages: what each of them does to a session, and what it is answered."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bml_schema import Emotion
from realizer.animation.targets import AU_NAMES
from realizer.behaviours import emotion
from realizer.behaviours.kind import World
from realizer.errors import FaceError, VoiceError
from realizer.server.clips import ClipError
from realizer.server.connection import (
    Connection,
    FeedbackFilter,
    FrameSubscription,
    PictureSubscription,
    PlanSubscription,
    SoundSubscription,
    Subscription,
)
from realizer.server.effects import Look
from realizer.server.limits import MAX_CHARACTERS, too_many_pixels
from realizer.server.messages import (
    PICTURES,
    PROTOCOL,
    STREAMS,
    Anticipate,
    BlockState,
    Changed,
    CharacterMessage,
    CharacterState,
    Control,
    ErrorMessage,
    Feeling,
    Hello,
    Ping,
    Pong,
    SceneMessage,
    SetMessage,
    SpeechMessage,
    StateMessage,
    StateQuery,
    Stop,
    Subscribe,
    Subscribed,
    Unsubscribe,
    VoiceState,
)
from realizer.server.speeches import SpeechError
from realizer.server.streams import arkit_names
from realizer.settings import raises
from realizer.tables import faps

if TYPE_CHECKING:
    from realizer.server.session import Session

__all__: list[str] = []


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
                _subscribe(session, connection, message, t)
            case Unsubscribe():
                if message.stream == "feedback":
                    connection.feedback = None
                connection.subscriptions.pop(_key(session, message), None)
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


def _subscribe(session: Session, connection: Connection, message: Subscribe, t: float) -> None:
    stream = message.stream
    encoding = message.encoding or STREAMS[stream][0]
    told: dict[str, Any]
    if encoding not in STREAMS[stream]:
        raise Wrong("encoding", f"wanted {' or '.join(STREAMS[stream])} for {stream}, got {encoding}")
    if stream == "feedback":
        elements = None if message.elements is None else frozenset(message.elements)
        connection.feedback = FeedbackFilter(elements, message.character)
        told = {"character": message.character, "elements": message.elements}
        session.reply(connection.id, Subscribed(stream=stream, encoding=encoding, **told))
        return
    index = index_of(session, message.character)
    key = _key(session, message)
    if stream == "schedule":
        connection.subscriptions[key] = PlanSubscription(
            None if message.character is None else index, message.character
        )
        session.reply(
            connection.id, Subscribed(stream=stream, encoding=encoding, character=message.character)
        )
        return
    fps = message.fps or session.settings.fps
    told = {"stream": stream, "encoding": encoding, "index": index}
    old = connection.subscriptions.get(key)
    subscription: Subscription
    if stream == "audio":
        one = None if message.character is None else index
        subscription = session.broadcast.sound(one, message.rate, t)
        if isinstance(old, SoundSubscription) and old.sound is subscription.sound:
            subscription = old  # what was sent ahead is not sent again
        told |= {"rate": message.rate, "frame": subscription.next, "fps": 50.0}
    elif stream == "video":
        subscription = session.broadcast.look(index, fps, _look(session, message, index), t)
        views = [view for view in session.views(but=old) if view is not subscription.view]
        beside = sum(view.look.size[0] * view.look.size[1] * view.timeline.fps for view in views)
        if (beyond := too_many_pixels(message.size, fps, session.settings, beside)) is not None:
            raise Wrong("fps", beyond)
        if message.view is not None:
            subscription.index = told["index"] = _index_of_view(connection, old)
        told |= {"fps": fps, "frame": subscription.next, "size": message.size, "view": message.view}
        told |= {"face": session.faces.name(index), "media_type": PICTURES[message.format]}
    else:
        if stream == "mesh":
            told |= _mesh_of(session, index)
        name = message.character
        subscription = session.broadcast.frames(stream, encoding, index, name, fps, t)
        subscription.asked = message.asked
        if isinstance(old, FrameSubscription) and old.timeline is subscription.timeline:
            subscription.next = max(subscription.next, old.next)  # no frame twice
        told |= {"fps": fps, "frame": subscription.next}
        if stream == "fap":
            told["names"] = [row.name for row in faps()]
        elif stream == "au":
            told["names"] = list(AU_NAMES())
        elif stream == "arkit":
            told["names"] = arkit_names()
    connection.subscriptions[key] = subscription
    session.reply(connection.id, Subscribed(character=message.character, **told))


def _look(session: Session, message: Subscribe, index: int) -> Look:
    from realizer.render.cameras import camera_names
    from realizer.render.light import presets

    settings = session.settings
    largest = settings.max_size
    if not all(16 <= side <= largest for side in message.size):
        words = f"wanted sides of 16..{largest} pixels, got {list(message.size)} {raises('max_size')}"
        raise Wrong("size", words)
    if message.light is not None and message.light not in presets():
        raise Wrong("light", f"wanted one of {', '.join(presets())}, got {message.light!r}")
    face = session.faces.of(index)
    if message.camera is not None and message.camera not in camera_names(face):
        raise Wrong("camera", f"wanted one of {', '.join(camera_names(face))}, got {message.camera!r}")
    behind = message.background or settings.background
    if message.format == "jpeg" and behind == "transparent":
        if message.background is not None:
            raise Wrong("background", "wanted the format png or webp for what is transparent, got jpeg")
        behind = None  # the service's own: a JPEG has the light's backdrop instead
    return Look(
        size=message.size,
        camera=message.camera or settings.camera,
        light=message.light or settings.light,
        background=behind,
        quality=message.quality,
        form=message.format,
    )


def _mesh_of(session: Session, index: int) -> dict[str, Any]:
    from realizer.face import face_scale

    face = session.faces.of(index)
    scale, offset = face_scale(face)
    return {
        "face": session.faces.name(index),
        "vertices": len(face.vertices),
        "scale": float(scale),
        "offset": [float(v) for v in offset],
    }


def _character(session: Session, message: CharacterMessage) -> None:
    if message.face is not None:
        session.faces.check(message.face)
    if message.voice is not None:
        from realizer.speech import find_voice

        find_voice(message.voice).close()  # one that is not there is said before anything is spoken
    index = index_of(session, message.id)
    if message.face is not None:
        session.faces.given[index] = message.face
        for connection, mesh in session.broadcast.face_changed(index):
            told = {"stream": "mesh", "character": mesh.name, "index": index, "frame": mesh.next}
            session.reply(connection, Changed(**told, **_mesh_of(session, index)))
    if message.voice is not None:
        session.intake.voices[index] = message.voice


def _set(session: Session, message: SetMessage, t: float) -> None:
    rows = faps()
    index = index_of(session, message.character)
    held = session.player.held(index)
    values: dict[str, float | None] = {}
    if message.aus is None:
        values |= dict.fromkeys(name for name in held if name in AU_NAMES())
    if message.faps is None:
        values |= dict.fromkeys(name for name in held if name not in AU_NAMES())
    for name, value in (message.aus or {}).items():
        names = [n for n in (name, f"{name}L", f"{name}R") if n in AU_NAMES()]
        if not names:
            raise Wrong("aus", f"wanted an AU number, with L or R for one side, got {name!r}")
        values |= dict.fromkeys(names, value)
    movable = {row.name for row in rows[2:]}
    for name, value in (message.faps or {}).items():
        if name.isascii() and name.isdigit() and 3 <= int(name) <= len(rows):
            name = rows[int(name) - 1].name
        if name not in movable:
            raise Wrong("faps", f"wanted the name or the number (3..68) of a FAP, got {name!r}")
        values[name] = value
    feeling = _feeling(message.emotion) if "emotion" in message.model_fields_set else None
    if feeling is not None:
        session.player.set_feeling(feeling, t, index)
    session.player.set_direct(values, t, index)


def _feeling(asked: Feeling | None) -> dict[str, float]:
    """Name of AU -> 0..1; {} for none."""
    if asked is None:
        return {}
    node = Emotion(id="set", **asked.model_dump())
    said = node.fault() or next((fault.text for fault in emotion.check(node, World())), "")
    if not said:
        try:
            return {target.name: value for target, value in emotion.values_of(node).items()}
        except ValueError as off:
            said = str(off)
    field, _, rest = said.partition(": ")
    raise Wrong(*((f"emotion.{field}", rest) if field in Feeling.model_fields else ("emotion", said)))


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


def _key(session: Session, message: Subscribe | Unsubscribe) -> tuple[str, str | None, str | None]:
    """What a subscription is replaced by; the first character is who is meant where nobody is named.

    But of sound and plans: those that name nobody are of all. Only videos have views.
    """
    stream, character = message.stream, message.character
    if stream not in ("audio", "schedule") and character == session.player.characters[0]:
        character = None
    return stream, character, message.view if stream == "video" else None


def _index_of_view(connection: Connection, old: Subscription | None) -> int:
    """What tells the pictures of a view from all others of a connection, and of no view; as it was before."""
    pictures = [s for s in connection.subscriptions.values() if isinstance(s, PictureSubscription)]
    if isinstance(old, PictureSubscription):
        return old.index
    free = set(range(MAX_CHARACTERS, 256)) - {s.index for s in pictures}
    if not free:
        raise Wrong("view", f"wanted at most {256 - MAX_CHARACTERS} views")
    return min(free)


def index_of(session: Session, character: str | None) -> int:
    """Where a character stands in the session; it is added where it is new."""
    known = session.player.characters
    if character not in (None, *known) and len(known) >= MAX_CHARACTERS:
        raise Wrong("character", f"wanted at most {MAX_CHARACTERS} characters in a session")
    return session.player.character_index(character)


class Wrong(Exception):
    """A control message whose field `where` cannot be followed."""

    def __init__(self, where: str, text: str) -> None:
        super().__init__(text)
        self.where = where
