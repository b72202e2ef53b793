"""One session: documents and control messages in, effects out. No sockets, no clock: it is told `now`."""

from __future__ import annotations

import logging
import re
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bml_schema import Block, BMLError, read
from realizer.animation.targets import AU_NAMES
from realizer.behaviours import KINDS, VOCABULARY
from realizer.behaviours.kind import Position
from realizer.errors import FaceError, RealizerError, VoiceError
from realizer.pipeline import warning_of
from realizer.player import Player
from realizer.scheduling.timing import Warning
from realizer.server.broadcast import Broadcast
from realizer.server.connection import STUCK, Connection, FrameSubscription, SoundSubscription, Subscription
from realizer.server.effects import Close, Effect, Move, Send, Speak
from realizer.server.messages import (
    PROTOCOL,
    STREAMS,
    CharacterMessage,
    Control,
    ErrorMessage,
    Gap,
    Hello,
    Ping,
    Pong,
    SceneMessage,
    SetMessage,
    StateMessage,
    StateQuery,
    Stop,
    Subscribe,
    Subscribed,
    Unsubscribe,
    Welcome,
    parse_control,
)
from realizer.server.preparation import Preparation, Waiting
from realizer.server.streams import EPSILON
from realizer.settings import Settings
from realizer.speech.utterance import Say, Utterance
from realizer.tables import faps

if TYPE_CHECKING:
    from realizer.face.model import Face

__all__ = ["Session"]

log = logging.getLogger(__name__)

# Feedback that is kept for clients that come back: about an hour of talk.
LOG = 10_000
# Messages that may wait to be read; a client that sends faster is told.
INBOX = 1_000
# A voice that has not answered by then is taken for silent.
SPEAK_DEADLINE = 20.0  # s
# The index of a character is one byte on the wire; sixteen faces in one session are a crowd.
MAX_CHARACTERS = 16

_BLOCK_ID = re.compile(r"<(?:\w+:)?bml\b[^<>]*?\bid\s*=\s*[\"']([^\"'<>]{1,256})[\"']")


