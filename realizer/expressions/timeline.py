"""Timelines: tracks of expressions and a mixer, with checks against a library and a face."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

from realizer.expressions.expression import key
from realizer.expressions.library import Library

Joins = Literal["both", "onset", "offset"]
Curve = Literal["linear", "smooth"]
Mixer = Literal["additive", "successive"]
NEUTRAL = "NEUTRAL"


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry of a track."""

    expression: str  # name in the library; "neutral" is a break
    intensity: float = 1.0  # 0..1
    # Seconds including onset and offset; None: the expression's own, or 0.5 s of a break.
    duration: float | None = None
    onset: float | None = None  # seconds; None: the expression's own. A break has none.
    offset: float | None = None  # seconds; None: the expression's own. A break has none.
    because: str | None = None  # the reason for it, for readers of the file

    @property
    def neutral(self) -> bool:
        return key(self.expression) == NEUTRAL


@dataclass(frozen=True, slots=True)
class Track:
    """A sequence of expressions that blend into each other (a channel of Wojdel 2005, 5.4.2)."""

    name: str  # name in messages
    entries: tuple[Entry, ...]  # at least one
    joins: Joins = "both"  # transition between entries: "offset" of the first, "onset" of the second, or both
    curve: Curve = "linear"  # shape of transitions; Wojdel's are "linear"
    start: float = 0.0  # seconds from the start of the timeline


@dataclass(frozen=True, slots=True)
class Timeline:
    """Tracks that play together."""

    tracks: tuple[Track, ...]  # at least one
    # How action units of the whole face are combined: added up ("additive"), or applied one after the other
    # ("successive"; Wojdel 2005, 5.1 and 5.4.1).
    mixer: Mixer = "additive"
    # Action units that the successive mixer applies first; the others follow by number.
    order: tuple[int, ...] = ()


def faults_of(timeline: Timeline, library: Library) -> list[str]:
    """Return a message for each entry whose expression is not in the library."""
    return [
        f"channel {track.name}, entry {number}, expression: {library.unknown(entry.expression)}"
        for track in timeline.tracks
        for number, entry in enumerate(track.entries, 1)
        if not entry.neutral and entry.expression not in library
    ]


def remarks(timeline: Timeline, inputs: Collection[str] | None = None) -> list[str]:
    """Return a message for each mixer setting that has no effect.

    Args:
        inputs: inputs of the face (`Face.inputs`); None: unknown.
    """
    if timeline.mixer == "additive":
        message = 'order: no effect, a sum has no order; wanted mixer = "successive"'
        return [message] if timeline.order else []
    if inputs is None:
        return []
    if "successive" not in inputs:
        return ["mixer: no effect, FAPs move this face; wanted a face that action units move (deformer au)"]
    unmixed = [str(au) for au in timeline.order if f"rank {au}" not in inputs]
    message = (
        f"order: no effect on {', '.join(unmixed)}, which this face does not mix with other action units"
    )
    return [message] if unmixed else []
