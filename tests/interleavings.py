"""A seed in, sessions to which anything is done in any order; AssertionError where a law of theirs breaks."""

from __future__ import annotations

import json
import logging
from collections import defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from random import Random
from unittest.mock import patch
from zlib import crc32

import numpy as np

from bml_schema.feedback import parse_feedback
from realizer.core.errors import RenderError, VoiceError
from realizer.core.settings import Settings
from realizer.protocol.wire import ClipPiece, pack_clip, unpack
from realizer.server.journal import JournalError
from realizer.server.journal import session_journal as thresholds
from realizer.server.journal.entry import Entry, SavedSession
from realizer.server.journal.replay import restore_session
from realizer.server.runtime.session_registry import SessionRegistry
from realizer.server.session.effects import Close, Draw, Effect, Send, Speak
from realizer.server.session.session import Session
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import Utterance
from tests.mutants import mutants
from tests.wake_times import next_wake

__all__ = ["BODIES", "CONTROLS", "FILTERS", "HEADS", "NAMES", "Interleaving", "Memory", "no_error", "spoken"]

OPENED = 1000.0
EPOCH = 1.7e9
# What is due at one instant: far more than any block has points.
MOST_TICKS = 20_000
RATE = 8000
NAMES = ("a", "b", "c")
BODIES = (
    '<head id="n" lexeme="NOD"/>',
    '<speech id="s"><text>One <sync id="m"/>two</text></speech><head id="n" lexeme="NOD" stroke="s:m"/>',
    '<speech id="s"><text>' + "It rains here today, and it rains there. " * 12 + "</text></speech>",
    '<wait id="w" duration="0.3"/>',
    '<gaze id="g" target="cup" start="0.1" end="0.9"/><faceLexeme id="f" lexeme="SMILE" end="1.5"/>',
    '<head id="n" lexeme="SHAKE" start="{other}:n:end"/>',
    '<head id="n" lexeme="NOD" start="anticipators:clock:beat"/>',
    '<faceFacs id="f" au="12" amount="1" start="0.2" end="2"/>',
    '<speech id="s"><text/></speech>',
    '<bmlp:interrupt xmlns:bmlp="http://hmi.ewi.utwente.nl/bmlp" id="i" target="{other}"/>',
    '<bmla:interrupt xmlns:bmla="http://www.asap-project.org/bmla" id="i" target="{other}"/>',
    "",
)
HEADS = (
    *("", "", "", 'composition="APPEND"', 'composition="REPLACE"', 'characterId="Ann"'),
    'xmlns:bmla="http://www.asap-project.org/bmla" bmla:appendAfter="{other}"',
    'xmlns:bmla="http://www.asap-project.org/bmla" bmla:preplan="true"',
    'xmlns:bmla="http://www.asap-project.org/bmla" bmla:interrupt="{other}"',
)
CONTROLS: tuple[Mapping[str, object], ...] = (
    *({"type": "ping", "id": 1}, {"type": "state"}, {"type": "hello", "version": 1}),
    {"type": "hello", "version": 2},
    {"type": "scene", "objects": {"cup": {"x": 0.2, "y": -0.1, "z": 0.5}}},
    {"type": "scene", "objects": None},
    {"type": "set", "aus": {"12L": 0.5, "4": 1}, "faps": {"open_jaw": 200}},
    {"type": "set", "emotion": {"name": "joy", "intensity": 0.7}},
    {"type": "set", "aus": None, "faps": None, "emotion": None},
    {"type": "stop"},
    *({"type": "stop", "blocks": [name]} for name in NAMES),
    *({"type": "anticipate", "id": "clock", "syncs": {"beat": t}} for t in (0.0, 3.0, 9.0)),
    {"type": "speech", "id": "turn", "append": 'Hello <sync id="m"/>there. And'},
    {"type": "speech", "id": "turn", "append": ' more <head id="n" lexeme="NOD"/>of it. '},
    {"type": "speech", "id": "turn", "close": True},
    {"type": "speech", "id": "other", "append": "Never closed. ", "composition": "REPLACE"},
    {"type": "speech", "id": "turn", "clip": "c"},
    {"type": "speech", "clip": "c", "words": [{"start": 0, "end": 0.1, "text": "Oh"}]},
    {"type": "character", "id": "Ann", "voice": "silent"},
    {"type": "character", "face": "default"},
    *({"type": "subscribe", "stream": s} for s in ("fap", "au", "arkit", "audio", "schedule", "video")),
    {"type": "subscribe", "stream": "fap", "encoding": "json", "fps": 60, "character": "Ann"},
    {"type": "subscribe", "stream": "au", "fps": 0.5, "asked": True},
    {"type": "subscribe", "stream": "audio", "rate": 8000, "character": "Ann"},
    *({"type": "unsubscribe", "stream": s} for s in ("fap", "au", "audio", "schedule", "video")),
)
FILTERS: tuple[Mapping[str, object], ...] = (
    {"type": "subscribe", "stream": "feedback", "elements": ["blockProgress"]},
    {"type": "subscribe", "stream": "feedback", "character": "Ann"},
    {"type": "unsubscribe", "stream": "feedback"},
)


