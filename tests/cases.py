"""The cases of the corpus: NAME.xml has one or several documents, NAME.toml what playing them must give.

A case is played as in a session, with simulated time and a silent voice, by default without idle motion.
Keys of a .toml; all but `says` and `proves` are optional:

    says       a sentence that describes what must be true
    proves     names of the rules (tests/corpus/rules.toml) that the case tests

    sent       when each document of the .xml is sent, in seconds; the last time holds for further documents
    ready      when the speech of each document has been synthesized, in seconds; by default when it is sent
    [scene]    target = [x, y, z], declared before the first document
    idle       true: with idle motion
    within     tolerance of times, seconds

    refused    true: nothing plays, and exactly one warning says why
    warnings   [[id, type], ...]: exactly these, in any order
    contains   a part of the text of one of the warnings; `path` and `line` likewise
    [reads]    "behaviour" = name of its element; "behaviour.attribute", "block.attribute",
               "behaviour.poses.0.part" = the parsed value
    dropped    behaviours that are not scheduled

    [at]       "behaviour:sync" = seconds from block start; "block:behaviour:sync" likewise for another block
    order      sync points that do not decrease
    equal      groups of sync points with the same time; `order` and `equal` compare sync points of one block
    [lasts]    "behaviour:sync..behaviour:sync" = seconds
    [predicted] "block:behaviour:sync" = seconds from block start in the last prediction that names it
    [late]     "block:behaviour" = seconds of its attribute realizer:late in that prediction

    log        the feedback in this order, of the kinds that occur in the list. An entry is
               "KIND ID [WORD] [SECONDS [SECONDS]]" with seconds of the session clock:
                   prediction b LURKING 0 2     prediction of a block, with its start and end
                   start b IN_EXEC 0            blockProgress
                   sync b:nod:stroke 0.37       syncPointProgress
                   end b DONE 2                 blockProgress
                   warning b:nod PARSING_FAILURE
               the last words and seconds of an entry may be omitted
    among      entries that occur in this order, with others between them
    characters all characterIds that the feedback names; [""] for none
    once       entries that occur exactly once
    never      entries that do not occur

    [[face]]   the values of a face at an instant: `at` (seconds of the session clock), `character`, and
               [face.shows] "12" (AU of both sides), "12L", or the name of a FAP = a value, or [least, most]
    [[smooth]] values that must not jump: `from`, `to`, `of` (names as above; default: all AUs), `most`: the
               largest change in 0.01 s, in the units of the values
    as_if      a document with the same meaning: the same nodes, feedback and faces
    unlike     a document with another meaning: other nodes, and other feedback or faces
    heard      [[from, to], ...]: when each utterance sounds, in order, seconds of the session clock
    loud       [[seconds, factor], ...]: the volume of the first utterance at these times
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bml_schema import BlockProgress, Feedback, PredictionFeedback, SyncPointProgress, WarningFeedback
from bml_schema.reading.document_splitter import document_spans

__all__ = ["CASES", "CORPUS", "Case", "Instant", "LogLine", "log_lines"]

CORPUS = Path(__file__).parent / "corpus"
_KEYS = frozenset(re.findall(r"^    \[*(\w+)", __doc__, re.MULTILINE)) | {"path", "line"}


class LogLine(NamedTuple):
    """A feedback message, or an expectation of one, as a line of `log`."""

    kind: str
    id: str
    words: tuple[str, ...] = ()
    times: tuple[float, ...] = ()

    @classmethod
    def read(cls, line: str) -> LogLine:
        """Parse a line; raise ValueError for a wrong one."""
        kind, id, *rest = line.split()
        if kind not in ("prediction", "start", "sync", "end", "warning"):
            raise ValueError(f"{line}: wanted prediction, start, sync, end or warning")
        words = tuple(w for w in rest if not w[0].isdigit() and w[0] not in "-.")
        return cls(kind, id, words, tuple(map(float, rest[len(words) :])))

    def matches(self, wanted: LogLine, within: float) -> bool:
        """Return whether it matches `wanted`, whose last words and seconds may be missing."""
        return (
            (self.kind, self.id) == (wanted.kind, wanted.id)
            and self.words[: len(wanted.words)] == wanted.words
            and len(self.times) >= len(wanted.times)
            and all(abs(a - b) <= within for a, b in zip(self.times, wanted.times, strict=False))
        )

    def __str__(self) -> str:
        return " ".join([self.kind, self.id, *self.words, *(f"{time:.6g}" for time in self.times)])


def log_lines(feedback: Feedback) -> Iterable[LogLine]:
    """Return the lines of one feedback message; a prediction has one for each block."""
    match feedback:
        case BlockProgress():
            id, _, point = feedback.id.rpartition(":")
            yield LogLine(point, id, (feedback.status,) if feedback.status else (), (feedback.global_time,))
        case SyncPointProgress():
            yield LogLine("sync", feedback.id, (), (feedback.global_time,))
        case WarningFeedback():
            yield LogLine("warning", feedback.id, (feedback.type,))
        case PredictionFeedback():
            for block in feedback.blocks:
                times = tuple(t for t in (block.global_start, block.global_end) if t is not None)
                yield LogLine("prediction", block.id, (block.status,) if block.status else (), times)


class Instant(NamedTuple):
    """A time at which a face is checked."""

    time: float
    character: str | None = None


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
    def is_bytes(self) -> bool:
        """Whether the case is about bytes that a message, which is text that begins with "<", cannot be."""
        return self.name.startswith(("documents/encoding", "invalid/not-xml"))

    @property
    def messages(self) -> list[tuple[float, str]]:
        """What a client sends, (seconds, text): the scene, then the documents of each time in one message."""
        text = self.document.decode("utf-8-sig")
        spans = list(document_spans(text))
        sent = [float(time) for time in self.wanted.get("sent", ())] or [0.0]
        sent += [max([0.0, *sent])] * (len(spans) - len(sent))
        ends = [span.start for span in spans[1:]] + [len(text)]
        parts: dict[float, str] = {}
        begin = 0
        for time, end in zip(sent, ends, strict=True):
            parts[time] = parts.get(time, "") + text[begin:end]
            begin = end
        messages = list(parts.items())
        if "scene" in self.wanted:
            objects = {name: dict(zip("xyz", at, strict=True)) for name, at in self.wanted["scene"].items()}
            messages.insert(0, (0.0, json.dumps({"type": "scene", "objects": objects})))
        return messages

    @property
    def live_instants(self) -> list[Instant]:
        """The instants at which a face is checked while it plays."""
        return [Instant(float(face["at"]), face.get("character")) for face in self.wanted.get("face", ())]

    @property
    def smooth_instants(self) -> list[Instant]:
        """The instants at which faces are sampled after the end, to find jumps."""
        instants: list[Instant] = []
        for smooth in self.wanted.get("smooth", ()):
            steps = np.arange(math.floor(smooth["from"] * 100), math.ceil(smooth["to"] * 100) + 1)
            instants += [Instant(float(step) / 100, smooth.get("character")) for step in steps]
        return instants


@cache
def _cases() -> tuple[Case, ...]:
    return tuple(Case(path) for path in sorted(CORPUS.rglob("*.toml")) if path.parent != CORPUS)


CASES = _cases()
