"""The cases of the corpus: NAME.xml, a document or several, and NAME.toml, what must be true when they play.

A case is played as a session would: the player is told the time; no clock, no sound, no idle motion.
Keys of a .toml; all but `says` and `proves` are optional:

    says       what must be true, as a sentence
    proves     the rules (tests/corpus/rules.toml) that it shows to hold

    sent       when each document of the .xml is sent, seconds; 0 for those beyond the list
    ready      when each is ready to be planned (its voice has spoken), seconds; else when it is sent
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
    [late]     "block:behaviour" = seconds, its attribute realizer:late in that prediction

    log        everything that was told, in this order, of those kinds that the list names. An entry is
               "KIND ID [WORD] [SECONDS [SECONDS]]" with seconds of the session clock:
                   prediction b LURKING 0 2     of a block, with its start and end
                   start b IN_EXEC 0            blockProgress
                   sync b:nod:stroke 0.37       syncPointProgress
                   end b DONE 2                 blockProgress
                   warning b:nod PARSING_FAILURE
               words and seconds may be left out from the end
    among      these were told in this order, among others
    characters the characterIds that feedback names, each one; [""] for none
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
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bml_schema import BlockProgress, Feedback, PredictionFeedback, SyncPointProgress, WarningFeedback

__all__ = ["CASES", "CORPUS", "Case", "Instant", "Told", "told"]

CORPUS = Path(__file__).parent / "corpus"
_KEYS = frozenset(re.findall(r"^    \[*(\w+)", __doc__, re.MULTILINE)) | {"path", "line"}


class Told(NamedTuple):
    """A feedback message, or an expectation of one, as a line of `log`."""

    kind: str
    id: str
    words: tuple[str, ...] = ()
    times: tuple[float, ...] = ()

    @classmethod
    def read(cls, line: str) -> Told:
        """Parse a line; raise ValueError for a wrong one."""
        kind, id, *rest = line.split()
        if kind not in ("prediction", "start", "sync", "end", "warning"):
            raise ValueError(f"{line}: wanted prediction, start, sync, end or warning")
        words = tuple(w for w in rest if not w[0].isdigit() and w[0] not in "-.")
        return cls(kind, id, words, tuple(map(float, rest[len(words) :])))

    def is_as(self, wanted: Told, within: float) -> bool:
        """Whether it matches `wanted`, whose last words and seconds may be missing."""
        return (
            (self.kind, self.id) == (wanted.kind, wanted.id)
            and self.words[: len(wanted.words)] == wanted.words
            and len(self.times) >= len(wanted.times)
            and all(abs(a - b) <= within for a, b in zip(self.times, wanted.times, strict=False))
        )

    def __str__(self) -> str:
        return " ".join([self.kind, self.id, *self.words, *(f"{time:.6g}" for time in self.times)])


def told(feedback: Feedback) -> Iterable[Told]:
    """Return the lines of one feedback message; a prediction has one for each block."""
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
    def looks(self) -> list[Instant]:
        """The instants at which this case looks at a playing face."""
        return [Instant(float(face["at"]), face.get("character")) for face in self.wanted.get("face", ())]

    @property
    def watches(self) -> list[Instant]:
        """The instants that it checks after the end."""
        seen: list[Instant] = []
        for smooth in self.wanted.get("smooth", ()):
            steps = np.arange(math.floor(smooth["from"] * 100), math.ceil(smooth["to"] * 100) + 1)
            seen += [Instant(float(step) / 100, smooth.get("character")) for step in steps]
        return seen


@cache
def _cases() -> tuple[Case, ...]:
    return tuple(Case(path) for path in sorted(CORPUS.rglob("*.toml")) if path.parent != CORPUS)


CASES = _cases()