class Session:
    """A clock, characters, blocks, a scene and the feedback log; and the connections that share them.

    Args:
        id: its name.
        settings: limits and defaults.
        now: seconds on the caller's clock; the session's own clock starts here.
        named: it was asked for by name, and outlives its last connection by `settings.keep`.
        scene: where targets are, to begin with.
        load_face: name -> Face, raising FaceError.
        capabilities: what `welcome` tells.

    `receive`, `spoken`, `drawn` and `tick` do the work; `outgoing` gives what the shell has to do after each
    of them, and `next_deadline` says when `tick` is wanted.
    """

    def __init__(
        self,
        id: str,
        settings: Settings,
        now: float,
        *,
        named: bool = False,
        scene: Mapping[str, Position] | None = None,
        load_face: Callable[[str], Face] | None = None,
        capabilities: Mapping[str, Any] | None = None,
    ) -> None:
        self.id = id
        self.settings = settings
        self.opened = now
        self.named = named
        self.closed = False
        self.ending = False  # the service ends: no new documents
        self.empty_since: float | None = now
        self.player = Player(
            kinds=KINDS, scene=scene, seed=settings.seed, idle=settings.idle, language=settings.language
        )
        self._load_face = load_face or _load_face
        self._capabilities = dict(capabilities or {})
        self._faces: dict[int, str] = {}
        self._voices: dict[int, str] = {}
        self._voice_fault: str | None = None
        self._broadcast = Broadcast(self.player, self._face, self._face_name)
        self._preparation = Preparation()
        self._speaks = 0
        self._connections: dict[int, Connection] = {}
        self._inbox: deque[Iterator[Block | BMLError | Warning]] = deque()
        self._log: deque[str] = deque(maxlen=LOG)
        self._seq = 0
        self._effects: list[Effect] = []

    # connections --------------------------------------------------------------------------------

    @property
    def connections(self) -> tuple[int, ...]:
        """Ids of the connections that share the session."""
        return tuple(self._connections)

    def connect(self, connection: int, now: float, seen: int | None = None) -> None:
        """A client joins; with `seen` it gets the feedback that followed, otherwise what is to come."""
        self._connections[connection] = Connection(connection, self._seq + 1)
        self.empty_since = None
        if seen is not None:
            self.resume(connection, seen)

    def disconnect(self, connection: int, now: float) -> None:
        """A client is gone. A session nobody named ends with it."""
        self._connections.pop(connection, None)
        if not self._connections:
            self.empty_since = now
            if not self.named:
                self.close()

    def expired(self, now: float) -> bool:
        """Nobody has been here for `settings.keep` seconds."""
        return self.empty_since is not None and now >= self.empty_since + self.settings.keep

    def close(self) -> None:
        """End: nothing is done and nothing is sent after it."""
        self.closed = True
        self._connections.clear()
        self._inbox.clear()
        self._effects.clear()

    def backlog(self, connection: int, waiting: int) -> None:
        """How many bytes wait to be sent to a client: a slow one loses frames, a stuck one is closed."""
        if (known := self._connections.get(connection)) is not None:
            known.backlog = waiting
            if waiting > STUCK:
                reason = f"{waiting} bytes wait to be read; come back with the session's name and seen"
                self._effects.append(Close(connection, 1013, reason))

    # messages in --------------------------------------------------------------------------------

    def receive(self, connection: int, message: str | bytes, now: float) -> None:
        """A WebSocket message: control where it starts with `{`, otherwise BML documents."""
        if self.closed or connection not in self._connections:
            return
        if isinstance(message, bytes):
            text = f"wanted BML or JSON as a text message, got {len(message)} bytes of binary"
            self._reply(connection, ErrorMessage(code="unsupported", message=text))
        elif message.lstrip("\ufeff \t\r\n").startswith("{"):
            control = parse_control(message.lstrip("\ufeff \t\r\n"))
            if isinstance(control, ErrorMessage):
                self._reply(connection, control)
            else:
                self._control(self._connections[connection], control, now)
        elif len(self._inbox) >= INBOX:
            text = f"{INBOX} messages wait to be read: wanted fewer at a time"
            self._refuse(Warning(_name_of(message), "PARSING_FAILURE", text), now)
        else:
            self._inbox.append(self._documents(message))
        self.tick(now)

    def spoken(self, speak: int, result: Utterance | RealizerError, now: float) -> None:
        """The voice's answer to a Speak. Where it failed, the silent voice takes over."""
        if self.closed:
            return
        if isinstance(result, Utterance):
            self._preparation.spoken(speak, result)
        else:
            self._silently(speak, str(result))
        self.tick(now)

    def drawn(self, draw: int, result: bytes | RealizerError, now: float) -> None:
        """The renderer's answer to a Draw: a JPEG. Where it failed, pictures end with an error."""
        if self.closed:
            return
        picture = result if isinstance(result, bytes) else None
        effects, lookers = self._broadcast.drawn(draw, picture, self._connections.values())
        self._effects += effects
        if not isinstance(result, bytes):
            for connection in lookers:
                for key in [k for k in connection.subscriptions if k[0] == "video"]:
                    del connection.subscriptions[key]
                self._reply(connection.id, ErrorMessage(code="render", message=str(result), where="video"))
        self.tick(now)

    # time ---------------------------------------------------------------------------------------

    def tick(self, now: float) -> None:
        """Do what is due: feedback, sound and frames first, then read or plan one document at most."""
        if self.closed:
            return
        t = now - self.opened
        self._publish(t)
        self._effects += self._broadcast.due(self._connections.values(), t)
        for speak in self._preparation.overdue(t + EPSILON - SPEAK_DEADLINE):
            self._silently(speak, f"the voice has not answered for {SPEAK_DEADLINE:g} s")
        # Reading and planning are ticks of their own: the acknowledgement is on its way before planning
        # begins, and frames that are due come in between.
        if self._submit_ready(t) or self._read_one(t):
            self._publish(t)

    def next_deadline(self) -> float | None:
        """When `tick` is wanted, on the caller's clock; in the past: at once; None when nothing waits."""
        if self.closed:
            return None
        if self._inbox or self._preparation.has_ready:
            return float("-inf")
        deadlines = [
            self.player.next_deadline(),
            self._broadcast.next_deadline(self._connections.values()),
            self._preparation.deadline(SPEAK_DEADLINE),
        ]
        known = [d for d in deadlines if d is not None]
        return min(known) + self.opened if known else None

    @property
    def busy(self) -> bool:
        """A block plays, waits or is being prepared."""
        return bool(self._inbox or len(self._preparation) or self.player.next_deadline() is not None)

    def outgoing(self) -> list[Effect]:
        """What the shell has to do, in order; each is told once."""
        effects, self._effects = self._effects, []
        return effects

    # documents ----------------------------------------------------------------------------------

    def _documents(self, text: str) -> Iterator[Block | BMLError | Warning]:
        limit = self.settings.max_document
        size = len(text) if text.isascii() else len(text.encode("utf-8", "surrogatepass"))
        if size > limit:
            words = f"wanted at most {limit} bytes of BML in a message, got {size}"
            return iter([Warning(_name_of(text), "PARSING_FAILURE", words)])
        return iter(read(text, VOCABULARY))

    def _read_one(self, t: float) -> bool:
        """Take the next document of the inbox; False where there is none."""
        while self._inbox:
            try:
                item = next(self._inbox[0], None)
            except Exception:
                log.exception("session %s: a document could not be read", self.id)
                self._inbox.popleft()
                self._refuse(Warning("<no id>", "PARSING_FAILURE", "internal error while reading"), t)
                return True
            if item is None:
                self._inbox.popleft()
                continue
            if isinstance(item, Block):
                self._prepare(item, t)
            else:
                self._refuse(item if isinstance(item, Warning) else warning_of(item), t)
            return True
        return False

    def _prepare(self, block: Block, t: float) -> None:
        """Ask for the block's voice and acknowledge it; it is planned when nothing is missing."""
        if (fault := self._beyond_limits(block)) is not None:
            self._refuse(Warning(block.id, "CANNOT_CREATE_BEHAVIOR", fault), t, block.character_id)
            return
        try:
            wants = self.player.wants(block)
            character = self.player.character_index(block.character_id)
            says: dict[int, tuple[str, Say]] = {}
            for behaviour, say in wants.items():
                self._speaks += 1
                voice = say.voice or self._voices.get(character) or self.settings.voice
                says[self._speaks] = (behaviour, replace(say, voice=voice))
            self._preparation.add(block, character, says, t)
            self.player.announce(block, t)
        except Exception:
            self._internal(block, t)
            return
        self._effects += [Speak(speak, say) for speak, (_, say) in says.items()]

    def _submit_ready(self, t: float) -> bool:
        """Plan the first block that waits for nothing; False where all wait."""
        waiting = self._preparation.ready()
        if waiting is None:
            return False
        try:
            schedule = self.player.submit(waiting.block, t, waiting.utterances)
        except Exception:
            self._internal(waiting.block, t)
            return True
        if waiting.block.composition == "REPLACE" and not schedule.failed:
            self._withdraw(self._preparation.replaced_by(waiting), t)
        return True

    def _withdraw(self, gone: list[Waiting], t: float) -> None:
        for waiting in gone:
            self.player.withdraw(waiting.block, t)
        self._preparation.remove(gone)

    def _beyond_limits(self, block: Block) -> str | None:
        limits = self.settings
        if self.ending:
            return "the service is ending and takes no more documents"
        if len(block.behaviours) > limits.max_behaviours:
            return (
                f"wanted at most {limits.max_behaviours} behaviours in a block, got {len(block.behaviours)}"
            )
        if len(self._preparation) + self.player.alive >= limits.max_blocks:
            return f"{limits.max_blocks} blocks play or wait: wanted fewer at a time"
        known = self.player.characters
        if block.character_id not in (None, *known) and len(known) >= MAX_CHARACTERS:
            return f"wanted at most {MAX_CHARACTERS} characters in a session"
        return None

    def _internal(self, block: Block, t: float) -> None:
        """A bug: the traceback is ours, the client gets the block's id."""
        log.exception("session %s: block %s failed", self.id, block.id)
        text = "internal error while planning this block"
        self._refuse(Warning(block.id, "EXECUTION_EXCEPTION", text), t, block.character_id)

    def _refuse(self, warning: Warning, t: float, character: str | None = None) -> None:
        self.player.refuse(warning, t, character)

    def _silently(self, speak: int, fault: str) -> None:
        """Let the silent voice answer for one that failed; a client sees it in `state` alone."""
        from realizer.speech import SilentVoice

        say = self._preparation.said(speak)
        if say is not None:
            self._voice_fault = fault
            try:
                self._preparation.spoken(speak, SilentVoice().say(say))
            except VoiceError:
                self._preparation.unspoken(speak)

    # feedback -----------------------------------------------------------------------------------

    def _publish(self, t: float) -> None:
        """Number what is due, keep it, and send it to every connection that has not switched it off."""
        for feedback in self.player.due(t + EPSILON):
            self._seq += 1
            self._log.append(feedback.to_xml(self._seq))
        for connection in self._connections.values():
            if connection.place <= self._seq:
                self._catch_up(connection)

    def _catch_up(self, connection: Connection) -> None:
        first = self._seq - len(self._log) + 1
        if connection.feedback:
            for number in range(max(connection.place, first), self._seq + 1):
                self._effects.append(Send(connection.id, self._log[number - first]))
        connection.place = self._seq + 1

    def resume(self, connection: int, seen: int) -> None:
        """Send what followed `seen`, after a `gap` where some of it is gone or was never there."""
        first = self._seq - len(self._log) + 1
        if seen + 1 < first or seen > self._seq:
            self._reply(connection, Gap(seen=seen, first=first))
            seen = first - 1
        self._connections[connection].place = seen + 1
        self._catch_up(self._connections[connection])

    # control ------------------------------------------------------------------------------------

    def _control(self, connection: Connection, message: Control, now: float) -> None:
        t = now - self.opened
        try:
            match message:
                case Hello():
                    self._hello(connection, message, t)
                case Subscribe():
                    self._subscribe(connection, message, t)
                case Unsubscribe():
                    if message.stream == "feedback":
                        connection.feedback = False
                    connection.subscriptions.pop((message.stream, message.character), None)
                case SceneMessage():
                    self.player.set_scene(
                        None
                        if message.objects is None
                        else {name: (p.x, p.y, p.z) for name, p in message.objects.items()}
                    )
                case CharacterMessage():
                    self._character(message)
                case SetMessage():
                    self._set(message, t)
                case Stop():
                    wanted = None if message.blocks is None else set(message.blocks)
                    waiting = self._preparation.waiting
                    self._withdraw([w for w in waiting if wanted is None or w.block.id in wanted], t)
                    self.player.stop(t, wanted)
                case StateQuery():
                    self._reply(connection.id, self._state(connection, t))
                case Ping():
                    self._reply(connection.id, Pong(id=message.id, time=t))
        except _Wrong as error:
            where = f"{message.type}.{error.where}"
            self._reply(connection.id, ErrorMessage(code="invalid", message=str(error), where=where))
        except FaceError as error:
            where = f"{message.type}.face"
            self._reply(connection.id, ErrorMessage(code="face", message=str(error), where=where))

    def _hello(self, connection: Connection, message: Hello, t: float) -> None:
        if message.version != PROTOCOL:
            raise _Wrong("version", f"wanted protocol version {PROTOCOL}, got {message.version}")
        if message.session not in (None, self.id):
            assert message.session is not None
            self._effects.append(Move(connection.id, message.session, message.seen))
            return
        self.welcome(connection.id, t + self.opened)
        if message.seen is not None:
            self.resume(connection.id, message.seen)

    def welcome(self, connection: int, now: float) -> None:
        """Tell a client where it is and what there is."""
        s = self.settings
        limits = {
            "message": s.max_message,
            "document": s.max_document,
            "behaviours": s.max_behaviours,
            "blocks": s.max_blocks,
            "characters": MAX_CHARACTERS,
            "picture": s.max_size,
            "keep": s.keep,
        }
        reply = Welcome(
            session=self.id,
            time=now - self.opened,
            seq=self._seq,
            capabilities={"streams": STREAMS, "fps": s.fps, **self._capabilities},
            limits=limits,
        )
        self._reply(connection, reply)

    def _subscribe(self, connection: Connection, message: Subscribe, t: float) -> None:
        stream = message.stream
        encoding = message.encoding or STREAMS[stream][0]
        if encoding not in STREAMS[stream]:
            raise _Wrong("encoding", f"wanted {' or '.join(STREAMS[stream])} for {stream}, got {encoding}")
        if stream == "feedback":
            connection.feedback = True
            self._reply(connection.id, Subscribed(stream=stream, encoding=encoding))
            return
        index = self._index(message.character)
        fps = message.fps or self.settings.fps
        told: dict[str, Any] = {"stream": stream, "encoding": encoding, "index": index}
        old = connection.subscriptions.get((stream, message.character))
        subscription: Subscription
        if stream == "audio":
            one = None if message.character is None else index
            subscription = self._broadcast.sound(one, message.rate, t)
            if isinstance(old, SoundSubscription) and old.sound is subscription.sound:
                subscription = old  # what was sent ahead is not sent again
            told |= {"rate": message.rate, "frame": subscription.next, "fps": 50.0}
        elif stream == "video":
            self._check_picture(message)
            subscription = self._broadcast.pictures(
                index, fps, message.size, message.camera, message.quality, t
            )
            told |= {"fps": fps, "frame": subscription.next, "size": message.size}
            told |= {"face": self._face_name(index), "media_type": "image/jpeg"}
        else:
            if stream == "mesh":
                told |= self._mesh_of(index)
            name = message.character
            subscription = self._broadcast.frames(stream, encoding, index, name, fps, t)
            if isinstance(old, FrameSubscription) and old.timeline is subscription.timeline:
                subscription.next = max(subscription.next, old.next)  # no frame twice
            told |= {"fps": fps, "frame": subscription.next}
            if stream == "fap":
                told["names"] = [row.name for row in faps()]
            elif stream == "au":
                told["names"] = list(AU_NAMES())
        connection.subscriptions[stream, message.character] = subscription
        self._reply(connection.id, Subscribed(character=message.character, **told))

    def _check_picture(self, message: Subscribe) -> None:
        largest = self.settings.max_size
        if not all(16 <= side <= largest for side in message.size):
            raise _Wrong("size", f"wanted sides of 16..{largest} pixels, got {list(message.size)}")

    def _mesh_of(self, index: int) -> dict[str, Any]:
        from realizer.face import face_scale

        face = self._face(index)
        scale, offset = face_scale(face)
        return {
            "face": self._face_name(index),
            "vertices": len(face.vertices),
            "scale": float(scale),
            "offset": [float(v) for v in offset],
        }

    def _character(self, message: CharacterMessage) -> None:
        if message.face is not None:
            self._load_face(message.face)
        index = self._index(message.id)
        if message.face is not None:
            self._faces[index] = message.face
            self._broadcast.face_changed(index)
        if message.voice is not None:
            self._voices[index] = message.voice

    def _set(self, message: SetMessage, t: float) -> None:
        rows = faps()
        values: dict[str, float | None] = {}
        for name, value in message.aus.items():
            names = [n for n in (name, f"{name}L", f"{name}R") if n in AU_NAMES()]
            if not names:
                raise _Wrong("aus", f"wanted an AU number, with L or R for one side, got {name!r}")
            values |= dict.fromkeys(names, value)
        for name, value in message.faps.items():
            if name.isascii() and name.isdigit() and 3 <= int(name) <= len(rows):
                name = rows[int(name) - 1].name
            if name not in [row.name for row in rows[2:]]:
                raise _Wrong("faps", f"wanted the name or the number (3..68) of a FAP, got {name!r}")
            values[name] = value
        self.player.set_direct(values, t, self._index(message.character))

    def _state(self, connection: Connection, t: float) -> StateMessage:
        state = self.player.state(t)
        preparing = [
            {"id": w.block.id, "character": w.block.character_id, "status": "IN_PREP"}
            for w in self._preparation.waiting
        ]
        voice: dict[str, Any] = {"name": self.settings.voice}
        if self._voice_fault is not None:
            voice["fault"] = self._voice_fault
        return StateMessage(
            session=self.id,
            time=t,
            blocks=[*state["blocks"], *preparing],
            characters=state["characters"],
            voice=voice,
            connections=len(self._connections),
            dropped=connection.dropped,
        )

    # characters ---------------------------------------------------------------------------------

    def _index(self, character: str | None) -> int:
        known = self.player.characters
        if character not in (None, *known) and len(known) >= MAX_CHARACTERS:
            raise _Wrong("character", f"wanted at most {MAX_CHARACTERS} characters in a session")
        return self.player.character_index(character)

    def _face_name(self, index: int) -> str:
        from realizer.face import face_name

        return face_name(self._faces.get(index, self.settings.face))

    def _face(self, index: int) -> Face:
        return self._load_face(self._face_name(index))

    def _reply(self, connection: int, reply: Any) -> None:
        self._effects.append(Send(connection, reply.text()))


class _Wrong(Exception):
    """A control message whose field `where` cannot be followed."""

    def __init__(self, where: str, text: str) -> None:
        super().__init__(text)
        self.where = where


def _name_of(text: str) -> str:
    """The block id of a document that is not parsed, where it can be read near its start."""
    found = _BLOCK_ID.search(text, 0, 4096)
    return found.group(1) if found else "<no id>"


def _load_face(name: str) -> Face:
    from realizer.face import load_face

    return load_face(name)
