"""A designer's timeline file in (TOML or JSON), its tracks of expressions and when each shows out."""

from __future__ import annotations

import difflib
import json
import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal, cast, get_args

from realizer.errors import TableError
from realizer.expressions.expression import Expression, key
from realizer.expressions.library import Library

__all__ = ["Entry", "Span", "Timeline", "Track", "evident", "faults_of", "lasts", "read_timeline", "spans"]

Joins = Literal["both", "onset", "offset"]
Curve = Literal["linear", "smooth"]
NEUTRAL = "NEUTRAL"
BREAK = 0.5  # s; a break that says no duration
LONGEST = 3600.0  # s
TRACK = ("name", "start", "joins", "curve", "entries")
ENTRY = ("expression", "intensity", "duration")


@dataclass(frozen=True, slots=True)
class Entry:
    """One place of a track.

    Attributes:
        expression: its name in the library; "neutral" is a break.
        intensity: 0..1.
        duration: seconds from its beginning to its end, onset and offset with it; None is the expression's
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
        joins: what lies between two entries: the "offset" of the first, the "onset" of the second, or both.
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
    """Tracks that play together."""

    tracks: tuple[Track, ...]


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

    An entry lies from the end of the one before it to the start of the next. Its onset lies at its beginning
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


def lasts(timeline: Timeline, library: Mapping[str, Expression]) -> float:
    """Seconds to the end of the longest track."""
    return max(spans(track, library)[-1].end for track in timeline.tracks)


def evident(
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


def faults_of(timeline: Timeline, library: Library) -> list[str]:
    """Entries whose expression is not in the library: channel, entry, what was wanted, what came."""
    return [
        f"channel {track.name}, entry {number}, expression: {library.unknown(entry.expression)}"
        for track in timeline.tracks
        for number, entry in enumerate(track.entries, 1)
        if not entry.neutral and entry.expression not in library
    ]


def _onset_and_offset(entry: Entry, library: Mapping[str, Expression]) -> tuple[float, float]:
    if entry.neutral:
        return 0.0, 0.0
    expression = library[entry.expression]
    return expression.onset, expression.offset


def read_timeline(content: bytes) -> Timeline:
    """A timeline of TOML or, where it begins with "{", of JSON.

        [[channel]]
        name = "brows"
        joins = "both"          # or "onset", "offset"
        curve = "linear"        # or "smooth"
        start = 0.0
        entries = [
            { expression = "template:surprise", intensity = 0.8, duration = 1.2 },
            { expression = "neutral", duration = 0.5 },
            { expression = "template:anger" },
        ]

    Raises:
        TableError: all that is wrong, a line each: channel, entry, what was wanted, what came.
    """
    try:
        text = content.decode("utf-8-sig")
        told = json.loads(text) if text.lstrip().startswith("{") else tomllib.loads(text)
    except (UnicodeDecodeError, json.JSONDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise TableError(f"wanted a timeline in TOML or JSON, got: {error}") from None
    reading = _Reading()
    timeline = reading.timeline(told)
    if reading.faults:
        raise TableError("\n".join(reading.faults))
    return timeline


class _Reading:
    """What is wrong with a file, as it is read."""

    def __init__(self) -> None:
        self.faults: list[str] = []

    def _fault(self, place: str, wanted: str, got: object) -> None:
        words = repr(got)
        self.faults.append(
            f"{place}: wanted {wanted}, got {words if len(words) <= 80 else words[:80] + '...'}"
        )

    def _keys(self, row: Mapping[str, Any], known: Sequence[str], place: str) -> None:
        for name in row:
            if name not in known:
                near = difflib.get_close_matches(name, known, n=1)
                hint = f"; did you mean {near[0]}?" if near else ""
                self.faults.append(f"{place}: wanted {', '.join(known)}, got {name!r}{hint}")

    def timeline(self, told: Mapping[str, Any]) -> Timeline:
        self._keys(told, ("channel",), "timeline")
        rows = told.get("channel")
        if not isinstance(rows, list) or not rows:
            self._fault("timeline", "channels, [[channel]] each", rows)
            return Timeline(())
        return Timeline(tuple(self._track(row, number) for number, row in enumerate(rows, 1)))

    def _track(self, row: Any, number: int) -> Track:
        place = f"channel {number}"
        if not isinstance(row, dict):
            self._fault(place, "a table with entries", row)
            return Track(place, ())
        self._keys(row, TRACK, place)
        name = row.get("name", str(number))
        if not isinstance(name, str) or not name.strip():
            self._fault(f"{place}, name", "a name", name)
        place = f"channel {name}"
        entries = row.get("entries")
        if not isinstance(entries, list) or not entries:
            self._fault(f"{place}, entries", "a list of { expression, intensity, duration }", entries)
            entries = []
        return Track(
            str(name),
            tuple(self._entry(entry, f"{place}, entry {k}") for k, entry in enumerate(entries, 1)),
            cast(Joins, self._choice(row, "joins", get_args(Joins), place)),
            cast(Curve, self._choice(row, "curve", get_args(Curve), place)),
            self._number(row, "start", 0.0, 0.0, LONGEST, place),
        )

    def _entry(self, row: Any, place: str) -> Entry:
        if not isinstance(row, dict):
            self._fault(place, "{ expression, intensity, duration }", row)
            return Entry("")
        self._keys(row, ENTRY, place)
        expression = row.get("expression")
        if not isinstance(expression, str) or not expression.strip():
            self._fault(f"{place}, expression", "the name of an expression, or neutral", expression)
            expression = ""
        duration = self._number(row, "duration", 0.04, 0.04, LONGEST, place) if "duration" in row else None
        return Entry(expression, self._number(row, "intensity", 1.0, 0.0, 1.0, place), duration)

    def _choice(self, row: Mapping[str, Any], name: str, known: Sequence[str], place: str) -> str:
        value = row.get(name, known[0])
        if value not in known:
            self._fault(f"{place}, {name}", " or ".join(known), value)
            return known[0]
        return str(value)

    def _number(
        self, row: Mapping[str, Any], name: str, usual: float, low: float, high: float, place: str
    ) -> float:
        value = row.get(name, usual)
        number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        if number and low <= value <= high:
            return float(value)
        self._fault(f"{place}, {name}", f"a number {low:g}..{high:g}", value)
        return usual
