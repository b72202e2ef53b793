"""Plays a case of the corpus and records its feedback, faces and sound."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from functools import cached_property
from typing import Any

import numpy as np

from bml_schema import Block, BMLError, Feedback, PredictionFeedback, WarningFeedback, parse_feedback, read
from bml_schema.nodes import own as own_name
from realizer.animation.axis import AU_NAMES
from realizer.animation.fap.conversion import to_fap
from realizer.behaviours.registry import VOCABULARY
from realizer.core.options import PlayOptions
from realizer.core.settings import Settings
from realizer.playback.feedback_events import parse_warning
from realizer.playback.player import Player
from realizer.playback.scheduled_speech import ScheduledSpeech
from realizer.playback.speaking import submit_with_speech
from realizer.scheduling.timing import Schedule
from realizer.server.session.effects import Send, Speak
from realizer.server.session.session import Session
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.silent import SilentVoice
from realizer.tables import faps
from tests.cases import CORPUS, Case, Instant, LogLine, log_lines
from tests.wake_times import next_wake

__all__ = ["Played", "play", "play_in_session"]

MEDIA = CORPUS / "media"  # files that documents refer to
EPOCH = 1_700_000_000.0  # Unix time of the session's start
MAX_DEADLINES = 10_000  # in one case


class Step(Enum):
    """An action of the script that plays a case."""

    SEND = auto()
    PLAN = auto()
    SAMPLE = auto()


@dataclass
class Played:
    """The result of playing a case.

    Attributes:
        blocks: the parsed blocks, in order; several may have the same id.
        schedules: block id -> the final schedule of the last block with that id.
        feedback: the feedback as a client parses it.
        live_faces: instant -> name of AU or FAP -> value, sampled while the case plays.
        faces: the same, sampled after the end.
        speeches: the utterances, in order.
    """

    blocks: list[Block] = field(default_factory=list)
    schedules: dict[str, Schedule] = field(default_factory=dict)
    feedback: list[Feedback] = field(default_factory=list)
    live_faces: dict[Instant, dict[str, float]] = field(default_factory=dict)
    faces: dict[Instant, dict[str, float]] = field(default_factory=dict)
    speeches: tuple[ScheduledSpeech, ...] = ()

    @cached_property
    def log(self) -> list[LogLine]:
        return [line for feedback in self.feedback for line in log_lines(feedback)]

    @property
    def warnings(self) -> list[WarningFeedback]:
        return [f for f in self.feedback if isinstance(f, WarningFeedback)]

    @property
    def end(self) -> float:
        """The time of the last message."""
        return max((t for line in self.log for t in line.times), default=0.0)

    def time(self, point: str) -> float:
        """Return the seconds from block start of "behaviour:sync" of the first block, or
        "block:behaviour:sync".
        """
        first = next(iter(self.schedules.values()))
        behaviour, _, sync = point.partition(":")
        if behaviour in first.times:
            return first.at(behaviour, sync)
        block, behaviour, sync = point.split(":", 2)
        return self.schedules[block].at(behaviour, sync)

    def predicted(self, point: str) -> float:
        """Return the seconds from block start in the last prediction that names the behaviour."""
        name, _, sync = point.rpartition(":")
        for feedback in reversed(self.feedback):
            if isinstance(feedback, PredictionFeedback):
                for node in feedback.behaviours:
                    if node.id == name and sync in node.syncs:
                        return node.syncs[sync].offset
                    text = getattr(node, "text", None)
                    for part in getattr(text, "parts", ()):
                        if node.id == name and getattr(part, "id", "") == sync and part.ref is not None:
                            return float(part.ref.offset)
        raise KeyError(point)

    def late(self, name: str) -> float:
        """Return `realizer:late` in the last prediction that names the behaviour; 0 without the attribute."""
        for feedback in reversed(self.feedback):
            for node in feedback.behaviours if isinstance(feedback, PredictionFeedback) else ():
                if node.id == name:
                    return float(node.unknown_attributes.get(own_name("late"), 0.0))
        raise KeyError(name)


def play(
    case: Case,
    document: bytes | None = None,
    *,
    live_instants: Sequence[Instant] = (),
    instants: Sequence[Instant] = (),
    punctual: bool = True,
) -> Played:
    """Play a case.

    Args:
        document: replaces the case's own document.
        live_instants: when to sample faces while the case plays.
        instants: the instants to sample after the end.
        punctual: whether the player is called at each deadline, or only when a document is sent or a face is
            sampled.
    """
    wanted = case.wanted
    scene = {name: (x, y, z) for name, (x, y, z) in wanted.get("scene", {}).items()}
    player = Player(
        PlayOptions(scene=scene if "scene" in wanted else None, idle=wanted.get("idle", False), media=MEDIA),
        history=math.inf,
    )
    items = list(read(case.document if document is None else document, VOCABULARY))
    sent = [float(time) for time in wanted.get("sent", ())]
    sent += [max([0.0, *sent])] * (len(items) - len(sent))
    ready = [float(time) for time in wanted.get("ready", ())]
    ready += sent[len(ready) :]
    script: list[tuple[float, Step, Any]] = []
    for sent_at, ready_at, item in zip(sent, ready, items, strict=True):
        script += [(sent_at, Step.SEND, item), (ready_at, Step.PLAN, item)]
    script += [(instant.time, Step.SAMPLE, instant) for instant in live_instants]
    played, voice, now = Played(), SilentVoice(), 0.0
    for time, step, item in sorted(script, key=lambda entry: entry[0]):
        advance(player, played, now, time, punctual)
        now = time
        match step, item:
            case Step.SAMPLE, Instant():
                played.live_faces |= sample_faces(player, [item])
            case Step.SEND, Block():
                player.announce(item, time)
            case Step.PLAN, Block():
                played.blocks.append(item)
                played.schedules[item.id] = submit_with_speech(player, item, voice, time)
            case Step.SEND, BMLError():
                player.refuse(parse_warning(item))
    advance(player, played, now, math.inf, punctual)
    for id, schedule in played.schedules.items():
        played.schedules[id] = player.latest(schedule)
    played.faces = sample_faces(player, instants)
    played.speeches = player.speech()
    return played


def play_in_session(case: Case) -> list[LogLine]:
    """Send the documents of a case to a session, at their times, and return its log without predictions."""
    wanted = case.wanted
    session = Session("corpus", Settings(idle=wanted.get("idle", False), media=MEDIA), 0.0, epoch=EPOCH)
    voice, sent_texts, log = SilentVoice(), list[str](), list[LogLine]()
    session.connect(1, 0.0)

    def work(now: float) -> None:
        session.tick(now)
        for effect in session.take_effects():
            if isinstance(effect, Speak):
                session.on_speech(effect.id, speak_to_length(voice, effect.request), now)
                work(now)
            elif isinstance(effect, Send) and isinstance(effect.data, str) and effect.data[0] == "<":
                sent_texts.append(effect.data)

    now = 0.0
    for time, message in [*case.messages, (math.inf, "")]:
        while (deadline := next_wake(session)) < time:
            now = max(now, deadline)
            work(now)
        if message:
            now = time
            session.receive(1, message, now)
            work(now)
            while session.has_documents:
                work(now)
    for text in sent_texts:
        log += [line for line in log_lines(parse_feedback(text, VOCABULARY)) if line.kind != "prediction"]
    return log


def advance(player: Player, played: Played, now: float, until: float, punctual: bool) -> None:
    """Advance the time from deadline to deadline, and collect the feedback."""
    for _ in range(MAX_DEADLINES):
        deadline = player.next_deadline()
        if not punctual or deadline is None or deadline >= until:
            break
        now = max(now, deadline)
        collect(player, played, now, until)
    else:
        raise AssertionError(f"more than {MAX_DEADLINES} deadlines")
    collect(player, played, until, until)


def collect(player: Player, played: Played, now: float, starts_before: float = math.inf) -> None:
    for feedback in player.due(now, starts_before):
        text = feedback.to_xml(len(played.feedback) + 1, EPOCH)
        played.feedback.append(parse_feedback(text, VOCABULARY))


def sample_faces(player: Player, instants: Iterable[Instant]) -> dict[Instant, dict[str, float]]:
    """Return instant -> name of AU ("12L", "12R", "12" if both are equal) or FAP -> value."""
    out: dict[Instant, dict[str, float]] = {}
    by_character: dict[str | None, list[Instant]] = {}
    for instant in sorted(set(instants), key=lambda i: i.time):
        by_character.setdefault(instant.character, []).append(instant)
    for character, own in by_character.items():
        index = player.cast.index_of(character) if character else 0
        frames = player.frames(np.array([instant.time for instant in own]), index)
        for instant, aus, values in zip(own, frames.aus, to_fap(frames).values, strict=True):
            face = dict(zip(AU_NAMES(), map(float, aus), strict=True))
            face |= {n[:-1]: v for n, v in face.items() if n[-1] == "L" and v == face[f"{n[:-1]}R"]}
            out[instant] = face | {row.name: float(v) for row, v in zip(faps(), values, strict=True)}
    return out
