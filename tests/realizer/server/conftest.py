"""A session on a clock of its own: time jumps from deadline to deadline; tests say when voices answer."""

from __future__ import annotations

import json
import time
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from bml_schema.feedback import parse_feedback
from realizer.core.settings import Settings
from realizer.protocol.wire import unpack
from realizer.server.session.effects import Close, Draw, Effect, Send, Speak
from realizer.server.session.session import Session
from realizer.speech.utterance import Utterance
from tests.wake_times import next_wake

NOD = '<bml id="{}"><head id="n" lexeme="NOD"/></bml>'
TALK = '<bml id="{}"><speech id="s"><text>Hello there</text></speech></bml>'
RATE = 22050


class Clock:
    """The machine's clock, which somebody sets: `time.time` with steps."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        real = time.time
        self.step = 0.0
        monkeypatch.setattr(time, "time", lambda: real() + self.step)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    return Clock(monkeypatch)


@pytest.fixture
def kept(tmp_path: Path) -> Settings:
    """Of a service whose named sessions another one with the same settings can go on with."""
    return Settings(port=0, voice="silent", journal=str(tmp_path / "journal.db"))


def spoken(seconds: float = 1.0) -> Utterance:
    """A second of a rising ramp, so that every sample differs from its neighbours."""
    pcm = (np.arange(round(seconds * RATE)) % 30000).astype(np.int16)
    return Utterance(seconds, (), (), {}, RATE, pcm)


@dataclass
class Client:
    """What one connection got."""

    messages: list[str | bytes] = field(default_factory=list)
    times: list[float] = field(default_factory=list)  # when each was sent, on the session clock

    @property
    def feedback(self):
        return [parse_feedback(m) for m in self.messages if isinstance(m, str) and m.startswith("<")]

    @property
    def ids(self) -> list[str]:
        return [getattr(f, "id", "prediction") for f in self.feedback]

    @property
    def json(self):
        return [json.loads(m) for m in self.messages if isinstance(m, str) and m.startswith("{")]

    @property
    def frames(self):
        return [unpack(m) for m in self.messages if isinstance(m, bytes)]

    def of(self, kind: str):
        return [m for m in self.json if m["type"] == kind]


class Driver:
    """The shell, without sockets: it keeps what is sent, and answers voices at once unless `mute`."""

    def __init__(self, *, named: bool = False, mute: bool = False, opened: float = 100.0, **limits) -> None:
        self.session = Session("test", Settings(**limits), opened, named=named)
        self.opened = opened
        self.now = 0.0  # on the session clock
        self.mute = mute
        self.clients: dict[int, Client] = defaultdict(Client)
        self.spoken: list[Speak] = []
        self.draws: list[Draw] = []
        self.closed: list[Close] = []
        self.join(1)

    def join(self, connection: int, seen: int | None = None) -> Client:
        self.session.connect(connection, self.opened + self.now, seen)
        self.collect()
        return self.clients[connection]

    def leave(self, connection: int) -> None:
        self.session.disconnect(connection, self.opened + self.now)
        self.collect()

    def send(self, message, connection: int = 1) -> Client:
        """A message comes, and whatever is due at this instant is done."""
        text = json.dumps(message) if isinstance(message, dict) else message
        self.session.receive(connection, text, self.opened + self.now)
        self.collect()
        self.run(self.now)
        return self.clients[connection]

    def say(self, number: int, result) -> None:
        self.session.on_speech(number, result, self.opened + self.now)
        self.collect()
        self.run(self.now)

    def run(self, until: float) -> Client:
        """Tick at every deadline up to `until` (on the session clock)."""
        while (deadline := next_wake(self.session)) <= self.opened + until:
            self.now = max(self.now, deadline - self.opened)
            self.wake()
        self.now = until
        return self.clients[1]

    def wake(self) -> None:
        """As the shell does it."""
        due = None
        if not self.session.has_documents:
            due = self.session.ticker.send_ready(self.session.clock.read(self.opened + self.now))
        if due is None:
            self.session.tick(self.opened + self.now)
        else:
            assert due + self.opened == self.session.next_due()
        self.collect()

    def collect(self) -> None:
        for effect in self.session.take_effects():
            self.do(effect)

    def do(self, effect: Effect) -> None:
        match effect:
            case Send(connection, data):
                self.clients[connection].messages.append(data)
                self.clients[connection].times.append(self.now)
            case Speak(id):
                self.spoken.append(effect)
                if not self.mute:
                    self.session.on_speech(id, spoken(), self.opened + self.now)
                    self.collect()
            case Draw():
                self.draws.append(effect)
            case Close():
                self.closed.append(effect)


@pytest.fixture
def driver() -> Driver:
    return Driver()


@pytest.fixture
def drive() -> type[Driver]:
    return Driver