class Memory:
    """A journal in memory; `full` says whether it has no room for what comes.

    Attributes:
        compacted: how many checkpoints were kept.
    """

    def __init__(self, full: Callable[[], bool] = lambda: False) -> None:
        self.compacted = 0
        self.entries: dict[str, list[Entry]] = {}
        self.parts: dict[str, dict[str, str]] = {}
        self._full = full

    def begin(self, session: str, epoch: float) -> None:
        self.entries[session], self.parts[session] = [], {}

    def add(self, session: str, entry: Entry) -> None:
        if self._full():
            raise JournalError("no room")
        self.entries[session].append(Entry.read(entry.line()))

    def claim(self, session: str) -> SavedSession | None:
        if session not in self.entries:
            return None
        return SavedSession(EPOCH, list(self.entries[session]), dict(self.parts[session]))

    def taken_over(self, sessions: Collection[str]) -> set[str]:
        return set()

    def compact(self, session: str, parts: Mapping[str, str | None]) -> None:
        if self._full():
            raise JournalError("no room")
        self.compacted += 1
        self.entries[session].clear()
        for name, text in parts.items():
            self.parts[session].pop(name, None)
            if text is not None:
                self.parts[session][name] = text

    def end(self, session: str) -> None:
        self.entries.pop(session, None)
        self.parts.pop(session, None)

    def close(self) -> None:
        self.entries.clear()
        self.parts.clear()


@dataclass
class View:
    """What one connection has seen of its session.

    Attributes:
        session: the one it is in, as far as it knows.
        last: seq of the newest feedback.
        whole: it has asked for all feedback as long as it is there.
        asked: the `seen` of its last hello, until it is welcomed.
    """

    session: Session
    last: int
    whole: bool = True
    asked: int | None = None


