"""The cases of the corpus: NAME.toml and NAME.xml in, what was told and shown when it was played out.

A case is played as a session would: the player is told the time; no clock, no sound, no idle motion.
Keys of a .toml; all but `says` and `proves` are optional:

    says       what must be true, as a sentence
    proves     the rules (tests/corpus/rules.toml) that it shows to hold

    sent       when each document of the .xml is sent, seconds; 0 for those beyond the list
    [scene]    target = [x, y, z], declared before the first document
    idle       true: with idle motion
    within     tolerance of times, seconds

    refused    true: nothing plays, and exactly one warning says why
    warnings   [[id, type], ...]: exactly these, in any order
    contains   found in the text of one of the warnings; so are `path` and `line`
    [reads]    "behaviour" = its element; "behaviour.attribute", "block.attribute", "behaviour.poses.0.part" =
               the value it was read as
    dropped    behaviours that are not scheduled

    [at]       "behaviour:sync" = seconds from block start; "block:behaviour:sync" likewise for another block
    order      sync points that do not decrease
    equal      groups of sync points that fall together; these two compare sync points of one block
    [lasts]    "behaviour:sync..behaviour:sync" = seconds
    [predicted] "block:behaviour:sync" = seconds from block start, as the last prediction that names it has it

    log        everything that was told, in this order, of those kinds that the list names. An entry is
               "KIND ID [WORD] [SECONDS [SECONDS]]" with seconds of the session clock:
                   prediction b LURKING 0 2     of a block, with its start and end
                   start b IN_EXEC 0            blockProgress
                   sync b:nod:stroke 0.37       syncPointProgress
                   end b DONE 2                 blockProgress
                   warning b:nod PARSING_FAILURE
               words and seconds may be left out from the end
    among      these were told in this order, among others
    once       each of these was told exactly once
    never      none of these was told

    [[face]]   what a face shows at an instant: `at` (seconds of the session clock), `character`, and
               [face.shows] "12" (AU of both sides), "12L", or the name of a FAP = a value, or [least, most]
    [[smooth]] what must not jump: `from`, `to`, `of` (names as above; left out: all AUs), `most`: the largest
               change in 0.01 s, in the units of what is shown
    as_if      a document of the same meaning: read as the same nodes, told and shown the same
    unlike     a document of another meaning: something else is read, and told or shown
    heard      [[from, to], ...]: what sounds when, seconds of the session clock, in order
    loud       [[seconds, part], ...]: what the sound of the first that sounds is multiplied with
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bml_schema import (
    Block,
    BlockProgress,
    Feedback,
    PredictionFeedback,
    SyncPointProgress,
    WarningFeedback,
    parse_feedback,
    read,
)
from realizer.animation.fap import to_fap
from realizer.animation.targets import AU_NAMES
from realizer.behaviours import VOCABULARY
from realizer.pipeline import speak, warning_of
from realizer.player import Player, Speaking
from realizer.scheduling.timing import Schedule
from realizer.speech import SilentVoice
from realizer.tables import faps

__all__ = ["CASES", "CORPUS", "Case", "Played", "Told", "told"]

CORPUS = Path(__file__).parent / "corpus"
MEDIA = CORPUS / "media"  # the files that documents name
_KEYS = frozenset(re.findall(r"^    \[*(\w+)", __doc__, re.MULTILINE)) | {"path", "line"}
MOST_STEPS = 10_000  # deadlines of one case
# Some day a session opened; times of feedback are rounded to a microsecond on the wire.
EPOCH = 1_700_000_000.0


class Told(NamedTuple):
    """One feedback, or an expectation of one, as a line of `log` has it."""

    kind: str
    id: str
    words: tuple[str, ...] = ()
    times: tuple[float, ...] = ()

    @classmethod
    def read(cls, line: str) -> Told:
        """Raises ValueError for a line that is none."""
        kind, id, *rest = line.split()
        if kind not in ("prediction", "start", "sync", "end", "warning"):
            raise ValueError(f"{line}: wanted prediction, start, sync, end or warning")
        words = tuple(w for w in rest if not w[0].isdigit() and w[0] not in "-.")
        return cls(kind, id, words, tuple(map(float, rest[len(words) :])))

    def is_as(self, wanted: Told, within: float) -> bool:
        """It is what `wanted` asks for; what that leaves out at its end may be anything."""
        return (
            (self.kind, self.id) == (wanted.kind, wanted.id)
            and self.words[: len(wanted.words)] == wanted.words
            and len(self.times) >= len(wanted.times)
            and all(abs(a - b) <= within for a, b in zip(self.times, wanted.times, strict=False))
        )

    def __str__(self) -> str:
        return " ".join([self.kind, self.id, *self.words, *(f"{time:.6g}" for time in self.times)])


def told(feedback: Feedback) -> Iterable[Told]:
    """The lines of one feedback; a prediction has one for each block it names."""
    match feedback:
        case BlockProgress():
            id, _, point = feedback.id.rpartition(":")
            yield Told(point, id, (feedback.status,) if feedback.status else (), (feedback.global_time,))
        case SyncPointProgress():
            yield Told("sync", feedback.id, (), (feedback.global_time,))
        case WarningFeedback():
            yield Told("warning", feedback.id, (feedback.type,))
        case PredictionFeedback():
            for block in feedback.blocks:
                times = tuple(t for t in (block.global_start, block.global_end) if t is not None)
                yield Told("prediction", block.id, (block.status,) if block.status else (), times)


class Instant(NamedTuple):
    """A face at a time."""

    time: float
    character: str | None = None


@dataclass
class Played:
    """What playing came to.

    Attributes:
        blocks: those that were read, in order; an id may be used again.
        schedules: block id -> what `submit` returned, the last of that id.
        feedback: as a client gets it: written as XML and read again.
        faces: instant -> name of AU or FAP -> value.
        speaking: what sounded, or would have with a voice, in order.
    """

    blocks: list[Block] = field(default_factory=list)
    schedules: dict[str, Schedule] = field(default_factory=dict)
    feedback: list[Feedback] = field(default_factory=list)
    faces: dict[Instant, dict[str, float]] = field(default_factory=dict)
    speaking: tuple[Speaking, ...] = ()

    @cached_property
    def log(self) -> list[Told]:
        return [line for feedback in self.feedback for line in told(feedback)]

    @property
    def warnings(self) -> list[WarningFeedback]:
        return [f for f in self.feedback if isinstance(f, WarningFeedback)]

    @property
    def end(self) -> float:
        """When the last thing was told."""
        return max((t for line in self.log for t in line.times), default=0.0)

    def time(self, point: str) -> float:
        """Seconds from block start of "behaviour:sync" of the first block, or of "block:behaviour:sync"."""
        first = next(iter(self.schedules.values()))
        behaviour, _, sync = point.partition(":")
        if behaviour in first.times:
            return first.at(behaviour, sync)
        block, behaviour, sync = point.split(":", 2)
        return self.schedules[block].at(behaviour, sync)

    def predicted(self, point: str) -> float:
        """Seconds from block start, as the last prediction that names the behaviour has it."""
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


@dataclass(frozen=True)
class Case:
    """One case of the corpus."""

    path: Path

    @property
    def name(self) -> str:
        return self.path.relative_to(CORPUS).with_suffix("").as_posix()

    @cached_property
    def wanted(self) -> dict[str, Any]:
        wanted = tomllib.loads(self.path.read_text("utf-8"))
        if unknown := wanted.keys() - _KEYS:
            raise ValueError(f"{self.name}: wanted keys that tests/cases.py knows, got {sorted(unknown)}")
        return wanted

    @property
    def proves(self) -> tuple[str, ...]:
        return tuple(self.wanted.get("proves", ()))

    @property
    def document(self) -> bytes:
        return self.path.with_suffix(".xml").read_bytes()

    @property
    def instants(self) -> list[Instant]:
        """When this case looks at a face."""
        seen = [Instant(float(f["at"]), f.get("character")) for f in self.wanted.get("face", ())]
        for s in self.wanted.get("smooth", ()):
            times = np.arange(math.floor(s["from"] * 100), math.ceil(s["to"] * 100) + 1) / 100
            seen += [Instant(float(time), s.get("character")) for time in times]
        return sorted(set(seen), key=lambda instant: instant.time)

    def play(
        self,
        document: bytes | None = None,
        instants: Sequence[Instant] | None = None,
        *,
        punctual: bool = True,
    ) -> Played:
        """Play it.

        Args:
            document: another one in its place.
            instants: when to look at a face; None: when the case does.
            punctual: the player hears of each deadline when it is there; otherwise only when a document is
                sent or a face is looked at.
        """
        wanted = self.wanted
        items = list(read(self.document if document is None else document, VOCABULARY))
        sent = list(wanted.get("sent", ()))
        times = [float(sent[n]) if n < len(sent) else max([0.0, *sent]) for n in range(len(items))]
        script: list[tuple[float, int, Any]] = [
            (time, 0, item) for time, item in zip(times, items, strict=True)
        ]
        script += [(i.time, 1, i) for i in (self.instants if instants is None else instants)]
        scene = (
            {name: (x, y, z) for name, (x, y, z) in wanted["scene"].items()} if "scene" in wanted else None
        )
        player = Player(scene=scene, idle=wanted.get("idle", False), media=MEDIA, history=math.inf)
        played = Played()
        voice = SilentVoice()

        now = 0.0

        def hear(until: float) -> None:
            """Let the time pass, in the steps in which it has something to tell."""
            nonlocal now
            for _ in range(MOST_STEPS):
                deadline = player.next_deadline()
                if not punctual or deadline is None or deadline > until:
                    break
                now = max(now, deadline)
                collect(now)
            else:
                raise AssertionError(f"{self.name}: it goes on for ever")
            now = until
            collect(now)

        def collect(now: float) -> None:
            for feedback in player.due(now):
                played.feedback.append(
                    parse_feedback(feedback.to_xml(len(played.feedback) + 1, EPOCH), VOCABULARY)
                )

        for time, _, item in sorted(script, key=lambda entry: entry[:2]):
            hear(time)
            if isinstance(item, Instant):
                played.faces[item] = shown(player, item)
            elif isinstance(item, Block):
                played.blocks.append(item)
                played.schedules[item.id] = player.submit(item, time, speak(player.wants(item), voice))
            else:
                player.refuse(warning_of(item), time)
        hear(math.inf)
        played.speaking = player.speech()
        return played


def shown(player: Player, instant: Instant) -> dict[str, float]:
    """Name of AU ("12" where both sides are equal, "12L", "12R") or FAP -> value."""
    index = player.character_index(instant.character) if instant.character else 0
    frames = player.frames(np.array([instant.time]), index)
    values = {name: float(v) for name, v in zip(AU_NAMES(), frames.aus[0], strict=True)}
    for name in AU_NAMES():
        if name.endswith("L") and values[name] == values[f"{name[:-1]}R"]:
            values[name[:-1]] = values[name]
    values |= {row.name: float(v) for row, v in zip(faps(), to_fap(frames).values[0], strict=True)}
    return values


@cache
def _cases() -> tuple[Case, ...]:
    return tuple(Case(path) for path in sorted(CORPUS.rglob("*.toml")) if path.parent != CORPUS)


CASES = _cases()
