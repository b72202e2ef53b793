"""Timelines: tracks of expressions and a mixer, their checks, and the times of their entries."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, NamedTuple

from realizer.expressions.expression import Expression, key
from realizer.expressions.library import Library

Joins = Literal["both", "onset", "offset"]
Curve = Literal["linear", "smooth"]
Mixer = Literal["additive", "successive"]
NEUTRAL, KEYFRAMES = "NEUTRAL", "KEYFRAMES"


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry of a track."""

    expression: str  # name in the library; "neutral" is a break, "keyframes" plays `keys`
    intensity: float = 1.0  # 0..1
    # Seconds including onset and offset; None: the expression's own, or 0.5 s of a break.
    duration: float | None = None
    onset: float | None = None  # seconds; None: the expression's own. Only expressions have one.
    offset: float | None = None  # seconds; None: the expression's own. Only expressions have one.
    because: str | None = None  # the reason for it, for readers of the file
    faps: tuple[int, ...] = ()  # FAPs of keyframes, 3..68; they override what action units give
    # Seconds from the start of the keyframes and the value of each FAP in its FAPU; linear between two keys.
    keys: tuple[tuple[float, ...], ...] = ()

    @property
    def is_expression(self) -> bool:
        return key(self.expression) not in (NEUTRAL, KEYFRAMES)

    @property
    def is_keyframes(self) -> bool:
        return key(self.expression) == KEYFRAMES


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
        if entry.is_expression and entry.expression not in library
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


BREAK = 0.5  # s, the default duration of a break


@dataclass(frozen=True, slots=True)
class Span:
    """The times of an entry, in seconds from the start of the timeline.

    The expression is at full intensity from `reached` to `left`. `start` and `end` are the borders of the
    entry; transitions may begin before and end after them.
    """

    entry: Entry
    start: float
    reached: float
    left: float
    end: float


class VisibleSpan(NamedTuple):
    """The seconds for which an entry is visible."""

    place: str  # of the entry, for messages
    expression: Expression
    begin: float  # seconds from the start of the timeline
    end: float  # seconds from the start of the timeline
    track: int  # number of the track, from 0
    entry: int  # number of the entry in it, from 0
    times: Span  # of the entry


def spans(track: Track, library: Mapping[str, Expression]) -> list[Span]:
    """Return the times of each entry of a track.

    An entry begins with its onset and ends with its offset. If `joins` is "onset" or "offset", only this one
    is used between two entries, and the other expression stays whole up to the border. The first entry
    always has its onset and the last its offset. A break has neither, nor have keyframes: the entry before
    ends with its offset, and the entry after begins with its onset. If an entry is too short, onset and
    offset are scaled to fit.

    Raises:
        KeyError: an expression that is not in the library.
    """
    begins, lengths = [track.start], []
    times = [_onset_and_offset(entry, library) for entry in track.entries]
    for entry, (onset, offset) in zip(track.entries, times, strict=True):
        if entry.is_expression:
            own = onset + library[entry.expression].apex + offset
        else:
            own = entry.keys[-1][0] if entry.keys else BREAK
        lengths.append(own if entry.duration is None else entry.duration)
        begins.append(begins[-1] + lengths[-1])
    # Seconds of the transition after the begin of each entry, and before its end.
    rises, falls = [times[0][0]], []
    for (one, (_, offset)), (other, (onset, _)) in pairwise(zip(track.entries, times, strict=True)):
        before, after = offset, onset
        if track.joins == "onset":
            before, after = 0.0, onset if other.is_expression else offset
        elif track.joins == "offset":
            before, after = offset if one.is_expression else onset, 0.0
        falls.append(before)
        rises.append(after)
    falls.append(times[-1][1])
    entries = []
    for k, (entry, length, rise, fall) in enumerate(zip(track.entries, lengths, rises, falls, strict=True)):
        part = min(1.0, length / (rise + fall)) if rise + fall > 0 else 1.0
        begin, end = begins[k], begins[k + 1]
        entries.append(Span(entry, begin, begin + rise * part, end - fall * part, end))
    return entries


def duration_of(timeline: Timeline, library: Mapping[str, Expression]) -> float:
    """Return the seconds to the end of the longest track."""
    return max(spans(track, library)[-1].end for track in timeline.tracks)


def visible_spans(timeline: Timeline, library: Mapping[str, Expression]) -> Iterator[VisibleSpan]:
    """Yield the seconds for which each expression is visible.

    An expression is visible from the middle of the transition to it to the middle of the next one.
    """
    for number, track in enumerate(timeline.tracks):
        shown = spans(track, library)
        lefts = [shown[0].start, *(span.left for span in shown)]
        reached = [*(span.reached for span in shown), shown[-1].end]
        for k, span in enumerate(shown):
            if span.entry.is_expression:
                begin, end = (lefts[k] + span.reached) / 2, (span.left + reached[k + 1]) / 2
                place, expression = f"channel {track.name}, entry {k + 1}", library[span.entry.expression]
                yield VisibleSpan(place, expression, begin, end, number, k, span)


def _onset_and_offset(entry: Entry, library: Mapping[str, Expression]) -> tuple[float, float]:
    if not entry.is_expression:
        return 0.0, 0.0
    expression = library[entry.expression]
    onset, offset = entry.onset, entry.offset
    return (expression.onset if onset is None else onset, expression.offset if offset is None else offset)