class Interleaving:
    """A hub of named and nameless sessions; `run` does so many things to it that a seed chooses.

    Args:
        seed: the same one does the same.
        documents: that are sent now and then, broken or not, beside our own.
        full: how often, of 1, the journal has no room.
    """

    def __init__(self, seed: int, documents: Sequence[bytes] = (), full: float = 0.0) -> None:
        self.random = Random(seed)
        self.now = OPENED
        self._full = full
        self._journal = Memory(lambda: self.random.random() < self._full)
        self._settings = Settings(max_blocks=50, keep=5)
        self._hub = SessionRegistry(self._make, self._settings)
        self._broken = mutants(documents, 10**9, seed) if documents else None
        self._views: dict[int, View] = {}
        self._count = 0
        self._sent: defaultdict[Session, dict[int, str]] = defaultdict(dict)
        self._speaks: list[tuple[Session, Speak]] = []
        self._draws: list[tuple[Session, Draw]] = []

    def _make(self, id: str, now: float, named: bool) -> Session:
        session = Session(id, self._settings, now, named=named, epoch=EPOCH)
        session.journal.open(self._journal if named else None)
        session.journal.begin(EPOCH)
        return session

    def run(self, steps: int) -> None:
        """Do that many things, then let all that was begun come to its end.

        Raises:
            AssertionError: a law is broken.
        """
        # Checkpoints are taken wherever one can be.
        with no_error(), patch.object(thresholds, "ENTRIES", 5):
            for _ in range(steps):
                self._step()
            self._end()

    # what is done ------------------------------------------------------------------------------

    def _step(self) -> None:
        actions = (self._join, self._leave, self._send, self._send, self._send, self._control)
        actions += (
            self._control,
            self._resume,
            self._answer,
            self._answer,
            self._slow,
            self._clip,
            self._narrow,
        )
        if not self._views:
            self._join()
        else:
            self.random.choice(actions)()
        self._pump()
        for _ in range(self.random.choice((0, 1, 1, 2))):
            self._pass()

    def _one(self) -> int:
        return self.random.choice(list(self._views))

    def _join(self) -> None:
        self._count += 1
        name = self.random.choice((None, "show", "show", "other"))
        seen = self.random.choice((None, None, 0, self.random.randrange(40)))
        there = None if name is None else self._hub.sessions.get(name)
        newest = 0 if there is None else there.feedback_log.newest
        session = self._hub.open(self._count, name, self.now, seen)
        self._views[self._count] = View(session, newest if seen is None else seen if seen <= newest else 0)

    def _leave(self) -> None:
        one = self._one()
        del self._views[one]
        self._hub.leave(one, self.now)

    def _receive(self, connection: int, message: str | bytes) -> None:
        session = self._hub.session_of.get(connection)
        assert session is not None
        session.receive(connection, message, self.now)

    def _send(self) -> None:
        if self._broken is not None and self.random.random() < 0.3:
            text = next(self._broken).decode("utf-8", "replace")
            if text.lstrip("\ufeff \t\r\n").startswith("{"):
                return
        else:
            head, body = self.random.choice(HEADS), self.random.choice(BODIES)
            text = f'<bml id="{self.random.choice(NAMES)}" {head}>{body}</bml>'
            text = text.replace("{other}", self.random.choice(NAMES))
        self._receive(self._one(), text)

    def _control(self) -> None:
        self._receive(self._one(), json.dumps(self.random.choice(CONTROLS)))

    def _narrow(self) -> None:
        one = self._one()
        self._views[one].whole = False
        self._receive(one, json.dumps(self.random.choice(FILTERS)))

    def _resume(self) -> None:
        """A client asks for what it has missed, here or in another session."""
        one = self._one()
        name = self.random.choice((self._views[one].session.id, "show", "other"))
        self._views[one].asked = seen = self.random.randrange(60)
        self._receive(one, json.dumps({"type": "hello", "session": name, "seen": seen}))

    def _clip(self) -> None:
        number, rate = self.random.choice((0, 0, 1)), self.random.choice((RATE, RATE, 0))
        piece = ClipPiece("c", number, rate, bytes(2 * RATE // 10), self.random.random() < 0.7)
        self._receive(self._one(), pack_clip(piece)[: self.random.choice((None, None, 5, 20))])

    def _slow(self) -> None:
        one = self._one()
        session = self._hub.session_of.get(one)
        assert session is not None
        session.update_backlog(one, self.random.choice((0, 0, 10**6, 10**9)))

    def _answer(self) -> None:
        """A voice or the renderer answers, not in the order in which they were asked."""
        kind = self.random.choice((self._speaks, self._draws))
        if not kind:
            return
        session, order = kind.pop(self.random.randrange(len(kind)))
        fails = self.random.random() < 0.1
        if isinstance(order, Speak):
            session.on_speech(order.id, VoiceError("hoarse") if fails else spoken(order), self.now)
        else:
            session.on_picture(order.id, RenderError("blind") if fails else b"picture", self.now)

    def _pass(self) -> None:
        """Time passes; or it does while nobody looks."""
        step = self.random.choice((0.0, 1e-6, 0.02, 0.1, 0.5, 2.0))
        if self.random.random() < 0.15:
            self.now += step
        else:
            self._until(self.now + step)
        if self.random.random() < 0.1:
            self._hub.remove_expired(self.now)

    # what comes of it --------------------------------------------------------------------------

    def _until(self, end: float) -> None:
        """Wake sessions when they want to be, each as often as it must be."""
        ticks = 0
        while True:
            due = [(next_wake(s), s) for s in self._hub.sessions.values()]
            when, session = min(due, key=lambda one: one[0], default=(end + 1, None))
            if session is None or when > end:
                break
            ticks = ticks + 1 if when <= self.now else 0
            assert ticks < MOST_TICKS, f"{session.id} is due for ever at {self.now}: {when}"
            self.now = max(self.now, when)
            session.tick(self.now)
            self._pump()
        self.now = max(self.now, end)

    def _pump(self) -> None:
        for session in list(self._hub.sessions.values()):
            for effect in self._hub.move_connections(session, session.take_effects(), self.now):
                self._do(session, effect)

    def _do(self, session: Session, effect: Effect) -> None:
        match effect:
            case Speak():
                self._speaks.append((session, effect))
            case Draw():
                assert np.isfinite(effect.pose).all()
                self._draws.append((session, effect))
            case Close(connection):
                if self._views.pop(connection, None) is not None:
                    self._hub.leave(connection, self.now)
            case Send(connection, data) if connection in self._views:
                self._see(connection, data)

    def _see(self, connection: int, data: str | bytes) -> None:
        view = self._views[connection]
        if data == b"picture":
            return
        if isinstance(data, bytes):
            frame = unpack(data)
            assert frame.time >= 0
        elif data.startswith("{"):
            control = json.loads(data)
            if control["type"] == "welcome":
                self._welcomed(view, control["session"], control["seq"])
        else:
            seq = parse_feedback(data).seq
            assert "internal error" not in data, data
            if seq is None:  # a document that was not taken
                assert self._full, data
                assert "could not be written to the journal" in data, data
                return
            follows = seq == view.last + 1 if view.whole else seq > view.last
            assert follows, f"{connection} in {view.session.id} got {seq} after {view.last}: {data}"
            view.last = seq
            assert self._sent[view.session].setdefault(seq, data) == data, "one number, one message"

    def _welcomed(self, view: View, name: str, newest: int) -> None:
        """What follows is what came after `seen`; after a gap it is all there is."""
        if view.session.id != name:
            # Who moves gets all feedback again; who stays what it has asked for.
            view.session, view.whole, view.last = self._hub.sessions[name], True, newest
        if view.asked is not None:
            view.last = view.asked if view.asked <= newest else 0
            view.asked = None

    # the end -----------------------------------------------------------------------------------

    def _end(self) -> None:
        """Everybody stops and goes; what plays ends, and the journal repeats all of it."""
        self._pump()
        for one in list(self._views):
            self._receive(one, '{"type":"stop"}')
        self._pump()
        while self._speaks:
            session, order = self._speaks.pop()
            session.on_speech(order.id, spoken(order), self.now)
            self._pump()
        self._until(self.now + 1)
        for one in list(self._views):
            self._leave_one(one)
        self._until(self.now + 100)
        for session in self._hub.sessions.values():
            if not self._full:
                assert not session.submission.queue, session.id
                self._again(session)

    def _leave_one(self, one: int) -> None:
        del self._views[one]
        self._hub.leave(one, self.now)
        self._pump()

    def _again(self, session: Session) -> None:
        """Another process tells the same, from the journal."""
        other = Session(session.id, self._settings, 0.0, named=True, epoch=EPOCH)
        kept = self._journal.claim(session.id)
        assert kept is not None
        restore_session(other, kept, spoken)
        while (due := next_wake(other)) <= self.now - session.clock.opened:
            other.tick(max(due, 0.0))
        first = max(session.feedback_log.first, other.feedback_log.first)
        first_log, again = session.feedback_log.since(first), other.feedback_log.since(first)
        for here, there in zip(first_log, again, strict=False):
            assert here == there, f"sent {here}, sent again {there}"
        assert len(first_log) == len(again), (first_log[len(again) :], again[len(first_log) :])


def spoken(order: Speak) -> Utterance:
    """What a voice makes of a text, always the same; of every other text with sound."""
    utterance = speak_to_length(SilentVoice(), replace(order.request, voice=None))
    if crc32(repr(order.request).encode()) % 2 or not utterance.duration:
        return utterance
    pcm = np.full(round(utterance.duration * RATE), 1000, np.int16)
    return replace(utterance, sample_rate=RATE, pcm=pcm, duration=len(pcm) / RATE)


@contextmanager
def no_error() -> Iterator[None]:
    """Fails where an exception is logged: one that only readers of the log would see."""
    found: list[str] = []

    class Handler(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            if record.exc_info:
                found.append(logging.Formatter().format(record))

    handler = Handler(logging.ERROR)
    logging.getLogger("realizer").addHandler(handler)
    try:
        yield
    finally:
        logging.getLogger("realizer").removeHandler(handler)
    assert not found, found[0]
