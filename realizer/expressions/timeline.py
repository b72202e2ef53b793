"""The timeline value: tracks of expressions and a mixer; and checks against a library and a face."""

from __future__ import annotations

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
    """An entry of a track.

    Attributes:
        expression: its name in the library; "neutral" is a break.
        intensity: 0..1.
        duration: seconds with onset and offset; None is the expression's
            own, of a break half a second.
    """

    expression: str
    intensity: float = 1.0
    duration: float | None = None

    @property
    def neutral(self) -> bool:
        return key(self.expression) == NEUTRAL


@dataclass(frozen=True, slots=True)
class Track:
    """A channel of Wojdel 2005, 5.4.2: expressions one after the other, the next grown out of the last.

    Attributes:
        name: for messages.
        entries: at least one.
        joins: the transition between two entries: "offset" of the first, "onset" of the second, or both.
        curve: "linear" as hers, or "smooth".
        start: seconds from the timeline's start.
    """

    name: str
    entries: tuple[Entry, ...]
    joins: Joins = "both"
    curve: Curve = "linear"
    start: float = 0.0


@dataclass(frozen=True, slots=True)
class Timeline:
    """Tracks that play together.

    Attributes:
        tracks: at least one.
        mixer: how the action units of the face are combined while it plays: added up, or one after the other
            (Wojdel 2005, 5.1). It holds for the whole face, as in hers (5.4.1).
        order: the action units that the successive mixer takes first, in this order; all others follow as
            they are numbered.
    """

    tracks: tuple[Track, ...]
    mixer: Mixer = "additive"
    order: tuple[int, ...] = ()


def faults_of(timeline: Timeline, library: Library) -> list[str]:
    """Yield entries whose expression is not in the library: channel, entry, what was wanted, what came."""
    return [
        f"channel {track.name}, entry {number}, expression: {library.unknown(entry.expression)}"
        for track in timeline.tracks
        for number, entry in enumerate(track.entries, 1)
        if not entry.neutral and entry.expression not in library
    ]


def remarks(timeline: Timeline, inputs: Collection[str] | None = None) -> list[str]:
    """Yield mixer requests of a timeline that have no effect, a sentence each.

    Args:
        inputs: what moves the face (`Face.takes`); None: it is not known.
    """
    if timeline.mixer == "additive":
        told = 'order: no effect, a sum has no order; wanted mixer = "successive"'
        return [told] if timeline.order else []
    if inputs is None:
        return []
    if "successive" not in inputs:
        return ["mixer: no effect, FAPs move this face; wanted a face that action units move (deformer au)"]
    aside = [str(au) for au in timeline.order if f"rank {au}" not in inputs]
    told = f"order: no effect on {', '.join(aside)}, which this face does not mix with other action units"
    return [told] if aside else []
