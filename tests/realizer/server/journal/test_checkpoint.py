"""Checkpoints: a restored session behaves as if it had never died."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, fields
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.axis import axis
from realizer.animation.channel import Channel, Crossfade, Gain, Layer
from realizer.animation.idle.blinks import OnsetMask
from realizer.core.settings import Settings
from realizer.playback.character import BaseShift, Character
from realizer.protocol.wire import ClipPiece, pack_clip
from realizer.scheduling.timing import Schedule
from realizer.server.journal import session_journal as thresholds
from realizer.server.journal.checkpoint import (
    character_from_json,
    character_to_json,
    schedule_from_json,
    schedule_to_json,
)
from realizer.server.journal.replay import restore_session
from realizer.server.session.effects import Speak
from realizer.server.session.session import Session
from realizer.speech.voice_activity import VoiceActivity
from tests.interleavings import BODIES, CONTROLS, HEADS, NAMES, Memory, no_error, spoken
from tests.wake_times import next_wake

SETTINGS = Settings(voice="silent")
EPOCH = 1.7e9
RATE = 8000
# Documents with contents that the others lack, and lasting effects.
MORE = (
    '<faceShift id="s" lexeme="SMILE" end="0.7"/>',
    '<gazeShift id="s" target="cup" end="0.4"/><pointing id="p" target="cup"/>',
    '<realizer:mood xmlns:realizer="urn:bml-realizer:1" id="m" name="joy" end="0.5"/>',
    '<realizer:idle xmlns:realizer="urn:bml-realizer:1" id="i" blinks="0.2" motion="0.5" end="0.3"/>',
    '<bmlt:audiofile xmlns:bmlt="http://hmi.ewi.utwente.nl/bmlt" id="a" fileName="clip:c"/>',
    '<speech id="s"><text>Here it is</text></speech><head id="n" lexeme="NOD" start="{other}:bml:end"/>',
)
OWN_HEADS = (*HEADS, 'characterId="Ben"', 'characterId="Ben"')
# Lasting effects, more often than among all documents.
LASTING = (
    {"type": "set", "emotion": {"name": "joy", "intensity": 0.7}},
    {"type": "set", "emotion": {"name": "sadness"}, "character": "Ben"},
    {"type": "set", "aus": {"12L": 0.5, "4": 1}, "faps": {"open_jaw": 200}},
    {"type": "set", "aus": {"1": 0.3}, "character": "Ben"},
    {"type": "character", "id": "Ben", "voice": "silent"},
    {"type": "character", "id": "Ben", "face": "ben"},
    {"type": "scene", "objects": {"cup": {"x": -0.3, "y": 0.1, "z": 0.4}}},
    {"type": "anticipate", "id": "clock", "syncs": {"beat": 60.0}},
)


def opened(journal: Memory | None) -> Session:
    session = Session("s", SETTINGS, 0.0, named=True, epoch=EPOCH)
    session.journal.open(journal)
    session.journal.begin(EPOCH)
    return session


@dataclass
class Run:
    """A session with its clock at 0, and what its voice owes it."""

    session: Session
    owed: dict[int, Speak] = field(default_factory=dict)
    now: float = 0.0  # time never goes back

    def collect(self) -> None:
        self.owed |= {
            effect.id: effect for effect in self.session.take_effects() if isinstance(effect, Speak)
        }

    def until(self, t: float) -> None:
        while (due := next_wake(self.session)) <= t:
            self.now = max(due, self.now)
            self.session.tick(self.now)
            self.collect()
        self.now = t


class Pair:
    """Two sessions with the same input, one of which dies now and then and is restored from its journal."""

    def __init__(self, seed: int) -> None:
        self.random = Random(seed)
        self.journal = Memory()
        self.whole, self.torn = Run(opened(None)), Run(opened(self.journal))
        self.restored = 0
        self._now = 0.0
        self._connection = 1
        for run in (self.whole, self.torn):
            run.session.connect(1, 0.0)

    def run(self, steps: int) -> None:
        for _ in range(steps):
            self.random.choice(
                (self._send, self._send, self._control, self._clip, self._hear, self._answer, self._rest)
            )()
            self._pass(self.random.choice((0.0, 0.02, 0.3, 1.0)))
            self._agree()
            if self.random.random() < 0.15:
                self._die()
                self._agree()

    def _both(self, message: str | bytes) -> None:
        for run in (self.whole, self.torn):
            run.session.receive(self._connection, message, self._now)
            run.collect()

    def _send(self) -> None:
        body = self.random.choice(BODIES + MORE)
        text = f'<bml id="{self.random.choice(NAMES)}" {self.random.choice(OWN_HEADS)}>{body}</bml>'
        self._both(text.replace("{other}", self.random.choice(NAMES)))

    def _control(self) -> None:
        message = self.random.choice(CONTROLS if self.random.random() < 0.5 else LASTING)
        if message["type"] != "subscribe":  # frames are looked at without
            self._both(json.dumps(message))

    def _clip(self) -> None:
        number, rate = self.random.choice((0, 0, 1)), self.random.choice((RATE, RATE, 0))
        sound = self.random.randbytes(2 * RATE // 10)
        self._both(pack_clip(ClipPiece(self.random.choice("cd"), number, rate, sound, number == 1)))

    def _hear(self) -> None:
        """Send sound that a character hears; another call may continue the same turn."""
        sound = self.random.choice((bytes(RATE), self.random.randbytes(RATE)))
        id = self.random.choice(("heard:", "heard:Ben"))
        self._both(pack_clip(ClipPiece(id, 0, RATE, sound, self.random.random() < 0.1)))

    def _answer(self) -> None:
        """Answer speech requests, in another order."""
        ids = sorted(self.whole.owed.keys() | self.torn.owed.keys())
        self.random.shuffle(ids)
        for id in ids:
            for run in (self.whole, self.torn):
                if (order := run.owed.pop(id, None)) is not None:
                    run.session.on_speech(id, spoken(order), self._now)
                    run.collect()

    def _rest(self) -> None:
        """Send nothing until nothing is visible any more; most open speeches are closed."""
        if self.random.random() < 0.7:
            self._both('{"type": "stop"}')
            for id in ("turn", "other"):
                self._both(json.dumps({"type": "speech", "id": id, "close": True}))
        for _ in range(4):
            self._answer()
            self._pass(1.5)
        for run in (self.whole, self.torn):
            run.session.compact_journal(self._now)

    def _pass(self, seconds: float) -> None:
        self._now += seconds
        for run in (self.whole, self.torn):
            run.until(self._now)

    def _die(self) -> None:
        kept = self.journal.claim("s")
        assert kept is not None
        session = Session("s", SETTINGS, 0.0, named=True, epoch=EPOCH)
        _, owed = restore_session(session, kept, spoken)
        session.journal.open(self.journal)
        session.journal.resume(kept)
        self.torn = Run(
            session, {effect.id: effect for effect in owed if isinstance(effect, Speak)}, self._now
        )
        self.restored += bool(kept.parts)
        for run in (self.torn, self.whole):
            run.until(self._now)
            run.session.disconnect(self._connection, self._now)
            run.session.connect(self._connection + 1, self._now)
            run.until(self._now)
        self._connection += 1

    def _agree(self) -> None:
        whole, torn = self.whole.session, self.torn.session
        first = max(torn.feedback_log.first, whole.feedback_log.first)
        assert torn.feedback_log.since(first) == whole.feedback_log.since(first)
        assert torn.feedback_log.newest == whole.feedback_log.newest
        assert torn.player.characters == whole.player.characters
        assert torn.clips.ids == whole.clips.ids
        assert (torn.faces.assigned, torn.submission.voices) == (
            whole.faces.assigned,
            whole.submission.voices,
        )
        assert torn.submission.tts.fault == whole.submission.tts.fault
        times = self._now + np.arange(4) / 25
        for index in range(len(whole.player.characters)):
            one, other = (session.player.frames(times, index) for session in (whole, torn))
            assert np.array_equal(one.aus, other.aus)
            assert np.array_equal(one.faps, other.faps)


@pytest.fixture
def eager(monkeypatch: pytest.MonkeyPatch) -> None:
    """Checkpoints are taken wherever one can be."""
    monkeypatch.setattr(thresholds, "ENTRIES", 1)


@pytest.mark.slow
def test_checkpoint_restores_a_session_as_if_it_had_never_died(
    eager: None,
) -> None:
    taken = restored = 0
    for seed in range(5):
        pair = Pair(seed)
        with no_error():
            pair.run(60)
        taken += pair.journal.compacted
        restored += pair.restored
    assert taken > 50
    assert restored > 25


NUMBER = st.floats(-1e6, 1e6)
TIMES = st.lists(NUMBER, min_size=1, max_size=5, unique=True).map(sorted)
ANY_NAME = st.text(max_size=8)


@st.composite
def channels(draw: st.DrawFn) -> Channel:
    times = draw(TIMES)
    values = st.lists(NUMBER, min_size=len(times), max_size=len(times)).map(np.array)
    gains = draw(st.lists(st.builds(Gain, NUMBER, NUMBER, NUMBER, st.sampled_from(("smooth", "linear")))))
    return draw(st.sampled_from((Channel, OnsetMask)))(
        axis()[draw(st.sampled_from(sorted(axis())))],
        np.array(times),
        draw(values),
        curve=draw(st.sampled_from(("smooth", "linear"))),
        layer=draw(st.sampled_from(Layer)),
        keeps_last=draw(st.booleans()),
        gains=tuple(gains),
        until=draw(NUMBER | st.just(math.inf)),
        crossfade=draw(st.none() | st.builds(Crossfade, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER)),
        weight=draw(st.none() | values),
        source=draw(ANY_NAME),
    )


SHIFTS = st.builds(
    BaseShift,
    NUMBER,
    NUMBER,
    st.frozensets(st.sampled_from(("head", "eyes", "mouth"))),
    st.lists(channels(), max_size=2).map(tuple),
)
HELD = st.dictionaries(ANY_NAME, channels(), max_size=2)
SAMPLES = st.lists(st.integers(-32768, 32767), max_size=5).map(lambda samples: np.array(samples, np.int16))
COUNT = st.integers(0, 100)
HEARD = st.none() | st.builds(VoiceActivity, COUNT, SAMPLES, NUMBER, COUNT, COUNT, st.booleans())
CHARACTERS = st.builds(
    Character, st.none() | ANY_NAME, st.lists(SHIFTS, max_size=2), HELD, HELD, st.just([]), HEARD
)


def same(one: object, other: object) -> bool:
    """To the last bit, through everything."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other)  # type: ignore[attr-defined]
    if isinstance(one, Channel | BaseShift | Character | Schedule | VoiceActivity):
        return all(same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    if isinstance(one, dict):
        assert isinstance(other, dict)
        return list(one) == list(other) and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple) and not isinstance(one, Gain | Crossfade):
        assert isinstance(other, list | tuple)
        return len(one) == len(other) and all(map(same, one, other))
    return one == other


@given(CHARACTERS)
def test_character_to_json_round_trip(character: Character) -> None:
    assert same(character_from_json(json.loads(json.dumps(character_to_json(character)))), character)


@given(
    ANY_NAME, NUMBER, st.dictionaries(ANY_NAME, st.lists(st.tuples(ANY_NAME, NUMBER), max_size=4), max_size=4)
)
def test_schedule_to_json_round_trip(
    block: str, start: float, behaviours: dict[str, list[tuple[str, float]]]
) -> None:
    points = {name: tuple(point for point, _ in pairs) for name, pairs in behaviours.items()}
    times = {name: np.array([time for _, time in pairs], float) for name, pairs in behaviours.items()}
    schedule = Schedule(block, points, times, start=start)
    assert same(schedule_from_json(json.loads(json.dumps(schedule_to_json(schedule)))), schedule)
