"""The time spans of the entries of a timeline's track."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

from realizer.expressions.expression import Expression
from realizer.expressions.timeline import Entry, Timeline, Track

BREAK = 0.5  # s; a break that says no duration


@dataclass(frozen=True, slots=True)
class Span:
    """When an entry shows, in seconds from the timeline's start: whole from `reached` to `left`.

    `start` and `end` are its place in the track; what leads to it and from it may reach beyond them.
    """

    entry: Entry
    start: float
    reached: float
    left: float
    end: float


def spans(track: Track, library: Mapping[str, Expression]) -> list[Span]:
    """When each entry of a track shows.

    An entry spans from the end of the one before it to the start of the next. Its onset is at its beginning
    and its offset at its end; joined by one of them alone, the other expression is whole up to there. The
    first rises by its onset and the last goes by its offset, whatever the joins. A break has neither: the
    expression before it goes by its own offset, the one after it comes by its own onset. Where an entry is
    shorter than its onset and offset, both shrink alike, and it is whole for an instant.

    Raises:
        KeyError: an expression that is not in the library.
    """
    begins, lengths = [track.start], []
    for entry in track.entries:
        own = BREAK if entry.neutral else library[entry.expression].duration
        lengths.append(own if entry.duration is None else entry.duration)
        begins.append(begins[-1] + lengths[-1])
    times = [_onset_and_offset(entry, library) for entry in track.entries]
    # (before, after): how long it takes from one to the next, before and after the border between them.
    borders = [(0.0, times[0][0])]
    for (one, (_, offset)), (other, (onset, _)) in pairwise(zip(track.entries, times, strict=True)):
        before, after = offset, onset
        if track.joins == "onset":
            before, after = 0.0, offset if other.neutral else onset
        elif track.joins == "offset":
            before, after = onset if one.neutral else offset, 0.0
        borders.append((before, after))
    borders.append((times[-1][1], 0.0))
    found = []
    for k, (entry, length) in enumerate(zip(track.entries, lengths, strict=True)):
        rise, fall = borders[k][1], borders[k + 1][0]
        part = min(1.0, length / (rise + fall)) if rise + fall > 0 else 1.0
        begin, end = begins[k], begins[k + 1]
        found.append(Span(entry, begin, begin + rise * part, end - fall * part, end))
    return found


def duration_of(timeline: Timeline, library: Mapping[str, Expression]) -> float:
    """Seconds to the end of the longest track."""
    return max(spans(track, library)[-1].end for track in timeline.tracks)


def visible_spans(
    timeline: Timeline, library: Mapping[str, Expression]
) -> Iterator[tuple[str, Expression, float, float]]:
    """(place, expression, begin, end) of each entry but breaks: the seconds from when to when it can be seen.

    It can from half of what leads to it to half of what leads from it.
    """
    for track in timeline.tracks:
        shown = spans(track, library)
        lefts = [shown[0].start, *(span.left for span in shown)]
        reached = [*(span.reached for span in shown), shown[-1].end]
        for k, span in enumerate(shown):
            if not span.entry.neutral:
                begin, end = (lefts[k] + span.reached) / 2, (span.left + reached[k + 1]) / 2
                yield f"channel {track.name}, entry {k + 1}", library[span.entry.expression], begin, end


def _onset_and_offset(entry: Entry, library: Mapping[str, Expression]) -> tuple[float, float]:
    if entry.neutral:
        return 0.0, 0.0
    expression = library[entry.expression]
    return expression.onset, expression.offset
